// The polygons of a scene as view factors see them: what of each is exposed.
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "clrad/frame.hpp"
#include "clrad/scene.hpp"
#include "viewfactors/bodies.hpp"
#include "viewfactors/convex.hpp"

namespace clrad {

/// A polygon of the scene. Lengths are in frame units, positions relative to the polygon's own anchor, so that a small
/// polygon keeps all its digits wherever it stands.
struct Surface {
  glm::dvec3 anchor_m{0, 0, 0};  ///< its first corner in the file's coordinates [m]
  glm::dvec3 normal{0, 0, 1};    ///< unit length
  Convex corner;
  std::vector<Convex> exposed;  ///< what no later polygon in the same plane, facing the same way, lies on
  std::uint32_t plane = 0;
  double area = 0;     ///< of the whole polygon
  double width = 0;    ///< area / longest side or diagonal
  double largest = 0;  ///< of the coordinates in the file
  std::uint32_t body = no_body;
  static constexpr std::uint32_t no_body = 0xffffffffu;
};

struct SurfaceList {
  Frame frame;
  std::vector<Surface> surface;  ///< in the scene's order
  std::vector<ConvexBody> body;

  /// Anchor of b relative to that of a, in frame units: exact differences of the file's numbers where these are near.
  glm::dvec3 from_to(std::uint32_t a, std::uint32_t b) const {
    return (surface[b].anchor_m - surface[a].anchor_m) * frame.scale();
  }
  Convex seen_from(std::uint32_t b, const Convex& part, std::uint32_t origin) const {
    Convex moved = part;
    const glm::dvec3 by = from_to(origin, b);
    for (glm::dvec3& c : moved) c += by;
    return moved;
  }
  /// How far a point at `distance` from surface a, itself given to `largest`'s last place, may be off a's plane by the
  /// rounding of coordinates and normal.
  double doubt(std::uint32_t a, double distance, double largest) const;
};

SurfaceList surfaces_of(const Scene& scene);

}  // namespace clrad
