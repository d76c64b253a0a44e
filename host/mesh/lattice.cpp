#include "mesh/lattice.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

constexpr double inset = 1e-3;

}  // namespace

LatticeMap::LatticeMap(const Polygon& polygon, const Frame& frame, std::uint32_t patches_u,
                       std::uint32_t patches_v)
    : corners_(polygon.corners),
      size_u_(double(patches_u) * lattice_unit(0)),
      size_v_(double(patches_v) * lattice_unit(0)) {
  for (std::uint32_t k = 0; k < corners_; ++k) corner_[k] = frame.to_frame(polygon.corner[k]);
}

glm::dvec3 LatticeMap::position(double i, double j) const {
  const auto& c = corner_;
  const double u = i / size_u_, v = j / size_v_;
  if (corners_ == 3) return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
  return (1 - u) * (1 - v) * c[0] + u * (1 - v) * c[1] + u * v * c[2] + (1 - u) * v * c[3];
}

glm::dvec3 LatticeMap::inside(double i, double j, double unit) const {
  const double least = inset * unit;
  if (corners_ == 4)
    return position(std::clamp(i, least, size_u_ - least), std::clamp(j, least, size_v_ - least));
  // Barycentric coordinates; their sum stays, so what is added to one comes off the largest.
  double b[3] = {size_u_ - i - j, i, j};
  double added = 0;
  for (double& x : b)
    if (x < least) added += least - x, x = least;
  *std::max_element(b, b + 3) -= added;
  return position(b[1], b[2]);
}

void measure_element(Element& element, const glm::dvec3* corner, std::uint32_t corners,
                     double metres_per_unit) {
  glm::dvec3 p[4];
  for (std::uint32_t k = 0; k < corners; ++k) p[k] = corner[k] * metres_per_unit;
  if (corners == 3) {
    element.area_m2 = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    element.weight = {1.0 / 3, 1.0 / 3, 1.0 / 3, 0};
    return;
  }
  // A planar quad's bilinear map has a Jacobian that is linear over it: J = sum of N_k J_k with J_k twice the area of
  // the corner triangle at k, and the integral of N_k N_l is 1/9 (same), 1/18 (neighbours) or 1/36 (opposite).
  double jacobian[4];
  for (int k = 0; k < 4; ++k)
    jacobian[k] = glm::length(glm::cross(p[(k + 1) % 4] - p[k], p[(k + 3) % 4] - p[k]));
  element.area_m2 = (jacobian[0] + jacobian[1] + jacobian[2] + jacobian[3]) / 4;
  for (int k = 0; k < 4; ++k)
    element.weight[k] =
        (4 * jacobian[k] + 2 * jacobian[(k + 1) % 4] + jacobian[(k + 2) % 4] + 2 * jacobian[(k + 3) % 4]) /
        (36 * element.area_m2);
}

}  // namespace clrad
