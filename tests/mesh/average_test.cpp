// Averages over elements by their parents: what they integrate exactly, and where they keep out.
#include "mesh/average.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

struct Meshed {
  Scene scene;
  Mesh mesh;
  explicit Meshed(std::vector<glm::dvec3> corners, double edge) {
    scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
    Polygon p = scene.polygons[0];
    p.corners = std::uint32_t(corners.size());
    std::copy(corners.begin(), corners.end(), p.corner.begin());
    scene.polygons = {p};
    mesh = build_mesh(scene, frame_of(scene), plane_ids(scene), {1, edge});
  }
  template <class Function>
  double mean(Function f) const {
    double sum = 0, area = 0;
    for (const Element& e : mesh.elements) {
      area += e.area_m2;
      for (int k = 0; k < 4; ++k)
        if (e.vertex[k] != 0xffffffffu) sum += e.area_m2 * e.weight[k] * f(mesh.position_m[e.vertex[k]]);
    }
    return sum / area;
  }
};

// Simpson's rule is exact for cubics in each direction; sums of a few hundred terms round below 1e-14.
TEST(AverageByParents, IsExactForCubicsOnQuads) {
  Meshed m({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0.25);
  const auto f = [](const glm::dvec3& p) { return p.x * p.x * p.x * p.y * p.y + p.y * p.y * p.y; };
  EXPECT_GT(std::abs(m.mean(f) - (1.0 / 12 + 0.25)), 1e-3);  // the interpolant's own average is not
  average_by_parents(m.mesh, std::vector<std::uint8_t>(m.mesh.vertex_count(), 0));
  EXPECT_NEAR(m.mean(f), 1.0 / 12 + 0.25, 1e-14);
}

// The middles of the sides are exact for quadratics: integral over the triangle of x^2 is 1/12, of xy 1/24, area 1/2.
TEST(AverageByParents, IsExactForQuadraticsOnTriangles) {
  Meshed m({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 0.25);
  const auto f = [](const glm::dvec3& p) { return p.x * p.x + 3 * p.x * p.y; };
  average_by_parents(m.mesh, std::vector<std::uint8_t>(m.mesh.vertex_count(), 0));
  EXPECT_NEAR(m.mean(f), 2 * (1.0 / 12 + 3.0 / 24), 1e-14);
}

// A family with a covered corner is averaged element by element, and its covered elements keep their weights.
TEST(AverageByParents, KeepsOutOfWhatIsCovered) {
  Meshed m({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0.5);
  std::vector<std::uint8_t> covered(m.mesh.vertex_count(), 0);
  covered[m.mesh.elements[0].vertex[0]] = 1;
  m.mesh.elements[0].weight = {0.7, 0.1, 0.1, 0.1};
  average_by_parents(m.mesh, covered);
  EXPECT_EQ(m.mesh.elements[0].weight, (std::array<double, 4>{0.7, 0.1, 0.1, 0.1}));
  for (int e = 1; e < 4; ++e)
    EXPECT_EQ(m.mesh.elements[e].weight, (std::array<double, 4>{0.25, 0.25, 0.25, 0.25}));
}

// Each element by itself: the integral of a quadratic function over it, against Gauss's rule of 2 x 2 points (3 in a triangle), exact
// for these. Rounding: values up to 4.
TEST(ElementAverages, AreExactForQuadraticsOneByOne) {
  const auto f = [](const glm::dvec3& p) { return 1 + p.x * p.x + 3 * p.x * p.y - 0.5 * p.y * p.y; };
  for (const bool triangle : {false, true}) {
    Meshed m(triangle ? std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}
                      : std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
             0.25);
    std::vector<double> values;
    for (const auto& p : m.mesh.position_m) values.push_back(f(p));
    const std::vector<std::uint8_t> covered(m.mesh.vertex_count(), 0);
    const auto averages = element_averages(m.mesh, covered, values);
    for (std::size_t i = 0; i < m.mesh.elements.size(); ++i) {
      const Element& e = m.mesh.elements[i];
      const auto corner = [&](std::uint32_t k) { return m.mesh.position_m[e.vertex[k]]; };
      double exact = 0;
      if (triangle) {
        for (std::uint32_t k = 0; k < 3; ++k) exact += f(0.5 * (corner(k) + corner((k + 1) % 3))) / 3;
      } else {
        const double at[2] = {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)};
        for (const double s : at)
          for (const double t : at)
            exact += f(corner(0) + s * (corner(1) - corner(0)) + t * (corner(3) - corner(0))) / 4;
      }
      EXPECT_NEAR(averages[i], exact, 1e-14) << (triangle ? "triangle " : "quad ") << i;
    }
  }
}

// A parabola through a step leaves the range of the element's corners; its average may not.
TEST(ElementAverages, StayBetweenTheCorners) {
  const Meshed m({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0.25);
  std::vector<double> values;
  for (const auto& p : m.mesh.position_m) values.push_back(p.x < 0.4 ? 0 : 1);
  for (const double a : element_averages(m.mesh, std::vector<std::uint8_t>(values.size(), 0), values)) {
    EXPECT_GE(a, 0);
    EXPECT_LE(a, 1);
  }
}

// An element that is covered in part counts by its exposed corners, its siblings by their own.
TEST(ElementAverages, LeaveOutWhatIsCovered) {
  const Meshed m({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0.5);
  std::vector<std::uint8_t> covered(m.mesh.vertex_count(), 0);
  std::vector<double> values(m.mesh.vertex_count(), 2.0);
  const std::uint32_t hidden = m.mesh.elements[0].vertex[0];
  covered[hidden] = 1, values[hidden] = 1000;
  for (const double a : element_averages(m.mesh, covered, values)) EXPECT_DOUBLE_EQ(a, 2);
}

}  // namespace
}  // namespace clrad
