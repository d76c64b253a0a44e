#include "scene/planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "clrad/frame.hpp"

namespace clrad {
namespace {

constexpr double kTolerance = 0x1p-36;        // frame units
constexpr double kRoundings = 4.0 * 0x1p-53;  // x largest |coordinate| of the file: delta
// Cell sizes of normals (unit length) and offsets (frame units), finest first. A polygon is looked up in the
// finest table whose cells exceed the doubt about its own plane; every plane is in all tables that are used.
constexpr std::array<double, 6> kCell = {0x1p-20, 0x1p-16, 0x1p-12, 0x1p-8, 0x1p-4, 4.0};

// A plane and the polygon that fixed it, in frame coordinates.
struct Plane {
  glm::dvec3 normal, point;
  double width;
  std::uint32_t id;
};

struct FittedFacet {
  glm::dvec3 normal, middle;
  double width;  // area / longest side or diagonal
};

using Point4 = std::array<double, 4>;
using Table = std::unordered_map<std::uint64_t, std::vector<std::uint32_t>>;

FittedFacet facet_of(const Polygon& polygon, const std::array<glm::dvec3, 4>& corner) {
  FittedFacet facet{polygon.normal(), glm::dvec3(0), 0};
  double longest = 0;
  for (std::uint32_t i = 0; i < polygon.corners; ++i) {
    facet.middle += corner[i] / double(polygon.corners);
    for (std::uint32_t j = 0; j < i; ++j) longest = std::max(longest, glm::distance(corner[i], corner[j]));
  }
  glm::dvec3 twice_area(0);
  for (std::uint32_t i = 2; i < polygon.corners; ++i) {
    twice_area += glm::cross(corner[i - 1] - corner[0], corner[i] - corner[0]);
  }
  facet.width = longest > 0 ? 0.5 * glm::length(twice_area) / longest : 0;
  return facet;
}

std::uint64_t cell_key(const std::array<std::int64_t, 4>& cell) {
  std::uint64_t key = 0x9e3779b97f4a7c15ull;
  for (std::int64_t c : cell) {
    key ^= static_cast<std::uint64_t>(c) + 0x9e3779b97f4a7c15ull + (key << 6) + (key >> 2);
    key *= 0xff51afd7ed558ccdull;
    key ^= key >> 32;
  }
  return key;
}

Point4 hesse(const glm::dvec3& normal, const glm::dvec3& point) {
  return {normal.x, normal.y, normal.z, glm::dot(normal, point)};
}

// Calls visit(key) for each cell of size `cell` that the box `at` +- `reach` touches. Needs reach < cell / 2,
// so that at most 2 cells an axis do.
template <class Visit>
void for_cells_near(const Point4& at, double reach, double cell, Visit visit) {
  std::array<std::int64_t, 4> low{}, high{};
  for (int k = 0; k < 4; ++k) {
    low[k] = static_cast<std::int64_t>(std::floor((at[k] - reach) / cell + 0.5));
    high[k] = static_cast<std::int64_t>(std::floor((at[k] + reach) / cell + 0.5));
  }
  std::array<std::int64_t, 4> c{};
  for (c[0] = low[0]; c[0] <= high[0]; ++c[0])
    for (c[1] = low[1]; c[1] <= high[1]; ++c[1])
      for (c[2] = low[2]; c[2] <= high[2]; ++c[2])
        for (c[3] = low[3]; c[3] <= high[3]; ++c[3]) visit(cell_key(c));
}

}  // namespace

std::vector<std::uint32_t> plane_ids(const Scene& scene) {
  const Frame frame = frame_of(scene);
  const std::size_t count = scene.polygons.size();
  double largest = 0;
  std::vector<std::array<glm::dvec3, 4>> corners(count);
  std::vector<FittedFacet> facets(count);
  for (std::size_t p = 0; p < count; ++p) {
    const Polygon& polygon = scene.polygons[p];
    for (std::uint32_t i = 0; i < polygon.corners; ++i) {
      corners[p][i] = frame.to_frame(polygon.corner[i]);
      const glm::dvec3 size = glm::abs(polygon.corner[i]);
      largest = std::max({largest, size.x, size.y, size.z});
    }
    facets[p] = facet_of(polygon, corners[p]);
  }
  const double delta = kRoundings * std::max(1.0, largest * frame.scale());

  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::erase_if(order,
                [&](std::uint32_t p) { return scene.polygons[p].back; });  // they are in their fronts' planes
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return facets[a].width > facets[b].width; });

  // Two planes that hold a polygon within the tolerance differ in normal by about (tolerance + rounding) /
  // width and, in the frame's unit cube, in offset by sqrt(3) times that. A wider polygon's plane is
  // extrapolated from within 2 sqrt(3) frame units, which the factor 8 covers.
  const auto doubt_of = [&](double width) {
    return 8.0 * (kTolerance + delta * (1.0 + 7.0 / width)) / width;
  };
  const auto level_of = [&](double width) {
    std::size_t level = 0;
    while (level + 1 < kCell.size() && !(doubt_of(width) < 0.25 * kCell[level])) ++level;
    return level;
  };
  std::array<bool, kCell.size()> used{};
  for (const FittedFacet& facet : facets) used[level_of(facet.width)] = true;

  std::vector<Plane> planes;
  std::array<Table, kCell.size()> tables;  // only the used ones are filled
  std::vector<std::uint32_t> plane_of(count);
  for (const std::uint32_t p : order) {
    const FittedFacet& facet = facets[p];
    const auto lies_in = [&](const Plane& plane) {
      for (std::uint32_t i = 0; i < scene.polygons[p].corners; ++i) {
        const glm::dvec3 d = corners[p][i] - plane.point;
        const double allowed = kTolerance + delta * (1.0 + 2.0 * glm::length(d) / plane.width);
        if (!(std::abs(glm::dot(d, plane.normal)) <= allowed)) return false;
      }
      return true;
    };
    const std::size_t level = level_of(facet.width);
    const double reach = std::min(doubt_of(facet.width), 0.49 * kCell[level]);

    std::uint32_t best = std::numeric_limits<std::uint32_t>::max();
    const Point4 at = hesse(facet.normal, facet.middle);
    for (const double side : {1.0, -1.0}) {
      for_cells_near({side * at[0], side * at[1], side * at[2], side * at[3]}, reach, kCell[level],
                     [&](std::uint64_t key) {
                       const auto found = tables[level].find(key);
                       if (found == tables[level].end()) return;
                       for (const std::uint32_t candidate : found->second) {
                         if (candidate < best && lies_in(planes[candidate])) best = candidate;
                       }
                     });
    }
    if (best == std::numeric_limits<std::uint32_t>::max()) {
      best = static_cast<std::uint32_t>(planes.size());
      planes.push_back({facet.normal, facet.middle, facet.width, 0});
      for (std::size_t k = 0; k < kCell.size(); ++k) {
        if (!used[k]) continue;
        for_cells_near(at, 0.0, kCell[k], [&](std::uint64_t key) { tables[k][key].push_back(best); });
      }
    }
    plane_of[p] = best;
  }

  // Number planes by the first polygon, in file order, that lies in them.
  std::vector<std::uint32_t> ids(count);
  constexpr std::uint32_t kUnnumbered = std::numeric_limits<std::uint32_t>::max();
  for (Plane& plane : planes) plane.id = kUnnumbered;
  std::uint32_t next = 0;
  for (std::size_t p = 0; p < count; ++p) {
    if (scene.polygons[p].back) {
      ids[p] = ids[p - 1];
      continue;
    }
    Plane& plane = planes[plane_of[p]];
    if (plane.id == kUnnumbered) plane.id = next++;
    ids[p] = plane.id;
  }
  return ids;
}

}  // namespace clrad
