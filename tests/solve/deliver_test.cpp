#include <gtest/gtest.h>

#include <vector>

#include "clrad/device.hpp"

namespace clrad {
namespace {

constexpr const char* deliver_kernels = "solve/deliver.cl";

RealArray numbers(Device& device, const std::vector<double>& values) {
  return {device, values, "numbers"};
}

TEST(Deliver, VerticesGetFactorTimesShotInEveryBand) {
  Device device;
  const RealArray column = numbers(device, {0.5, 0, 0.25}),
                  shots = numbers(device, {9, 4, 9, 8});  // [band][2], taken at 1
  RealArray h = numbers(device, {1, 1, 1, 0, 0, 0}), lost = numbers(device, {0, 0, 0, 0, 0, 0});
  device.run(deliver_kernels, "deliver_to_vertices", 3, column, 1u, shots, 2u, 1u, h, lost, 0u, 3u, 2u);
  EXPECT_EQ(h.download(), (std::vector<double>{3, 1, 2, 4, 0, 2}));
}

TEST(Deliver, PatchesKeepIrradianceAndWillShootWhatTheyReflect) {
  Device device;
  const RealArray columns = numbers(device, {9, 9, 0.5, 0.25}), shot = numbers(device, {8}),
                  rho = numbers(device, {0.5, 0.25});
  RealArray h = numbers(device, {0, 1}), h_lost = numbers(device, {0, 0}), unshot = numbers(device, {1, 0}),
            u_lost = numbers(device, {0, 0});
  device.run(deliver_kernels, "deliver_to_patches", 2, columns, std::uint64_t(2), 1u, shot, 1u, 0u, rho, h,
             h_lost, unshot, u_lost, 2u, 1u);
  EXPECT_EQ(h.download(), (std::vector<double>{4, 3}));
  EXPECT_EQ(unshot.download(), (std::vector<double>{3, 0.5}));
}

TEST(Deliver, AllKeptColumnsAtOnceIsTheSumOfOneByOne) {
  Device device;
  // Two slots of two patches, two bands.
  const RealArray columns = numbers(device, {0.5, 0.25, 0.125, 1}), shots = numbers(device, {8, 4, 0, 2});
  const RealArray rho = numbers(device, {0.5, 0.5, 0.25, 0.25});
  RealArray h = numbers(device, {0, 0, 0, 0}), h_lost = numbers(device, {0, 0, 0, 0}),
            unshot = numbers(device, {0, 0, 0, 0}), u_lost = numbers(device, {0, 0, 0, 0});
  device.run(deliver_kernels, "deliver_kept", 4, columns, 1u, shots, 2u, rho, h, h_lost, unshot, u_lost, 2u,
             2u);
  EXPECT_EQ(h.download(), (std::vector<double>{4.5, 6, 0.25, 2}));
  EXPECT_EQ(unshot.download(), (std::vector<double>{2.25, 3, 0.0625, 0.5}));
}

// 10^5 shots of 1e-8 onto 1: a plain float sum would stay at 1; compensated, it errs by a rounding or two.
TEST(Deliver, SmallShotsAreNotLost) {
  Device device;
  const RealArray column = numbers(device, {1}), shot = numbers(device, {1e-8});
  RealArray h = numbers(device, {1}), lost = numbers(device, {0});
  constexpr int shots = 100000;
  for (int i = 0; i < shots; ++i)
    device.run(deliver_kernels, "deliver_to_vertices", 1, column, 1u, shot, 1u, 0u, h, lost, 0u, 1u, 1u);
  EXPECT_NEAR(h.download()[0], 1 + shots * 1e-8, 2e-7);
}

}  // namespace
}  // namespace clrad
