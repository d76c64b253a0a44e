// What lies around a new vertex in the level above: enough to foresee a quadratic function there.
#include "mesh/around.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mesh/lattice.hpp"
#include "mesh/subdivide.hpp"
#include "mesh/vertex_finder.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t none = VertexFinder::none;

// A square and a triangle, a third of whose elements are split, twice.
Solution subject() {
  Scene scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                             test::polygon({{0, 0, 2}, {2, 0, 2}, {0, 2, 2}})});
  Solution s = test::solution(scene, 0.26, [](auto, auto, auto&) { return 0.0; });
  std::mt19937 random(3);
  for (int round = 0; round < 2; ++round) {
    std::vector<std::uint32_t> split(s.mesh.elements.size());
    for (auto& word : split) word = random() % 3 == 0;
    subdivide(test::device(), s.scene, s.frame, s.mesh, split);
  }
  return s;
}

TEST(AroundParents, NamesTheVerticesOnTheLine) {
  const Solution s = subject();
  const Mesh& mesh = s.mesh;
  const auto around = around_parents(mesh, std::vector<std::uint8_t>(mesh.vertex_count(), 0));
  const auto& at = mesh.position_m;
  std::size_t both = 0, middles = 0;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto& parents = mesh.parents[v];
    if (parents[0] == none) {
      for (const std::uint32_t a : around[v]) EXPECT_EQ(a, none);
    } else if (parents[0] == parents[2]) {
      const glm::dvec3 a = at[parents[0]], edge = at[parents[1]] - a;
      const double along[4] = {-1, 2, -2, 3};
      for (int k = 0; k < 4; ++k)
        if (around[v][k] != none) {
          EXPECT_LT(glm::length(at[around[v][k]] - (a + along[k] * edge)), 1e-12);
        }
      both += around[v][0] != none && around[v][1] != none;
    } else {
      for (int k = 0; k < 4; ++k) {
        ASSERT_NE(around[v][k], none);
        EXPECT_LT(glm::length(at[around[v][k]] - 0.5 * (at[parents[k]] + at[parents[(k + 1) % 4]])), 1e-12);
      }
      ++middles;
    }
  }
  EXPECT_GT(both, mesh.vertex_count() / 4);
  EXPECT_GT(middles, 50u);
}

TEST(AroundParents, LeavesOutWhatIsCovered) {
  const Solution s = subject();
  std::vector<std::uint8_t> covered(s.mesh.vertex_count());
  for (std::size_t v = 0; v < covered.size(); ++v) covered[v] = v % 5 == 0;
  std::size_t left = 0;
  for (const auto& of : around_parents(s.mesh, covered))
    for (const std::uint32_t a : of)
      if (a != none) {
        EXPECT_FALSE(covered[a]);
        ++left;
      }
  EXPECT_GT(left, covered.size());
}

}  // namespace
}  // namespace clrad
