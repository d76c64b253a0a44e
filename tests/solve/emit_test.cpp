#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

using Words = std::vector<std::uint32_t>;

TEST(Emit, FacingReceiversThatNothingCoversAreChosenInTheirOrder) {
  Device device;
  const Array<std::uint32_t> order(device, Words{1, 5, 0, 2, 4, 3}, "order");
  const Array<std::uint32_t> covered(device, Words{0, 1, 0, 1, 0, 0}, "covered");
  const Array<std::uint32_t> facing(device, Words{1, 1, 1, 1, 0, 1}, "facing");
  Array<std::uint32_t> chosen(device, Words{7, 7, 7, 7, 7, 7, 7}, "chosen");
  device.run("solve/emit.cl", "choose", 6, facing, covered, order, 0u, 6u, chosen);
  EXPECT_EQ(chosen.download(), (Words{0, 1, 1, 1, 0, 0, 7}));  // the seventh is past the end
  // Only receivers from 2 on, wherever they come in the order.
  const Array<std::uint32_t> facing_new(device, Words{1, 1, 0, 1}, "facing");
  device.run("solve/emit.cl", "choose", 6, facing_new, covered, order, 2u, 6u, chosen);
  EXPECT_EQ(chosen.download(), (Words{0, 1, 0, 1, 0, 0, 7}));
}

TEST(Emit, PlacesInTheOrderBecomeReceivers) {
  Device device;
  const Array<std::uint32_t> order(device, Words{1, 5, 0, 2, 4, 3}, "order");
  Array<std::uint32_t> active(device, Words{1, 2, 5, 9}, "active");
  device.run("solve/emit.cl", "receivers_at", 3, active, order, 3u);
  EXPECT_EQ(active.download(), (Words{5, 0, 3, 9}));
}

}  // namespace
}  // namespace clrad
