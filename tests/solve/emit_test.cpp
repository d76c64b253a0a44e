#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

TEST(Emit, CoveredReceiversGetNoRaysAndOthersAreLeftAsTheyAre) {
  Device device;
  Array<std::uint32_t> flags(device, std::vector<std::uint32_t>{1, 0, 1, 1, 1}, "flags");
  const Array<std::uint32_t> covered(device, std::vector<std::uint32_t>{0, 0, 1, 0, 1}, "covered");
  device.run("solve/emit.cl", "drop_covered", 4, flags, covered, 0u, 4u);  // the fifth is past the end
  EXPECT_EQ(flags.download(), (std::vector<std::uint32_t>{1, 0, 0, 1, 1}));
}

}  // namespace
}  // namespace clrad
