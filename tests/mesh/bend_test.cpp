// What edges have beyond straight lines: quadratic functions are met, steps do not overshoot, and no edge has a jump.
#include "mesh/bend.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "mesh/lattice.hpp"
#include "mesh/locate.hpp"
#include "mesh/subdivide.hpp"
#include "output/displayed.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using Function = std::function<double(const glm::dvec3&)>;

// A square and a triangle; `rounds` times a quarter of the elements are split at random. Black but for its emission: what is
// displayed is the value of `field`.
Solution subject(double element_edge_m, int rounds, const Function& field) {
  Scene scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                             test::polygon({{0, 0, 2}, {2, 0, 2}, {0, 1.5, 2}})});
  scene.materials[0] = test::material(1, 1);
  Solution s = test::solution(scene, element_edge_m, [](auto, auto, auto&) { return 0.0; });
  std::mt19937 random(4);
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint32_t> split(s.mesh.elements.size());
    for (auto& word : split) word = random() % 4 == 0;
    subdivide(test::device(), s.scene, s.frame, s.mesh, split);
  }
  s.vertex_irradiance.clear();
  for (const auto& x : s.mesh.position_m) s.vertex_irradiance.push_back(field(x));
  s.vertex_covered.assign(s.vertex_count(), 0);
  return s;
}

struct Place {
  std::uint32_t polygon;
  double u, v;
  glm::dvec3 position;
};

std::vector<Place> places(const Scene& scene, std::size_t count) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Place> result;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t p = random() % 2;
    double u = unit(random), v = unit(random);
    if (p == 1 && u + v > 1) u = 1 - u, v = 1 - v;
    const auto& c = scene.polygons[p].corner;
    result.push_back({p, u, v, c[0] + u * (c[1] - c[0]) + v * (c[scene.polygons[p].corners - 1] - c[0])});
  }
  return result;
}

Interpolant locate_in(const Solution& s, const Place& p) {
  return locate(s.mesh, p.polygon, s.scene.polygons[p.polygon].corners, p.u, p.v);
}

// Values up to 70; bends of 1e-4 and more, in which rounding is 1e-14.
double quadratic(const glm::dvec3& x) {
  return 50 + 2 * x.x - 3 * x.y + 1.5 * x.x * x.x + 0.7 * x.x * x.y - 2.5 * x.y * x.y;
}

TEST(Bend, QuadraticFunctionsAreMet) {
  const Solution s = subject(0.26, 3, quadratic);
  const Displayed displayed(s);
  std::vector<bool> exact;
  std::size_t straight = 0;
  for (std::size_t e = 0; e < displayed.edge_count; ++e) {
    const auto &a = s.mesh.position_m[displayed.edges.ends[e][0]],
               &b = s.mesh.position_m[displayed.edges.ends[e][1]];
    const double bend = 4 * (quadratic(0.5 * (a + b)) - (quadratic(a) + quadratic(b)) / 2);
    exact.push_back(std::abs(displayed.bend[e] - bend) <= 1e-12);
    straight += displayed.bend[e] == 0;
    EXPECT_TRUE(exact[e] || displayed.bend[e] == 0) << displayed.bend[e] << " not " << bend;
  }
  // Edges between larger elements, whose lines end on both sides.
  EXPECT_LT(straight, displayed.edge_count / 8);
  std::size_t compared = 0;
  for (const Place& p : places(s.scene, 20000)) {
    const Interpolant at = locate_in(s, p);
    bool all = true;
    for (const std::uint32_t e : displayed.edges.of_element[at.element])
      all = all && (e == 0xffffffffu || exact[e]);
    if (!all) continue;
    ASSERT_NEAR(displayed.at(0, at), quadratic(p.position), 1e-11);
    ++compared;
  }
  EXPECT_GT(compared, 15000u);
}

// On a smooth function the error falls with the third power of the edge: 8 on halving, 4 for a display by vertices alone, less
// what higher powers still do. All over and not at the worst point: in the corners of triangles there are lines of three
// vertices, which stay straight.
TEST(Bend, ErrorFallsWithTheThirdPower) {
  const auto smooth = [](const glm::dvec3& x) {
    return 5 + std::sin(2 * x.x + 1) * std::cos(1.3 * x.y + 0.2 * x.x);
  };
  const auto rms = [&](double edge, bool bent) {
    const Solution s = subject(edge, 0, smooth);
    Displayed displayed(s);
    if (!bent) displayed.bend.assign(displayed.bend.size(), 0);
    double squares = 0;
    for (const Place& p : places(s.scene, 20000))
      squares += std::pow(displayed.at(0, locate_in(s, p)) - smooth(p.position), 2);
    return std::sqrt(squares / 20000);
  };
  const double bent = rms(0.063, true), straight = rms(0.063, false);
  EXPECT_GT(bent / rms(0.0315, true), 6);
  EXPECT_LT(straight / rms(0.0315, false), 4.2);
  EXPECT_LT(bent, 0.2 * straight);
}

// A line that ends at a larger element goes on by what that displays: elements split here and there display a smooth function
// better, by the third power of the edge, than the larger ones did.
TEST(Bend, LinesGoOnThroughLargerElements) {
  const auto smooth = [](const glm::dvec3& x) {
    return 5 + std::sin(2 * x.x + 1) * std::cos(1.3 * x.y + 0.2 * x.x);
  };
  const Solution whole = subject(0.126, 0, smooth), split = subject(0.126, 1, smooth);
  const Displayed of_whole(whole), of_split(split);
  double before = 0, after = 0;
  for (const Place& p : places(whole.scene, 20000)) {
    const Interpolant at = locate_in(split, p);
    const Element& e = split.mesh.elements[at.element];
    if (whole.mesh.elements[locate_in(whole, p).element].level == e.level) continue;
    before += std::pow(of_whole.at(0, locate_in(whole, p)) - smooth(p.position), 2);
    after += std::pow(of_split.at(0, at) - smooth(p.position), 2);
  }
  EXPECT_GT(before, 0);
  EXPECT_LT(after, before / 16);  // 64 at best, less what the random choice of elements leaves straight
}

TEST(Bend, StepsStayStraight) {
  for (const glm::dvec3& normal : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(1, 0.3, 0)})
    for (const double at : {0.1, 0.77, 1.9}) {
      const Solution s =
          subject(0.13, 2, [&](const glm::dvec3& x) { return glm::dot(x, normal) > at ? 1.0 : 0.0; });
      for (const double b : Displayed(s).bend) EXPECT_EQ(b, 0);
    }
}

TEST(Bend, WhatIsNotNegativeIsNotDisplayedNegative) {
  std::mt19937 random(8);
  // Half of the vertices dark, next to bright ones.
  const Solution s = subject(0.13, 0, [&](auto&) { return random() % 2 ? 0.0 : double(random() % 1000); });
  const Displayed displayed(s);
  EXPECT_TRUE(std::any_of(displayed.bend.begin(), displayed.bend.end(), [](double b) { return b != 0; }));
  for (const Place& p : places(s.scene, 20000)) EXPECT_GE(displayed.at(0, locate_in(s, p)), -1e-10);
}

TEST(Bend, NoJumpAcrossAnyEdge) {
  std::mt19937 values(9);
  const Solution s = subject(0.52, 4, [&](auto&) { return double(values() % 1000); });
  const Displayed displayed(s);
  EXPECT_TRUE(std::any_of(displayed.bend.begin(), displayed.bend.end(), [](double b) { return b != 0; }));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t halves = 0;
  for (const Element& e : s.mesh.elements) {
    const std::uint32_t corners = e.vertex[3] == 0xffffffffu ? 3 : 4;
    const std::uint32_t p = s.mesh.receivers[e.vertex[0]].surface;
    const double side_u = double(s.mesh.polygons[p].patches_u) * lattice_unit(0),
                 side_v = double(s.mesh.polygons[p].patches_v) * lattice_unit(0);
    for (std::uint32_t k = 0; k < corners; ++k) {
      const auto a = s.mesh.lattice[e.vertex[k]], b = s.mesh.lattice[e.vertex[(k + 1) % corners]];
      halves += e.middle[k] != 0xffffffffu;
      const double t = unit(random), u = (a[0] + t * (double(b[0]) - a[0])) / side_u,
                   v = (a[1] + t * (double(b[1]) - a[1])) / side_v;
      // Slopes of values below 1000 over edges of at least 1 / 128 of the side: hats 4 x 1000 x 128; a bend is at most the smaller
      // second difference, 2000, and is as steep at its end, twice that on a half, from each of four sides.
      const double jump = 2 * 1e-9 * 128 * (4 * 1000 + 4 * 2 * 2000);
      const auto at = [&](double du, double dv) {
        return displayed.at(0, locate_in(s, {p, u + du, v + dv, {}}));
      };
      EXPECT_NEAR(at(1e-9, 1e-9), at(-1e-9, -1e-9), jump);
      EXPECT_NEAR(at(-1e-9, 1e-9), at(1e-9, -1e-9), jump);
    }
  }
  EXPECT_GT(halves, 10u);
}

// A covered vertex is dark however bright its surroundings are: no edge to it bends, nor does one beside it because of it.
TEST(Bend, CoveredVerticesHaveNoPart) {
  Solution s = subject(0.26, 2, quadratic);
  std::mt19937 random(10);
  for (std::size_t v = 0; v < s.vertex_covered.size(); ++v)
    if (random() % 8 == 0) s.vertex_covered[v] = 1, s.vertex_irradiance[v] = 0;
  const Displayed displayed(s);
  std::size_t bent = 0;
  for (std::size_t e = 0; e < displayed.edge_count; ++e) {
    const auto [a, b] = displayed.edges.ends[e];
    if (s.vertex_covered[a] || s.vertex_covered[b]) {
      EXPECT_EQ(displayed.bend[e], 0);
    } else if (displayed.bend[e] != 0) {
      const auto &x = s.mesh.position_m[a], &y = s.mesh.position_m[b];
      EXPECT_NEAR(displayed.bend[e], 4 * (quadratic(0.5 * (x + y)) - (quadratic(x) + quadratic(y)) / 2),
                  1e-12);
      ++bent;
    }
  }
  EXPECT_GT(bent, displayed.edge_count / 2);
}

}  // namespace
}  // namespace clrad
