#include "viewfactors/bodies.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <map>

#include "scene/topology.hpp"

namespace clrad {
namespace {

// Corners may stand out of a face's plane by the rounding of coordinates, times this.
constexpr double roundings = 16;

using Position = std::array<double, 3>;

// Corners and sides; false when a side is not between exactly two faces.
bool join(const Scene& scene, ConvexBody& body) {
  std::map<Position, std::uint32_t> number;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> sides;
  for (std::uint32_t f = 0; f < body.face.size(); ++f) {
    const Polygon& polygon = scene.polygons[body.face[f]];
    std::vector<std::uint32_t> corners;
    for (std::uint32_t k = 0; k < polygon.corners; ++k) {
      const glm::dvec3& at = polygon.corner[k];
      const auto [found, is_new] =
          number.emplace(Position{at.x, at.y, at.z}, std::uint32_t(body.corner.size()));
      if (is_new) body.corner.push_back({body.face[f], k});
      if (body.corner.size() > most_body_corners) return false;
      corners.push_back(found->second);
    }
    for (std::size_t k = 0; k < corners.size(); ++k)
      sides[std::minmax(corners[k], corners[(k + 1) % corners.size()])].push_back(f);
  }
  for (const auto& [ends, faces] : sides) {
    if (faces.size() != 2) return false;
    body.side.push_back({ends.first, ends.second, faces[0], faces[1]});
  }
  return true;
}

bool is_convex(const Scene& scene, const ConvexBody& body) {
  for (const std::uint32_t f : body.face) {
    const Polygon& polygon = scene.polygons[f];
    const glm::dvec3 normal = polygon.normal();
    for (const ConvexBody::Corner& c : body.corner) {
      const glm::dvec3 &at = scene.polygons[c.polygon].corner[c.index], from = polygon.corner[0];
      double largest = 0;
      for (int axis = 0; axis < 3; ++axis)
        largest = std::max({largest, std::abs(at[axis]), std::abs(from[axis])});
      if (!(glm::dot(normal, at - from) <= roundings * 0x1p-53 * largest)) return false;
    }
  }
  return true;
}

}  // namespace

std::vector<ConvexBody> convex_bodies(const Scene& scene) {
  const std::vector<std::uint32_t> closed = closed_surfaces(scene);
  std::map<std::uint32_t, ConvexBody> by_first;
  for (std::uint32_t p = 0; p < closed.size(); ++p)
    if (closed[p] != 0xffffffffu) by_first[closed[p]].face.push_back(p);
  std::vector<ConvexBody> bodies;
  for (auto& [first, body] : by_first)
    if (body.face.size() <= 2 * most_body_corners && join(scene, body) && is_convex(scene, body))
      bodies.push_back(std::move(body));
  return bodies;
}

}  // namespace clrad
