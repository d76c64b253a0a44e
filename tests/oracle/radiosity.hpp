// The whole solve again, scalar, in double, for clarity alone: the oracle of the device's pipeline.
#pragma once
#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"

namespace clrad::oracle {

/// Lambert's contour formula of a convex polygon clipped at the receiver's horizon.
inline double point_form_factor(const glm::dvec3& p, const glm::dvec3& n,
                                const std::vector<glm::dvec3>& polygon) {
  std::vector<glm::dvec3> above;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const glm::dvec3 a = polygon[k] - p, b = polygon[(k + 1) % polygon.size()] - p;
    const double ha = glm::dot(a, n), hb = glm::dot(b, n);
    if (ha >= 0) above.push_back(a);
    if (ha * hb < 0) above.push_back(a + (b - a) * (ha / (ha - hb)));
  }
  double sum = 0;
  for (std::size_t k = 0; k < above.size(); ++k) {
    const glm::dvec3 a = above[k], b = above[(k + 1) % above.size()], c = glm::cross(a, b);
    const double length = glm::length(c);
    if (length > 0) sum -= std::atan2(length, glm::dot(a, b)) * glm::dot(c, n) / length;
  }
  return sum / (2 * M_PI);
}

/// B of every patch when each patch's column is averaged over its elements as the mesh says:
/// (I - diag(rho) F) B = E, solved directly. `visible(receiver, patch)` is the visible share, 1 in a convex scene;
/// covered vertices receive nothing, and B is that of the part of a patch that nothing covers.
inline Eigen::VectorXd patch_radiosity(const Scene& scene, const Mesh& mesh, std::uint32_t band,
                                       const std::vector<std::uint8_t>& covered,
                                       const std::function<double(std::uint32_t, std::uint32_t)>& visible) {
  const auto n = Eigen::Index(mesh.patches.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd e(n), exposed = Eigen::VectorXd::Zero(n);
  for (const Element& element : mesh.elements)
    for (int k = 0; k < 4; ++k)
      if (element.vertex[k] != 0xffffffffu && !covered[element.vertex[k]])
        exposed(element.patch) += element.area_m2 / mesh.patches[element.patch].area_m2 * element.weight[k];
  for (Eigen::Index j = 0; j < n; ++j) {
    const Patch& shooter = mesh.patches[std::size_t(j)];
    const std::vector<glm::dvec3> corners(shooter.corner.begin(), shooter.corner.begin() + shooter.corners);
    const glm::dvec3 normal = scene.polygons[shooter.polygon].normal();
    const std::uint32_t plane = mesh.receivers[mesh.polygons[shooter.polygon].first_vertex].plane;
    std::vector<double> column(mesh.vertex_count());
    for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      const Point& r = mesh.receivers[v];
      if (covered[v] || r.plane == plane || glm::dot(r.position - corners[0], normal) <= 0) continue;
      column[v] = point_form_factor(r.position, r.normal, corners) * visible(v, std::uint32_t(j));
    }
    for (const Element& element : mesh.elements) {
      const Patch& patch = mesh.patches[element.patch];
      const double rho =
          scene.materials[scene.polygons[patch.polygon].material].reflectance[band] / exposed(element.patch);
      for (int k = 0; k < 4; ++k)
        if (element.vertex[k] != 0xffffffffu)
          a(element.patch, j) -=
              rho * element.area_m2 / patch.area_m2 * element.weight[k] * column[element.vertex[k]];
    }
    e(j) = scene.materials[scene.polygons[shooter.polygon].material].emitted_exitance[band];
  }
  return a.partialPivLu().solve(e);
}

}  // namespace clrad::oracle
