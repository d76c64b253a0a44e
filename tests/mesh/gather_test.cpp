#include "mesh/gather.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

Mesh mesh_of(const Scene& scene, const MeshOptions& options) {
  return build_mesh(scene, frame_of(scene), plane_ids(scene), options);
}

// A general quad and a triangle.
Scene two_polygons() {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  scene.polygons.resize(2);
  scene.polygons[0].corner = {glm::dvec3(0, 0, 0), {2, 0, 0}, {1.5, 1, 0}, {0.25, 0.75, 0}};
  scene.polygons[1].corner = {glm::dvec3(0, 0, 1), {1, 0, 1}, {0, 1, 1}, {}};
  scene.polygons[1].corners = 3;
  return scene;
}

TEST(Mesh, AreasAndCountsAddUp) {
  const Scene scene = two_polygons();
  const Mesh mesh = mesh_of(scene, {0.6, 0.1});
  for (std::size_t p = 0; p < 2; ++p) {
    double patches = 0, elements = 0;
    for (std::uint32_t k = 0; k < mesh.polygons[p].patches; ++k)
      patches += mesh.patches[mesh.polygons[p].first_patch + k].area_m2;
    for (std::uint32_t k = 0; k < mesh.polygons[p].elements; ++k)
      elements += mesh.elements[mesh.polygons[p].first_element + k].area_m2;
    EXPECT_NEAR(patches, scene.polygons[p].area_m2(), 1e-13);
    EXPECT_NEAR(elements, scene.polygons[p].area_m2(), 1e-13);
  }
  for (const Patch& patch : mesh.patches) {
    EXPECT_EQ(patch.elements, mesh.patches[0].elements) << "a full quadtree of the same depth";
    for (std::uint32_t k = 0; k < patch.corners; ++k)
      EXPECT_LE(glm::length(patch.corner[(k + 1) % patch.corners] - patch.corner[k]), 2 * 0.6);
  }
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    double sum = 0;
    for (int k = 0; k < 4; ++k) sum += mesh.elements[e].weight[k];
    EXPECT_NEAR(sum, 1, 1e-15);
    const Patch& patch = mesh.patches[mesh.elements[e].patch];
    EXPECT_GE(e, patch.first_element);
    EXPECT_LT(e, patch.first_element + patch.elements);
  }
}

TEST(Mesh, ReceiversLieInsideTheirPolygonAndOnItsPlane) {
  const Scene scene = two_polygons();
  const Mesh mesh = mesh_of(scene, {0.6, 0.1});
  const Frame f = frame_of(scene);
  for (std::uint32_t p = 0; p < 2; ++p)
    for (std::uint32_t v = mesh.polygons[p].first_vertex;
         v < mesh.polygons[p].first_vertex + mesh.polygons[p].vertices; ++v) {
      const Polygon& polygon = scene.polygons[p];
      const glm::dvec3 r = f.from_frame(mesh.receivers[v].position);
      for (std::uint32_t k = 0; k < polygon.corners; ++k) {
        const glm::dvec3 a = polygon.corner[k], b = polygon.corner[(k + 1) % polygon.corners];
        EXPECT_GT(glm::dot(glm::cross(b - a, r - a), polygon.normal()), 0) << "vertex " << v;
      }
      EXPECT_LT(glm::length(r - mesh.position_m[v]), 2e-3 * 0.6);
    }
}

// The interpolant of a linear function is that function, so the average over a patch is its value at the centroid.
TEST(Gather, LinearFunctionAveragesToItsValueAtTheCentroid) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const Scene scene = two_polygons();
    const Mesh mesh = mesh_of(scene, {0.6, 0.1});
    Gatherer gatherer(device, mesh);
    const auto f = [](const glm::dvec3& p) { return 3 + 2 * p.x - 0.5 * p.y + p.z; };
    std::vector<double> values;
    for (const auto& p : mesh.position_m) values.push_back(f(p));
    const RealArray vertex(device, values, "values");
    RealArray patch(device, mesh.patches.size() + 5, "averages");
    gatherer.gather(vertex, patch, 5);
    const auto averages = patch.download();
    // Inputs and weights rounded once each, four products a sum, a compensated sum over elements.
    const double rounding = 16 * (precision == Precision::float64 ? 1.2e-16 : 6e-8) * 8;
    const Frame frame = frame_of(scene);
    for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
      const Patch& m = mesh.patches[p];
      // Area-weighted centroid of the two triangles.
      glm::dvec3 centroid(0);
      double area = 0;
      for (std::uint32_t k = 2; k < m.corners; ++k) {
        const double a = glm::length(glm::cross(m.corner[k - 1] - m.corner[0], m.corner[k] - m.corner[0]));
        centroid += a * (m.corner[0] + m.corner[k - 1] + m.corner[k]) / 3.0;
        area += a;
      }
      const double expected = f(frame.from_frame(centroid / area));
      EXPECT_NEAR(averages[5 + p], expected, rounding * std::abs(expected)) << "patch " << p;
    }
  }
}

}  // namespace
}  // namespace clrad
