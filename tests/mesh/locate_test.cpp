// Interpolation on adaptive meshes: no crack, no jump, and exact where it must be.
#include "mesh/locate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "mesh/lattice.hpp"
#include "mesh/subdivide.hpp"
#include "render/support.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

struct Subject {
  Scene scene;
  Frame frame;
  Mesh mesh;
};

// A square and a triangle whose elements were split at random; lattice sides 2^17 and 2^16 long.
Subject subject(Device& device) {
  Subject s;
  s.scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                         test::polygon({{0, 0, 2}, {2, 0, 2}, {0, 1.5, 2}})});
  s.frame = frame_of(s.scene);
  s.mesh = build_mesh(s.scene, s.frame, plane_ids(s.scene), {.patch_edge_m = 1.3, .element_edge_m = 0.7});
  std::mt19937 random(4);
  for (int round = 0; round < 4; ++round) {
    std::vector<std::uint32_t> split(s.mesh.elements.size());
    for (auto& word : split) word = random() % 3 == 0;
    subdivide(device, s.scene, s.frame, s.mesh, split);
  }
  return s;
}

double interpolated(const Subject& s, const std::vector<double>& values, std::uint32_t polygon, double u,
                    double v) {
  const Interpolant at = locate(s.mesh, polygon, s.scene.polygons[polygon].corners, u, v);
  double sum = 0;
  for (int k = 0; k < 8; ++k) sum += at.weight[k] * values[at.vertex[k]];
  return sum;
}

TEST(Locate, VerticesHaveTheirOwnValueOnAllSides) {
  Device device;
  const Subject s = subject(device);
  std::vector<double> values;
  for (std::uint32_t v = 0; v < s.mesh.vertex_count(); ++v) values.push_back(double(v * 2654435761u % 1000));
  for (std::uint32_t v = 0; v < s.mesh.vertex_count(); ++v) {
    const std::uint32_t p = s.mesh.receivers[v].surface;
    const double u = s.mesh.lattice[v][0] / (double(s.mesh.polygons[p].patches_u) * lattice_unit(0)),
                 w = s.mesh.lattice[v][1] / (double(s.mesh.polygons[p].patches_v) * lattice_unit(0));
    // A step to any side of 1e-9 changes the value by at most the steepest slope: 1000 over an edge of 2^-9 of the side.
    for (const double du : {-1e-9, 0.0, 1e-9})
      for (const double dv : {-1e-9, 0.0, 1e-9})
        EXPECT_NEAR(interpolated(s, values, p, u + du, w + dv), values[v], 4e-9 * 1000 * 512) << v;
  }
}

TEST(Locate, NoJumpAcrossAnyEdge) {
  Device device;
  const Subject s = subject(device);
  std::vector<double> values;
  for (std::uint32_t v = 0; v < s.mesh.vertex_count(); ++v) values.push_back(double(v * 2654435761u % 1000));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t jumps_possible = 0;
  for (const Element& e : s.mesh.elements) {
    const std::uint32_t corners = e.vertex[3] == 0xffffffffu ? 3 : 4;
    const std::uint32_t p = s.mesh.receivers[e.vertex[0]].surface;
    const double side_u = double(s.mesh.polygons[p].patches_u) * lattice_unit(0),
                 side_v = double(s.mesh.polygons[p].patches_v) * lattice_unit(0);
    for (std::uint32_t k = 0; k < corners; ++k) {
      const auto a = s.mesh.lattice[e.vertex[k]], b = s.mesh.lattice[e.vertex[(k + 1) % corners]];
      jumps_possible += e.middle[k] != 0xffffffffu;
      const double t = unit(random), u = (a[0] + t * (double(b[0]) - a[0])) / side_u,
                   v = (a[1] + t * (double(b[1]) - a[1])) / side_v;
      const double slope = 4e-9 * 1000 * 512;
      EXPECT_NEAR(interpolated(s, values, p, u + 1e-9, v + 1e-9),
                  interpolated(s, values, p, u - 1e-9, v - 1e-9), slope);
      EXPECT_NEAR(interpolated(s, values, p, u - 1e-9, v + 1e-9),
                  interpolated(s, values, p, u + 1e-9, v - 1e-9), slope);
    }
  }
  EXPECT_GT(jumps_possible, 10u);
}

TEST(Locate, LinearFunctionsAreReproduced) {
  Device device;
  const Subject s = subject(device);
  const auto f = [](const glm::dvec3& x) { return 3 * x.x - 2 * x.y + 1; };
  std::vector<double> values;
  for (const auto& x : s.mesh.position_m) values.push_back(f(x));
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t p = random() % 2;
    double u = unit(random), v = unit(random);
    if (p == 1 && u + v > 1) u = 1 - u, v = 1 - v;
    const auto& c = s.scene.polygons[p].corner;
    const glm::dvec3 x = c[0] + u * (c[1] - c[0]) + v * (c[s.scene.polygons[p].corners - 1] - c[0]);
    // Twenty roundings of numbers up to 7, and local coordinates doubled seven times.
    EXPECT_NEAR(interpolated(s, values, p, u, v), f(x), 20 * 7 * 128 * 1.2e-16);
    double weights = 0;
    for (const double w : locate(s.mesh, p, s.scene.polygons[p].corners, u, v).weight) weights += w;
    EXPECT_NEAR(weights, 1, 1e-14);
  }
}

TEST(Locate, OutsideIsClampedToTheOutline) {
  Device device;
  const Subject s = subject(device);
  std::vector<double> values;
  for (const auto& x : s.mesh.position_m) values.push_back(x.x);
  EXPECT_NEAR(interpolated(s, values, 0, 7, 0.5), 2, 1e-12);
  EXPECT_NEAR(interpolated(s, values, 0, -1, 0.5), 0, 1e-12);
  EXPECT_NEAR(interpolated(s, values, 1, 1, 3), 2, 1e-12);
}

}  // namespace
}  // namespace clrad
