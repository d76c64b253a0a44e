#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

constexpr const char* select_kernels = "solve/select.cl";

TEST(Select, PowerIsAreaTimesAbsoluteUnshotOverBands) {
  Device device;
  const RealArray unshot(device, std::vector<double>{1, -2, 0, 0.5, 0.25, 0}, "unshot");
  const RealArray area(device, std::vector<double>{2, 4, 8}, "areas");
  Array<float> power(device, 3, "power");
  device.run(select_kernels, "unshot_power", 3, unshot, area, power, 3u, 2u);
  EXPECT_EQ(power.download(), (std::vector<float>{3, 9, 0}));
}

TEST(Select, TakingAShotEmptiesThePatchAndRemembersIt) {
  Device device;
  RealArray unshot(device, std::vector<double>{1, 2, 3, 4}, "unshot"),
      lost(device, std::vector<double>{1, 1, 1, 1}, "lost");
  RealArray total(device, std::vector<double>{10, 20, 30, 40}, "total"),
      shot(device, std::vector<double>{0, 0}, "shot");
  const Array<std::uint32_t> chosen(device, std::vector<std::uint32_t>{1}, "chosen");
  device.run(select_kernels, "take_shot", 2, unshot, lost, total, shot, chosen, 1u, 2u, 2u);
  EXPECT_EQ(shot.download(), (std::vector<double>{2, 4}));
  EXPECT_EQ(unshot.download(), (std::vector<double>{1, 0, 3, 0}));
  EXPECT_EQ(lost.download(), (std::vector<double>{1, 0, 1, 0}));
  EXPECT_EQ(total.download(), (std::vector<double>{10, 22, 30, 44}));
}

TEST(Select, TakingAllShotsLeavesPatchesWithoutAColumnAlone) {
  Device device;
  RealArray unshot(device, std::vector<double>{1, 2, 3}, "unshot"),
      lost(device, std::vector<double>{0, 0, 0}, "lost");
  RealArray total(device, std::vector<double>{0, 0, 0}, "total"),
      pending(device, std::vector<double>{5, 5, 5}, "pending");
  RealArray by_slot(device, std::vector<double>{0, 0}, "shots");
  const Array<std::uint32_t> slots(device, std::vector<std::uint32_t>{1, 0xffffffffu, 0}, "slots");
  device.run(select_kernels, "take_shots", 3, unshot, lost, total, pending, slots, by_slot, 2u, 3u, 1u);
  EXPECT_EQ(by_slot.download(), (std::vector<double>{3, 1}));
  EXPECT_EQ(unshot.download(), (std::vector<double>{0, 2, 0}));
  EXPECT_EQ(pending.download(), (std::vector<double>{6, 5, 8}));
}

}  // namespace
}  // namespace clrad
