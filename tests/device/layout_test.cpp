#include "device/layout.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clrad/visibility.hpp"
#include "device/program.hpp"

namespace clrad {
namespace {

TEST(Layout, DeviceStructsMatchTheHost) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const bool fp64 = precision == Precision::float64;
    const auto expected = host_layout(fp64);
    Array<std::uint32_t> out(device, expected.size(), "layout");
    Array<clrad_point_float> points(device, 1, "points");
    Array<clrad_triangle> triangles(device, 1, "triangles");
    Array<clrad_point_double> doubles(device, 1, "doubles");
    if (fp64)
      device.run("device/layout.cl", "layout", 1, out, points, triangles, doubles);
    else
      device.run("device/layout.cl", "layout", 1, out, points, triangles);
    EXPECT_EQ(out.download(), expected);
  }
}

TEST(Points, KeepFortyEightBitsInFloat) {
  Device device;
  const std::vector<Point> points{{{0.1, -0.7, 1.0 / 3}, {0, 1, 0}, 7, 9}};
  const auto back = PointArray(device, points, "points").download();
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(back[0].position[i], points[0].position[i], std::ldexp(std::abs(points[0].position[i]), -48));
  EXPECT_EQ(back[0].plane, 7u);
  EXPECT_EQ(back[0].surface, 9u);
  EXPECT_THROW(PointArray(device, std::vector<Point>{{{5, 0, 0}}}, "far"), UsageError);
}

// Shorter ones than the least buffer, too.
TEST(Arrays, MadeFromValuesHoldThem) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    for (std::uint32_t n = 0; n < 9; ++n) {
      std::vector<std::uint32_t> numbers;
      std::vector<double> reals;
      std::vector<Point> points;
      for (std::uint32_t i = 0; i < n; ++i) {
        numbers.push_back(n + 100 * i), reals.push_back(i - 0.5);
        points.push_back({{0.5, 0.25 * i, -1}, {0, 1, 0}, i, n});
      }
      EXPECT_EQ((Array<std::uint32_t>(device, numbers, "numbers").download()), numbers);
      EXPECT_EQ(RealArray(device, reals, "reals").download(), reals);
      const auto back = PointArray(device, points, "points").download();
      ASSERT_EQ(back.size(), n);
      for (std::uint32_t i = 0; i < n; ++i) {
        EXPECT_EQ(back[i].position, points[i].position);
        EXPECT_EQ(back[i].plane, i);
        EXPECT_EQ(back[i].surface, n);
      }
    }
  }
}

TEST(Device, UnknownNameAndTooManyCoresAreUsageErrors) {
  EXPECT_THROW(Device({.device = "no such device"}), UsageError);
  EXPECT_THROW(Device({.device = "99"}), UsageError);
  EXPECT_THROW(Device({.cores = 100000}), UsageError);
}

TEST(Device, MemoryBudgetIsKeptAndExplained) {
  Device device({.memory_bytes = 1 << 20});
  Array<float> half(device, 1 << 17, "half");
  try {
    Array<float> more(device, 1 << 18, "the straw");
    FAIL() << "the budget was exceeded";
  } catch (const DeviceError& e) {
    EXPECT_NE(std::string(e.what()).find("the straw"), std::string::npos);
  }
  EXPECT_EQ(device.ledger()->held, std::uint64_t(1) << 19);
  half = Array<float>();
  EXPECT_EQ(device.ledger()->held, 0u);
}

TEST(Device, StagesCountLaunchesAndBytes) {
  Device device;
  Array<std::uint32_t> a(device, 100, "a");
  {
    const auto stage = device.stage("clear the array");
    a.fill_zero();
    const Array<float> b(device, 3, "b");
  }
  const auto profile = device.profile();
  ASSERT_EQ(profile.size(), 1u);
  EXPECT_EQ(profile[0].name, "clear the array");
  EXPECT_EQ(profile[0].launches, 1u);
  EXPECT_EQ(profile[0].bytes, 12u);
}

TEST(Device, PlacesInLogsAreNamedWhereTheCompilerIgnoresLineDirectives) {
  const std::string source =
      "#define A\n#line 1 \"kernels/a.cl\"\nint a;\n#line 7 \"kernels/b.h\"\nint b;\nint c;\n";
  EXPECT_EQ(
      name_places(source, "<kernel>:3:5: error: x\n<kernel>:6:1: and <kernel>:1:1, not <kernel>:99:1\n"),
      "kernels/a.cl:1:5: error: x\nkernels/b.h:8:1: and preamble:1:1, not <kernel>:99:1\n");
  const std::string named = "kernels/a.cl:3:5: error: x";
  EXPECT_EQ(name_places(source, named), named);
  EXPECT_EQ(name_places(source, ""), "");
}

TEST(Device, BuildFailureNamesFileLineAndDevice) {
  const Device device;
  try {
    cl::Device raw = device.queue().getInfo<CL_QUEUE_DEVICE>();
    setenv("CLRAD_KERNEL_DIR", CLRAD_TEST_DATA "/kernels", 1);
    build_program(device.context(), raw, device.info(), device.options(), "broken.cl");
    unsetenv("CLRAD_KERNEL_DIR");
    FAIL() << "broken.cl built";
  } catch (const DeviceError& e) {
    unsetenv("CLRAD_KERNEL_DIR");
    const std::string message = e.what();
    EXPECT_NE(message.find("broken.cl:2"), std::string::npos) << message;
    EXPECT_NE(message.find(device.info().name), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace clrad
