#include <gtest/gtest.h>

#include <numeric>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "tradeoff/places.hpp"

namespace clrad {
namespace {

TEST(Places, StandForTheAreaOfTheScene) {
  Scene scene = oracle::block_room();
  // A triangle, and a quad that is no parallelogram.
  scene.polygons[0].corners = 3;
  scene.polygons[1].corner[2] = 0.5 * (scene.polygons[1].corner[2] + scene.polygons[1].corner[0] * 0.2 +
                                       scene.polygons[1].corner[1] * 0.8);
  const auto places = stratified_places(scene, 4000, 1);
  std::vector<double> area(scene.polygons.size(), 0);
  double all = 0;
  for (const Place& p : places) {
    area[p.polygon] += p.weight_m2, all += p.weight_m2;
    EXPECT_GE(p.u, 0);
    EXPECT_LE(p.u, 1);
    EXPECT_LE(p.v, scene.polygons[p.polygon].corners == 3 ? 1 - p.u : 1);
  }
  double truth = 0;
  for (const Polygon& p : scene.polygons) truth += p.area_m2();
  // Each polygon gets a whole number of points, at most one too many or too few; the weights' own spread, which only the
  // crooked quad has, is stratified and far less.
  const double step = truth / 4000;
  for (std::size_t p = 0; p < area.size(); ++p)
    EXPECT_NEAR(area[p], scene.polygons[p].area_m2(), 1.5 * step) << p;
  EXPECT_NEAR(all, truth, 2 * step);
}

TEST(Places, TheOnesUnderTheBlockAreLeftOut) {
  const Scene scene = oracle::block_room();
  Device device;
  const auto places = stratified_places(scene, 2000, 3);
  const auto exposed = exposed_places(device, scene, places);
  double all = 0, left = 0;
  for (const Place& p : places) all += p.weight_m2;
  for (const Place& p : exposed) left += p.weight_m2;
  // The block stands on 1 x 0.75 m of floor, and has no bottom of its own. Points are 1/2000 of the area each, stratified on
  // the floor: along the outline of 3.5 m some dozen cells of it are in doubt.
  EXPECT_NEAR(all - left, 0.75, 12 * all / 2000);
  EXPECT_GT(all - left, 0.5);
}

// More where light varies, and yet each polygon weighs as much as it has area that nothing covers.
TEST(Places, VaryingOnesStandForTheAreaToo) {
  const Scene scene = oracle::block_room();
  Device device;
  SolveOptions options;
  options.mesh = {1, 0.25}, options.error = false;
  const auto places = exposed_places(device, scene, varying_places(solve(device, scene, options), 8000, 1));
  std::vector<double> weight(scene.polygons.size(), 0), number(scene.polygons.size(), 0);
  double all = 0, truth = -0.75;  // the block stands on that
  for (const Place& p : places) weight[p.polygon] += p.weight_m2, ++number[p.polygon], all += p.weight_m2;
  for (const Polygon& p : scene.polygons) truth += p.area_m2();
  for (std::size_t p = 0; p < weight.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    const double area = polygon.area_m2() - (polygon.name == "z_min" ? 0.75 : 0);
    // A point stands for at most twice the mean. They are drawn from equal parts one each, so that of a polygon's the first and the
    // last are in doubt; on the floor also those along the 3.5 m around the block, as above.
    const double share = 2 * truth / 8000;
    EXPECT_NEAR(weight[p] / all, area / truth, (polygon.name == "z_min" ? 12 : 3) * share / truth)
        << polygon.name;
    EXPECT_GT(number[p], 0.5 * 8000 * area / truth - 3) << polygon.name;
  }
}

TEST(Places, RmsIsOfTheWeightedPointsAndBands) {
  const std::vector<double> reference{1, 3, 2, 2}, values{1.1, 3, 2, 1.6};  // two points, two bands
  // sqrt((0.01 + 0.16) / 4) / 2
  EXPECT_NEAR(rms_relative(values, reference, {}, 2), std::sqrt(0.17 / 4) / 2, 1e-12);
  // The second point three times: sqrt((0.01 + 3 x 0.16) / 8) / 2
  const std::vector<double> weights{1, 3};
  EXPECT_NEAR(rms_relative(values, reference, weights, 2), std::sqrt(0.49 / 8) / 2, 1e-12);
  EXPECT_TRUE(std::isnan(rms_relative(values, std::vector<double>(4, 0.0), {}, 2)));
}

// Vertices of the mesh show their own irradiance, whatever the surface reflects and emits.
TEST(Places, DisplayedIrradianceIsThatOfTheVertices) {
  const Scene scene = oracle::block_room();
  Device device;
  SolveOptions options;
  options.mesh = {1, 0.5};
  const Solution s = solve(device, scene, options);
  std::size_t compared = 0;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    if (scene.polygons[p].corners != 4) continue;
    const PolygonMesh& mesh = s.mesh.polygons[p];
    for (std::uint32_t j = 0; j <= mesh.cells_v; ++j)
      for (std::uint32_t i = 0; i <= mesh.cells_u; ++i) {
        const std::uint32_t v = mesh.first_vertex + j * (mesh.cells_u + 1) + i;
        if (s.vertex_covered[v]) continue;
        const Place place{p, double(i) / mesh.cells_u, double(j) / mesh.cells_v, 1, {}};
        const auto shown = irradiance_at(s, std::vector<Place>{place});
        for (std::uint32_t b = 0; b < s.bands; ++b)
          // Parameters of vertices are rounded, and so are the weights of the other corners.
          EXPECT_NEAR(shown[b], s.vertex_irradiance[std::size_t(b) * s.vertex_count() + v], 1e-9);
        ++compared;
      }
  }
  EXPECT_GT(compared, 100u);
}

}  // namespace
}  // namespace clrad
