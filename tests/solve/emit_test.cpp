#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

using Words = std::vector<std::uint32_t>;

TEST(Emit, FacingReceiversThatNothingCoversAreChosenInTheirOrder) {
  Device device;
  // Receivers 2 to 5 are new, and come in the order 5, 2, 4, 3.
  const Array<std::uint32_t> order(device, Words{1, 0, 5, 2, 4, 3}, "order");
  const Array<std::uint32_t> facing(device, Words{1, 1, 0, 1}, "facing");  // receiver 4 does not
  const Array<std::uint32_t> covered(device, Words{1, 1, 0, 1, 0, 0}, "covered");
  Array<std::uint32_t> chosen(device, Words{7, 7, 7, 7, 7}, "chosen");
  device.run("solve/emit.cl", "choose", 4, facing, covered, order, 2u, 4u, chosen);
  EXPECT_EQ(chosen.download(), (Words{1, 1, 0, 0, 7}));  // the fifth is past the end
}

TEST(Emit, PlacesInTheOrderBecomeReceivers) {
  Device device;
  const Array<std::uint32_t> order(device, Words{1, 0, 5, 2, 4, 3}, "order");
  Array<std::uint32_t> active(device, Words{0, 1, 3, 9}, "active");
  device.run("solve/emit.cl", "receivers_at", 3, active, order, 2u, 3u);
  EXPECT_EQ(active.download(), (Words{5, 2, 3, 9}));
}

}  // namespace
}  // namespace clrad
