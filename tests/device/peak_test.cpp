#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

// The products and sums that a benchmark divides by its seconds are really done: float by float what the host gets.
TEST(Peak, DoesItsProductsAndSums) {
  constexpr std::uint32_t items = 5, rounds = 37, chains = 12;
  for (const unsigned width : {1u, 8u, 16u}) {
    Device device({.packet_width = width});
    Array<float> sums(device, std::vector<float>(items + 1, -1), "sums");
    device.run("device/peak.cl", "peak", items + 1, items, rounds, 0.75f, 1.5f, sums);
    std::vector<float> expected;
    for (std::uint32_t i = 0; i < items; ++i) {
      float sum = 0;
      for (std::uint32_t k = 0; k < chains; ++k) {
        float x = float(i + k);
        for (std::uint32_t r = 0; r < rounds; ++r) x = x * 0.75f + 1.5f;
        sum += x;
      }
      expected.push_back(sum);
    }
    expected.push_back(-1);  // past the end
    EXPECT_EQ(sums.download(), expected) << "width " << width;
  }
}

}  // namespace
}  // namespace clrad
