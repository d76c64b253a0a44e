#include "viewfactors/surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>

#include "scene/planes.hpp"

namespace clrad {
namespace {

// Overlaps narrower than this are rounding (frame units), as scene/overlap.cpp has it.
constexpr double overlap_depth = 1e-9;

bool boxes_meet(const Convex& a, const Convex& b) {
  glm::dvec3 low_a = a[0], high_a = a[0], low_b = b[0], high_b = b[0];
  for (const auto& c : a) low_a = glm::min(low_a, c), high_a = glm::max(high_a, c);
  for (const auto& c : b) low_b = glm::min(low_b, c), high_b = glm::max(high_b, c);
  return !glm::any(glm::lessThan(high_a, low_b)) && !glm::any(glm::lessThan(high_b, low_a));
}

}  // namespace

double SurfaceList::doubt(std::uint32_t a, double distance, double largest) const {
  const Surface& s = surface[a];
  const double rounding = 4 * 0x1p-53 * std::max({s.largest, largest, distance}) *
                          (1 + (s.width > 0 ? 2 * distance / s.width : 0));
  return rounding;
}

SurfaceList surfaces_of(const Scene& scene) {
  SurfaceList list;
  list.frame = frame_of(scene);
  const double scale = list.frame.scale();
  const std::vector<std::uint32_t> planes = plane_ids(scene);
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_plane;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    Surface s;
    s.anchor_m = polygon.corner[0];
    s.normal = polygon.normal();
    s.plane = planes[p];
    double longest = 0;
    for (std::uint32_t k = 0; k < polygon.corners; ++k) {
      s.corner.push_back((polygon.corner[k] - s.anchor_m) * scale);
      for (int axis = 0; axis < 3; ++axis)
        s.largest = std::max(s.largest, std::abs(polygon.corner[k][axis]) * scale);
      for (const glm::dvec3& c : s.corner) longest = std::max(longest, glm::distance(c, s.corner[k]));
    }
    s.area = polygon.area_m2() * scale * scale;
    s.width = longest > 0 ? s.area / longest : 0;
    s.exposed = {s.corner};
    by_plane[s.plane].push_back(p);
    list.surface.push_back(std::move(s));
  }
  list.body = convex_bodies(scene);
  for (std::uint32_t b = 0; b < list.body.size(); ++b)
    for (const std::uint32_t face : list.body[b].face) list.surface[face].body = b;
  for (const auto& [plane, members] : by_plane)
    for (std::size_t below = 0; below < members.size(); ++below)
      for (std::size_t above = below + 1; above < members.size(); ++above) {
        Surface& s = list.surface[members[below]];
        const Surface& cover = list.surface[members[above]];
        if (glm::dot(s.normal, cover.normal) < 0) continue;
        const Convex hole = list.seen_from(members[above], cover.corner, members[below]);
        if (!boxes_meet(s.corner, hole)) continue;
        std::vector<Convex> left;
        const double tolerance = std::min(overlap_depth, 1e-6 * std::min(s.width, cover.width));
        for (const Convex& piece : s.exposed)
          for (Convex& rest : without(piece, hole, s.normal, tolerance)) left.push_back(std::move(rest));
        s.exposed = std::move(left);
      }
  return list;
}

}  // namespace clrad
