#include "solve/covered.hpp"

#include <gtest/gtest.h>

#include "clrad/clrad.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

struct Case {
  Scene scene;
  Mesh mesh;
  std::vector<OccluderTriangle> triangles;
  explicit Case(Scene s, const MeshOptions& options) : scene(std::move(s)) {
    const auto planes = plane_ids(scene);
    mesh = build_mesh(scene, frame_of(scene), planes, options);
    triangles = occluder_triangles(scene, frame_of(scene), planes);
  }
  std::vector<std::uint8_t> covered() const {
    Device device;
    const auto engine = make_engine("serial", device, triangles);
    return covered_vertices(device, scene, mesh, triangles, *engine, overlaid_vertices(scene, mesh));
  }
};

// The block of the block room stands on 2.25 <= x <= 3.25, 0.75 <= y <= 1.5 and has no bottom of its own.
TEST(Covered, WhatIsUnderABlockAndNothingElse) {
  const auto data = oracle::reference("c_scenes_with_occlusion.json");
  const Case c(oracle::scene_of(oracle::reference_case(data, "C-block-room-1").at("scene")), {0.5, 0.1});
  const auto covered = c.covered();
  int under = 0;
  for (std::uint32_t p = 0; p < c.scene.polygons.size(); ++p)
    for (std::uint32_t v = c.mesh.polygons[p].first_vertex;
         v < c.mesh.polygons[p].first_vertex + c.mesh.polygons[p].vertices; ++v) {
      const glm::dvec3 at = c.mesh.position_m[v];
      const bool inside = c.scene.polygons[p].name == "z_min" && at.x > 2.25 + 1e-9 && at.x < 3.25 - 1e-9 &&
                          at.y > 0.75 + 1e-9 && at.y < 1.5 - 1e-9;
      EXPECT_EQ(bool(covered[v]), inside)
          << c.scene.polygons[p].name << " " << at.x << " " << at.y << " " << at.z;
      under += inside;
    }
  EXPECT_GT(under, 50);
  // The block's foot is 0.75 of the floor's 12 square metres; straddling elements count by their corners.
  double exposed = 0;
  const auto shares = exposed_shares(c.mesh, covered);
  const PolygonMesh& floor = c.mesh.polygons[4];
  for (std::uint32_t k = floor.first_patch; k < floor.first_patch + floor.patches; ++k)
    exposed += shares[k] * c.mesh.patches[k].area_m2;
  EXPECT_NEAR(exposed, 12 - 0.75, 0.1 * 3.5);  // half an element around the foot's outline of 3.5 m
}

TEST(Covered, ACarpetLiesOnTheFloorThatComesBeforeIt) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  Polygon carpet;
  carpet.corners = 4;
  carpet.corner = {glm::dvec3(0.2, 0.2, 0), {0.8, 0.2, 0}, {0.8, 0.8, 0}, {0.2, 0.8, 0}};
  scene.polygons.push_back(carpet);
  const Case c(scene, {0.5, 0.125});
  const auto overlaid = overlaid_vertices(c.scene, c.mesh);
  for (std::uint32_t p = 0; p < c.scene.polygons.size(); ++p)
    for (std::uint32_t v = c.mesh.polygons[p].first_vertex;
         v < c.mesh.polygons[p].first_vertex + c.mesh.polygons[p].vertices; ++v) {
      const glm::dvec3 at = c.mesh.position_m[v];
      const bool under = p == 4 && at.x > 0.2 && at.x < 0.8 && at.y > 0.2 && at.y < 0.8;
      EXPECT_EQ(bool(overlaid[v]), under) << "polygon " << p << " " << at.x << " " << at.y;
    }
}

}  // namespace
}  // namespace clrad
