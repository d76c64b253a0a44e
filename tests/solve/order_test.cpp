#include "solve/order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>
#include <vector>

namespace clrad {
namespace {

// Bits of the three coordinates in turns, z's the highest.
std::uint64_t morton(const glm::dvec3& p) {
  std::uint64_t code = 0;
  for (int c = 0; c < 3; ++c) {
    const auto cell = std::uint64_t(std::clamp((p[c] + 1) * 512, 0.0, 1023.0));
    for (int bit = 0; bit < 10; ++bit) code |= (cell >> bit & 1) << (3 * bit + c);
  }
  return code;
}

TEST(Order, ReceiversFollowTheMortonCodeOfTheirPlaceAndElseTheirNumber) {
  std::mt19937_64 random(20601);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Point> points;
  for (int i = 0; i < 5000; ++i) {
    // Multiples of 1/8, on the sides of cells; every third at the place of the one before.
    glm::dvec3 p(std::floor(unit(random) * 8) / 8, std::floor(unit(random) * 8) / 8,
                 std::floor(unit(random) * 8) / 8);
    if (i % 3 == 2) p = points.back().position;
    points.push_back({p, {0, 0, 1}, 0, 0});
  }
  for (const Precision precision : {Precision::float32, Precision::float64})
    for (const std::size_t count : {std::size_t(5000), std::size_t(1)}) {
      const std::span chosen = std::span(points).first(count);
      Device device({.precision = precision});
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < count; ++i) expected.push_back(i);
      std::stable_sort(expected.begin(), expected.end(), [&](std::uint32_t a, std::uint32_t b) {
        return morton(points[a].position) < morton(points[b].position);
      });
      EXPECT_EQ(in_order(device, PointArray(device, chosen, "points")).download(), expected);
    }
}

}  // namespace
}  // namespace clrad
