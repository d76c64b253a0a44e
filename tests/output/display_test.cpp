#include <gtest/gtest.h>

#include "render/support.hpp"

namespace clrad {
namespace {

using test::polygon;

// A unit square of 4 x 4 cells; vertex (i, j) is number 5 j + i.
Solution square(std::uint32_t bands = 1) {
  return test::solution(
      test::scene({polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})}, bands), 0.25,
      [](auto, std::uint32_t band, const glm::dvec3& x) { return 1 + band + x.x + 10 * x.y; });
}

TEST(Display, UncoveredVerticesAreEPlusRhoH) {
  Solution s = square(2);
  s.scene.materials[0].emitted_exitance = {3, 5};
  const auto b = display_radiosity(s);
  for (std::uint32_t band = 0; band < 2; ++band)
    for (std::uint32_t v = 0; v < 25; ++v) EXPECT_EQ(b[band * 25 + v], s.vertex_radiosity(band, v, 0));
}

TEST(Display, ACoveredVertexIsTheMeanOfItsElementsUncoveredCorners) {
  Solution s = square();
  // (2, 2) alone: its four elements have the 4 neighbours twice each and the 4 diagonal ones once: the field
  // is linear and they lie symmetrically, so the mean is the field itself.
  s.vertex_covered[12] = 1, s.vertex_irradiance[12] = 0;
  EXPECT_NEAR(display_radiosity(s)[12], 0.5 * (1 + 0.5 + 5), 1e-14);
  // Corner (0, 0): one element, three others.
  s.vertex_covered[0] = 1, s.vertex_irradiance[0] = 0;
  EXPECT_NEAR(display_radiosity(s)[0], 0.5 * (1 + (0.25 + 0 + 0.25) / 3 + 10 * (0 + 0.25 + 0.25) / 3), 1e-14);
}

TEST(Display, UnderABlockNothingIsBlackAndUncoveredVerticesStay) {
  Solution s = square();
  for (std::uint32_t v = 0; v < 25; ++v) s.vertex_irradiance[v] = 4;
  for (std::uint32_t j = 1; j < 4; ++j)
    for (std::uint32_t i = 1; i < 4; ++i) s.vertex_covered[5 * j + i] = 1, s.vertex_irradiance[5 * j + i] = 0;
  for (const double b : display_radiosity(s)) EXPECT_EQ(b, 2);
  // Wholly covered: nothing to take from, and no endless search.
  s.vertex_covered.assign(25, 1);
  EXPECT_EQ(display_radiosity(s)[12], 0);
}

TEST(Display, PolygonMeansWeighPatchesByArea) {
  Scene scene = test::scene(
      {polygon({{0, 0, 0}, {3, 0, 0}, {2, 1, 0}, {0, 2, 0}}), polygon({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}})});
  scene.materials[0].emitted_exitance = {7};
  const Solution s =
      test::solution(scene, 0.3, [](auto, auto, const glm::dvec3& x) { return 2 + 3 * x.x - x.y; });
  const auto means = polygon_means(s);
  ASSERT_EQ(means.size(), 2u);
  // A linear field's mean is its value at the centroid: quad = triangle (0,0)(3,0)(2,1), area 3/2, centroid
  // (5/3, 1/3), and triangle (0,0)(2,1)(0,2), area 2, centroid (2/3, 1).
  EXPECT_NEAR(means[0].area_m2, 3.5, 1e-13);
  const double h = (1.5 * (2 + 5 - 1.0 / 3) + 2 * (2 + 2 - 1)) / 3.5;
  EXPECT_NEAR(means[0].irradiance[0], h, 1e-12);
  EXPECT_NEAR(means[0].radiosity[0], 7 + 0.5 * h, 1e-12);
  EXPECT_NEAR(means[1].area_m2, 0.5, 1e-14);
  EXPECT_NEAR(means[1].irradiance[0], 2 + 1 - 1.0 / 3, 1e-13);
}

}  // namespace
}  // namespace clrad
