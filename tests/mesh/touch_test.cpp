// Vertices that touch other surfaces go to the front of what they touch, the others stay where they are.
#include "mesh/touch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/solver.hpp"
#include "mesh/build.hpp"
#include "render/support.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

struct Touched {
  Scene scene;
  Frame frame;
  Mesh before, after;
  std::uint32_t moved = 0;

  glm::dvec3 move_m(std::uint32_t v) const {
    return (after.receivers[v].position - before.receivers[v].position) * frame.metres();
  }
  // Where the vertex of polygon 0 at this position went.
  glm::dvec3 move_at(const glm::dvec3& position_m) const {
    for (std::uint32_t v = 0; v < before.polygons[0].vertices; ++v)
      if (glm::distance(before.position_m[v], position_m) < 1e-9) return move_m(v);
    ADD_FAILURE() << "no vertex at " << position_m.x << " " << position_m.y << " " << position_m.z;
    return {};
  }
};

// A floor of 4 m with elements of 0.5 m, and what stands on it.
Touched touched(std::vector<Polygon> on_it, const DeviceOptions& options = {}) {
  std::vector<Polygon> all{test::polygon({{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}})};
  all.insert(all.end(), on_it.begin(), on_it.end());
  Touched t;
  t.scene = test::scene(all);
  t.frame = frame_of(t.scene);
  const auto planes = plane_ids(t.scene);
  t.before = build_mesh(t.scene, t.frame, planes, {.patch_edge_m = 1, .element_edge_m = 0.5});
  t.after = t.before;
  Device device(options);
  const Tree tree(device, Occluders(device, occluder_triangles(t.scene, t.frame, planes)));
  t.moved = move_off_touched(device, t.scene, t.frame, tree, t.after);
  return t;
}

// Four sides, facing out, of a block on the floor.
std::vector<Polygon> block(double x0, double y0, double x1, double y1) {
  return {test::polygon({{x0, y0, 0}, {x1, y0, 0}, {x1, y0, 1}, {x0, y0, 1}}),
          test::polygon({{x1, y0, 0}, {x1, y1, 0}, {x1, y1, 1}, {x1, y0, 1}}),
          test::polygon({{x1, y1, 0}, {x0, y1, 0}, {x0, y1, 1}, {x1, y1, 1}}),
          test::polygon({{x0, y1, 0}, {x0, y0, 0}, {x0, y0, 1}, {x0, y1, 1}})};
}

constexpr double step = 0.5e-3;  // of elements of 0.5 m

void expect_near(const glm::dvec3& got, const glm::dvec3& want) {
  // The direction is made in float.
  EXPECT_LT(glm::distance(got, want), 1e-6 * step) << got.x << " " << got.y << " " << got.z;
}

TEST(Touch, FeetAndCornersOfABlockMoveOutOfIt) {
  for (const DeviceOptions& options :
       {DeviceOptions{}, DeviceOptions{.precision = Precision::float64}, DeviceOptions{.packet_width = 1}}) {
    const Touched t = touched(block(0.5, -0.5, 1.5, 0.5), options);
    expect_near(t.move_at({0.5, -0.5, 0}), {-step, -step, 0});
    expect_near(t.move_at({1.5, 0.5, 0}), {step, step, 0});
    expect_near(t.move_at({1, -0.5, 0}), {0, -step, 0});
    expect_near(t.move_at({0.5, 0, 0}), {-step, 0, 0});
    expect_near(t.move_at({1, 0, 0}), {0, 0, 0});  // inside
    expect_near(t.move_at({2, 2, 0}), {0, 0, 0});  // nothing is there
    expect_near(t.move_at({-1, 0, 0}), {0, 0, 0});
    EXPECT_EQ(t.moved, 8u);  // the block's own are inside of their polygons' edges already
    for (std::uint32_t v = 0; v < t.before.vertex_count(); ++v)
      EXPECT_EQ(t.before.position_m[v], t.after.position_m[v]);  // drawn where they were
  }
}

TEST(Touch, TheInsideOfARoomsCornerStaysInTheRoom) {
  // Two sheets that meet; the room is where both face.
  const Touched t = touched({test::polygon({{2, 0, 0}, {0, 0, 0}, {0, 0, 1}, {2, 0, 1}}),
                             test::polygon({{0, 0, 0}, {0, 2, 0}, {0, 2, 1}, {0, 0, 1}})});
  const glm::dvec3 one = t.scene.polygons[1].normal(), two = t.scene.polygons[2].normal();
  expect_near(t.move_at({0, 0, 0}), step * (one + two));
  expect_near(t.move_at({1, 0, 0}), step * one);
}

TEST(Touch, BetweenSurfacesThatFaceEachOtherNothingMoves) {
  const Polygon wall = test::polygon({{-1, 0, 0}, {1, 0, 0}, {1, 0, 1}, {-1, 0, 1}});
  const Polygon other = test::polygon({{1, 1e-5, 0}, {-1, 1e-5, 0}, {-1, 1e-5, 1}, {1, 1e-5, 1}});
  ASSERT_LT(glm::dot(wall.normal(), other.normal()), -0.99);
  EXPECT_EQ(touched({wall, other}).moved, 0u);
  EXPECT_GT(touched({wall}).moved, 0u);
}

TEST(Touch, WhatHoversOrLiesFlatMovesNothing) {
  EXPECT_EQ(touched({test::polygon({{-1, -1, 1e-5}, {1, -1, 1e-5}, {1, 1, 1e-5}, {-1, 1, 1e-5}})}).moved, 0u);
  EXPECT_EQ(touched({test::polygon({{-1, 0, 0.01}, {1, 0, 0.01}, {1, 0, 1}, {-1, 0, 1}})}).moved, 0u);
}

// At the corner of a block three quarters of the surroundings are seen. Light comes from all around and above, so that its
// irradiance is not far from that of the floor a step further out, and above that of the middle of a side, which sees half.
TEST(Touch, TheCornerOfABlockIsNotDark) {
  std::vector<Polygon> sides = block(-0.5, -0.5, 0.5, 0.5);
  for (const auto& q : {std::array<glm::dvec3, 4>{{{-2, -2, 2}, {-2, 2, 2}, {2, 2, 2}, {2, -2, 2}}}})
    sides.push_back(test::polygon({q[0], q[1], q[2], q[3]}));
  Touched t = touched(sides);
  Scene scene = t.scene;
  scene.materials.push_back({"lamp", {0.0}, {1.0}, {}});
  scene.polygons.back().material = std::uint32_t(scene.materials.size() - 1);
  static Device device;
  SolveOptions options;
  options.mesh = {.patch_edge_m = 1, .element_edge_m = 0.5};
  options.samples = 64;
  const Solution s = solve(device, scene, options);
  const auto at = [&](double x, double y) {
    for (std::uint32_t v = 0; v < s.mesh.polygons[0].vertices; ++v)
      if (glm::distance(s.mesh.position_m[v], glm::dvec3(x, y, 0)) < 1e-9) return s.vertex_irradiance[v];
    return 0.0;
  };
  EXPECT_GT(at(-0.5, -0.5), 1.2 * at(0, -0.5));
  EXPECT_LT(at(-0.5, -0.5), at(-1, -1));
}

}  // namespace
}  // namespace clrad
