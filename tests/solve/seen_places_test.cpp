#include "solve/seen_places.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace clrad {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

// Two elements, one over vertices 0 1 2 3 and one over 1 4 5 2 whose vertex 5 something covers; the edge 0-1 has a place of its own.
struct Scenery {
  Edges edges;
  PlaceNumbers places;
  std::vector<double> reflectance{0.5, 0.25};  // one band
  RayEnds ends;

  Scenery() {
    edges.ends = {{0, 1}};
    edges.of_element.assign(2, {none, none, none, none, none, none, none, none});
    edges.of_element[0][0] = 0;
    places = {6, {0, 1, 2, 3, 4, none}, {5}};
  }
  void ray(std::uint32_t sensor, std::uint32_t element, std::array<double, 4> weight, double bend,
           double share) {
    ends.sensor.push_back(sensor), ends.element.push_back(element), ends.share.push_back(share);
    const std::array<std::uint32_t, 4> corners =
        element == 0 ? std::array<std::uint32_t, 4>{0, 1, 2, 3} : std::array<std::uint32_t, 4>{1, 4, 5, 2};
    for (std::size_t k = 0; k < 8; ++k) ends.vertex.push_back(k < 4 ? corners[k] : corners[0]);
    for (std::size_t k = 0; k < 8; ++k) ends.weight.push_back(k < 4 ? weight[k] : 0);
    for (std::size_t k = 0; k < 8; ++k) ends.weight.push_back(k == 0 ? bend : 0);
  }
  SeenPlaces seen() const {
    SeenPlaces result(edges, places, reflectance, 1);
    result.add(ends);
    return result;
  }
};

// Errors of one place alone, of size 1: what is left is the square of how much of it the sensor has.
std::vector<double> shares(const SeenPlaces& seen, std::size_t sensors) {
  std::vector<double> result;
  for (std::size_t place = 0; place < 6; ++place) {
    std::vector<double> error(6, 0);
    error[place] = 1;
    for (const double square : seen.error_square(error, sensors)) result.push_back(std::sqrt(square));
  }
  return result;
}

// The product of what two rays have, twice: 2 w1 w2, and none of it from a ray and itself.
TEST(SeenPlaces, CountWhatDifferentRaysHaveInCommon) {
  Scenery s;
  s.ray(0, 0, {1, 0, 0, 0}, 0, 0.4);
  s.ray(0, 0, {0.5, 0.5, 0, 0}, 0, 0.4);
  const std::vector<double> found = shares(s.seen(), 1);
  EXPECT_NEAR(found[0], std::sqrt(2 * (0.4 * 0.5 * 1) * (0.4 * 0.5 * 0.5)), 1e-6);
  EXPECT_EQ(found[1], 0);  // one ray alone tells nothing
}

TEST(SeenPlaces, ABendIsFourTimesTheMiddleLessTwiceTheEnds) {
  Scenery s;
  for (int k = 0; k < 2; ++k) s.ray(0, 0, {0.5, 0.5, 0, 0}, 0.25, 1);
  const std::vector<double> found = shares(s.seen(), 1);
  // In the middle of the edge the ends weigh 1/2 - 2 x 1/4 and the middle 4 x 1/4, times the reflectance.
  EXPECT_NEAR(found[0], 0, 1e-6);
  EXPECT_NEAR(found[5], std::sqrt(2.0) * 0.5, 1e-6);
}

TEST(SeenPlaces, BlockedRaysAndCoveredVerticesBringNothing) {
  Scenery s;
  for (int k = 0; k < 2; ++k) {
    s.ray(0, none, {1, 0, 0, 0}, 0, 1);
    s.ray(0, 1, {0, 0.5, 0.5, 0}, 0, 1);
  }
  const std::vector<double> found = shares(s.seen(), 1);
  EXPECT_NEAR(found[4], std::sqrt(2.0) * 0.25 * 0.5, 1e-6);
  for (const std::size_t place : {0, 1, 2, 3, 5}) EXPECT_EQ(found[place], 0) << place;
}

TEST(SeenPlaces, EachSensorHasItsOwn) {
  Scenery s;
  s.ray(0, 0, {1, 0, 0, 0}, 0, 1);
  s.ray(0, 0, {1, 0, 0, 0}, 0, 1);
  s.ray(2, 0, {1, 0, 0, 0}, 0, 0.5);
  s.ray(2, 0, {1, 0, 0, 0}, 0, 0.5);
  const std::vector<double> square = s.seen().error_square(std::vector<double>(6, 3.0), 3);
  EXPECT_NEAR(square[0], 2 * 0.25 * 9, 1e-6);
  EXPECT_EQ(square[1], 0);
  EXPECT_NEAR(square[2], 2 * 0.0625 * 9, 1e-6);
}

// A surface that reflects red alone hands on errors of red alone; sensors come in batches.
TEST(SeenPlaces, EachBandHasItsReflectance) {
  Scenery s;
  const std::vector<double> red{0.8, 0, 0.4, 0};  // [element * 2 + band]
  SeenPlaces seen(s.edges, s.places, red, 2);
  for (std::uint32_t sensor = 0; sensor < 2; ++sensor) {
    s.ends = {};
    for (int k = 0; k < 2; ++k) s.ray(sensor, sensor, {1, 0, 0, 0}, 0, 1);
    seen.add(s.ends);
  }
  const std::vector<double> square = seen.error_square(std::vector<double>(12, 1.0), 2);
  EXPECT_NEAR(square[0], 2 * 0.64, 1e-6);
  EXPECT_EQ(square[1], 0);
  EXPECT_NEAR(square[2], 2 * 0.16, 1e-6);
  EXPECT_EQ(square[3], 0);
}

TEST(SeenPlaces, WhatSensorsSeeMostOfGetsMostRays) {
  Scenery s;
  for (int k = 0; k < 2; ++k) s.ray(0, 0, {0.98, 0.02, 0, 0}, 0, 1);
  const SeenPlaces seen = s.seen();
  const std::vector<double> bright(6, 1.0);
  const std::vector<std::uint32_t> rays = seen.rays_for(bright, 64, 1024);
  // Six places, of which the first has 0.98: 5.88 times the mean, so four times the rays.
  EXPECT_EQ(rays, (std::vector<std::uint32_t>{256, 64, 64, 64, 64, 64}));
  std::uint32_t all = 0;
  for (const std::uint32_t r : rays) all += r;
  EXPECT_LE(all, 2 * 64 * 6);
  EXPECT_EQ(seen.rays_for(bright, 64, 128)[0], 128u);  // not more than `most`
  // Dark places are exact without.
  EXPECT_EQ(seen.rays_for(std::vector<double>(6, 0.0), 64, 1024), std::vector<std::uint32_t>(6, 64));
}

TEST(SeenPlaces, WithoutRaysAllAreAlike) {
  const Scenery s;
  EXPECT_EQ(s.seen().rays_for(std::vector<double>(6, 1.0), 32, 1024), std::vector<std::uint32_t>(6, 32));
  EXPECT_EQ(s.seen().error_square(std::vector<double>(6, 1.0), 2), std::vector<double>(2, 0.0));
}

}  // namespace
}  // namespace clrad
