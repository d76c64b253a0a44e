#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

// Vertices within two elements of the room's edges, where patches of the next wall are near: their error against the same
// vertices (the same elements) with patches four times finer.
double edge_error(const Scene& scene, const Solution& s, const Solution& fine) {
  double squares = 0, mean = 0;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const PolygonMesh& m = s.mesh.polygons[p];
    for (std::uint32_t j = 0; j <= m.cells_v; ++j)
      for (std::uint32_t i = 0; i <= m.cells_u; ++i) {
        if (std::min({i, j, m.cells_u - i, m.cells_v - j}) > 1) continue;
        const std::uint32_t v = j * (m.cells_u + 1) + i;
        const double exact = fine.vertex_irradiance[fine.mesh.polygons[p].first_vertex + v];
        const double error = s.vertex_irradiance[m.first_vertex + v] - exact;
        squares += error * error;
        mean += exact * exact;
      }
  }
  return std::sqrt(squares / mean);
}

TEST(NearField, LightsEdgesByElementsBetterThanByAverages) {
  // A room whose walls differ much, one of them shining.
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {0});
  scene.materials.push_back({"light", {0.1}, {1}, {}});
  scene.materials.push_back({"dark", {0.05}, {0}, {}});
  scene.polygons[0].material = 1;
  scene.polygons[4].material = 2;
  Device device;
  SolveOptions options;
  options.samples = 1;
  options.light_samples = 0;
  options.converge = 1e-5;
  options.near_field = false;
  options.mesh = {1.0 / 16, 1.0 / 16};
  const Solution fine = solve(device, scene, options);
  options.mesh = {1.0 / 4, 1.0 / 16};
  const double without = edge_error(scene, solve(device, scene, options), fine);
  options.near_field = true;
  const double with = edge_error(scene, solve(device, scene, options), fine);
  EXPECT_LT(with, 0.5 * without) << without << " -> " << with;
}

// A receiver on the edge between two walls sees of the other one what is right beside it. Were each of a patch's cells (64 of them,
// four elements a side here) equally bright all over, radiosity that falls by S over a cell would fall in stairs along the edge: by S / 2
// on either side of a cell's border and by nothing within it, a third difference of 2 S over half-cells. Inside of patches, as their
// own averages do make a difference, a tenth of that is allowed; flat cells measured 0.3, the rest of the light being even.
TEST(NearField, ShowsNoStairsAlongAnEdge) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {0});
  scene.materials.push_back({"light", {0.1}, {1}, {}});
  scene.polygons[0].material = 1;  // x = 0
  Device device;
  SolveOptions options;
  options.samples = 1;
  options.converge = 1e-5;
  options.mesh = {0.5, 1.0 / 64};
  const Solution s = solve(device, scene, options);
  const std::uint32_t n = 64;
  double most = 0, of_a_stair = 0;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const PolygonMesh& m = s.mesh.polygons[p];
    ASSERT_EQ(m.cells_u, n);
    for (const std::uint32_t row : {0u, n}) {
      const auto at = [&](std::uint32_t i) {
        return s.vertex_irradiance[m.first_vertex + row * (n + 1) + i];
      };
      for (const std::uint32_t i : {20u, 24u, 36u, 40u}) {
        const double third = at(i + 7) - 3 * at(i + 5) + 3 * at(i + 3) - at(i + 1);
        most = std::max(most, std::abs(third));
        of_a_stair = std::max(of_a_stair, 2 * std::abs(at(i + 4) - at(i)));
      }
    }
  }
  EXPECT_LT(most, 0.1 * of_a_stair);
}

// Where all is equally bright there is nothing to correct: B_near = B_mean to rounding (a mean of 64 factors).
TEST(NearField, ChangesNothingInAFurnace) {
  Device device;
  SolveOptions options;
  options.samples = 1;
  options.converge = 1e-5;
  options.mesh = {0.5, 1.0 / 8};
  const Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  const Solution with = solve(device, scene, options);
  options.near_field = false;
  const Solution without = solve(device, scene, options);
  for (std::size_t v = 0; v < with.vertex_irradiance.size(); ++v)
    EXPECT_NEAR(with.vertex_irradiance[v], without.vertex_irradiance[v], 2e-5);
}

// Columns that memory did not hold are traced again where they are near: the same bits.
TEST(NearField, SameBitsWhereColumnsAreNotKept) {
  const Scene scene = load_scene(std::string(CLRAD_SCENES) + "/block_room.obj");
  SolveOptions options;
  options.engine = "serial";
  options.mesh = {0.5, 1.0 / 16};
  Device roomy;
  const Solution kept = solve(roomy, scene, options);
  // What 256 columns of 19,000 vertices take is 19 MiB; half of what is left goes to columns.
  Device tight({.memory_bytes = 32u << 20});
  const Solution traced = solve(tight, scene, options);
  EXPECT_GT(traced.report.rays, kept.report.rays);  // some were not kept
  EXPECT_EQ(traced.vertex_irradiance, kept.vertex_irradiance);
}

}  // namespace
}  // namespace clrad
