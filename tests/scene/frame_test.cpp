#include <gtest/gtest.h>

#include "clrad/frame.hpp"

namespace {

using namespace clrad;

Scene triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  Scene scene;
  Polygon polygon;
  polygon.corner = {a, b, c, glm::dvec3(0)};
  polygon.corners = 3;
  scene.polygons.push_back(polygon);
  return scene;
}

void expect_in_frame(const Scene& scene, const Frame& frame) {
  double low = 2, high = -2;
  for (const auto& p : scene.polygons) {
    for (std::uint32_t i = 0; i < p.corners; ++i) {
      const glm::dvec3 f = frame.to_frame(p.corner[i]);
      for (int k = 0; k < 3; ++k) low = std::min(low, f[k]), high = std::max(high, f[k]);
    }
  }
  EXPECT_GE(low, -1.0);
  EXPECT_LT(high, 1.0);
  EXPECT_GE(high - low, 0.5);
}

TEST(SceneFrame, ExtentIsInOneToTwo) {
  for (const double size : {1e-80, 1e-9, 0.75, 1.0, 1.5, 1.9999, 2.0, 3.0, 4.0, 1e6, 1e80}) {
    const Scene scene = triangle({0, 0, 0}, {size, 0, 0}, {0, 0.25 * size, 0});
    const Frame frame = frame_of(scene);
    EXPECT_GE(size * frame.scale(), 1.0) << size;
    EXPECT_LT(size * frame.scale(), 2.0) << size;
    expect_in_frame(scene, frame);
    const glm::dvec3 p(0.3 * size, 0.1 * size, 0);
    EXPECT_NEAR(frame.from_frame(frame.to_frame(p)).x, p.x, size * 0x1p-52);
  }
}

TEST(SceneFrame, MovingBySomethingRepresentableChangesNothing) {
  const glm::dvec3 a(0, 0.25, 0.5), b(3, -1, 0.125), c(0.75, 2, 7.0);
  const Frame home = frame_of(triangle(a, b, c));
  for (const glm::dvec3 move : {glm::dvec3(1e6), glm::dvec3(-1e6, 0, 4096), glm::dvec3(1e9, 2e9, -3e9)}) {
    const Frame away = frame_of(triangle(a + move, b + move, c + move));
    EXPECT_EQ(away.exponent, home.exponent);
    for (const glm::dvec3& p : {a, b, c}) EXPECT_EQ(away.to_frame(p + move), home.to_frame(p));
  }
}

TEST(SceneFrame, ScalingByAPowerOfTwoChangesNothing) {
  const glm::dvec3 a(0.1, 0.2, 0.3), b(3, -1, 0.7), c(0.7, 2, 7.1);
  const Frame home = frame_of(triangle(a, b, c));
  for (const int power : {-300, -20, 1, 17, 300}) {
    const double k = std::ldexp(1.0, power);
    const Frame scaled = frame_of(triangle(k * a, k * b, k * c));
    EXPECT_EQ(scaled.exponent, home.exponent + power);
    for (const glm::dvec3& p : {a, b, c}) EXPECT_EQ(scaled.to_frame(k * p), home.to_frame(p));
  }
}

TEST(SceneFrame, RoundingOfTheMiddleNeverReachesOne) {
  // Extent 2 - 1 ulp of the coordinates, an odd number of them: the middle falls between two doubles.
  const double base = 0x1p52;
  const Scene scene = triangle({base, 0, 0}, {base + 0x1p20 - 1, 0, 0}, {base, 1, 0});
  expect_in_frame(scene, frame_of(scene));
  const Scene empty;
  EXPECT_EQ(frame_of(empty).scale(), 1.0);
}

}  // namespace
