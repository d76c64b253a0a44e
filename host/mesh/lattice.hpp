// Where the lattice of one polygon lies: lattice coordinates -> frame, and what an element covers there.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "clrad/frame.hpp"
#include "clrad/mesh.hpp"

namespace clrad {

/// Lattice coordinates (i, j) of a polygon that is cut into patches_u x patches_v patches, in patches / 2^lattice_depth,
/// to positions in the frame: bilinear in a quad's corners, linear in a triangle's. Cut in the frame: a scene far from
/// the origin is cut to the same bits as one at the origin.
class LatticeMap {
 public:
  LatticeMap(const Polygon& polygon, const Frame& frame, std::uint32_t patches_u, std::uint32_t patches_v);

  glm::dvec3 position(double i, double j) const;
  /// The same, moved off the polygon's boundary by 1e-3 of `unit`, the edge of the elements around in lattice
  /// coordinates: on the very edge the contour formula is 0/0.
  glm::dvec3 inside(double i, double j, double unit) const;

 private:
  std::array<glm::dvec3, 4> corner_{};
  std::uint32_t corners_;
  double size_u_, size_v_;  // of the polygon in lattice coordinates
};

/// Edge of an element of this level in lattice coordinates.
inline std::uint32_t lattice_unit(std::uint32_t level) {
  return 1u << (lattice_depth - level);
}

/// Sets area_m2 and weight of an element from its corners (frame; 3 or 4 of them).
void measure_element(Element& element, const glm::dvec3* corner, std::uint32_t corners,
                     double metres_per_unit);

}  // namespace clrad
