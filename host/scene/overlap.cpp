#include "scene/overlap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <map>

#include "clrad/frame.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

constexpr double kDepth = 1e-9;  // frame units

// A polygon seen along the longest component of its normal.
struct Shadow {
  std::uint32_t polygon = 0, corners = 0;
  std::array<glm::dvec2, 4> corner{};
  glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

Shadow shadow_of(const Polygon& polygon, std::uint32_t index, const Frame& frame, int along) {
  Shadow shadow;
  shadow.polygon = index;
  shadow.corners = polygon.corners;
  for (std::uint32_t i = 0; i < polygon.corners; ++i) {
    const glm::dvec3 c = frame.to_frame(polygon.corner[i]);
    shadow.corner[i] = {c[(along + 1) % 3], c[(along + 2) % 3]};
    shadow.low = glm::min(shadow.low, shadow.corner[i]);
    shadow.high = glm::max(shadow.high, shadow.corner[i]);
  }
  return shadow;
}

// A side of `a` that has all of `b` beyond it, or less than kDepth inside.
bool has_separating_side(const Shadow& a, const Shadow& b) {
  double area = 0;
  for (std::uint32_t i = 2; i < a.corners; ++i) {
    const glm::dvec2 u = a.corner[i - 1] - a.corner[0], v = a.corner[i] - a.corner[0];
    area += u.x * v.y - u.y * v.x;
  }
  for (std::uint32_t i = 0; i < a.corners; ++i) {
    const glm::dvec2 side = a.corner[(i + 1) % a.corners] - a.corner[i];
    const glm::dvec2 inward = glm::normalize(glm::dvec2(-side.y, side.x)) * (area > 0 ? 1.0 : -1.0);
    double deepest = -std::numeric_limits<double>::infinity();
    for (std::uint32_t k = 0; k < b.corners; ++k) {
      deepest = std::max(deepest, glm::dot(b.corner[k] - a.corner[i], inward));
    }
    if (deepest <= kDepth) return true;
  }
  return false;
}

bool same_corners(const Polygon& a, const Polygon& b) {
  return a.corners == b.corners && std::is_permutation(a.corner.begin(), a.corner.begin() + a.corners,
                                                       b.corner.begin(), b.corner.begin() + b.corners);
}

int longest_component(const glm::dvec3& v) {
  const glm::dvec3 size = glm::abs(v);
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

}  // namespace

void check_overlaps(const Scene& scene, std::vector<Diagnostic>& findings) {
  const Frame frame = frame_of(scene);
  const std::vector<std::uint32_t> plane = plane_ids(scene);
  // Plane and facing -> polygons.
  struct Group {
    int along;
    std::vector<Shadow> shadows;
  };
  std::map<std::pair<std::uint32_t, bool>, Group> groups;
  std::map<std::uint32_t, glm::dvec3> first_normal;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const glm::dvec3 normal = scene.polygons[p].normal();
    const glm::dvec3& first = first_normal.emplace(plane[p], normal).first->second;
    const int along = longest_component(first);
    Group& group =
        groups.try_emplace({plane[p], glm::dot(first, normal) > 0}, Group{along, {}}).first->second;
    group.shadows.push_back(shadow_of(scene.polygons[p], p, frame, along));
  }
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> under(scene.polygons.size(), kNone);  // the earliest polygon that each lies on
  for (auto& [key, group] : groups) {
    std::vector<Shadow>& shadows = group.shadows;
    std::sort(shadows.begin(), shadows.end(),
              [](const Shadow& a, const Shadow& b) { return a.low.x < b.low.x; });
    std::vector<const Shadow*> active;
    for (const Shadow& s : shadows) {
      std::erase_if(active, [&](const Shadow* a) { return a->high.x - kDepth <= s.low.x; });
      for (const Shadow* a : active) {
        if (a->high.y - kDepth <= s.low.y || s.high.y - kDepth <= a->low.y) continue;
        if (has_separating_side(*a, s) || has_separating_side(s, *a)) continue;
        const auto [earlier, later] = std::minmax(a->polygon, s.polygon);
        if (same_corners(scene.polygons[earlier], scene.polygons[later])) continue;
        under[later] = std::min(under[later], earlier);
      }
      active.push_back(&s);
    }
  }
  for (std::uint32_t p = 0; p < under.size(); ++p) {
    if (under[p] == kNone) continue;
    const Polygon& below = scene.polygons[under[p]];
    findings.push_back({Diagnostic::Severity::warning, "overlap", scene.polygons[p].where,
                        fmt::format("\"{}\" lies on \"{}\" ({}) in one plane and covers part of it",
                                    scene.polygons[p].name, below.name, below.where.text())});
  }
}

}  // namespace clrad
