// `shaft` gives the bits of `serial`, whatever is set and however its work is cut.
#include "visibility/shaft.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "device/divided.hpp"
#include "visibility/setting.hpp"

namespace clrad {
namespace {

using test::masks_of;
using test::random_setting;
using test::Setting;

TEST(Shaft, BitsAreThoseOfSerialWhateverTheWidthTheRunAndTheBudget) {
  std::mt19937_64 random(20301);
  for (const bool lattice : {false, true}) {
    const Setting s = random_setting(random, lattice ? 12 : 300, 0.15, 150, lattice);
    for (const std::uint32_t samples : {0u, 1u, 3u, 16u, 33u, 100u}) {
      Device reference;
      const auto expected = masks_of(reference, *make_engine("serial", reference, s.triangles), s, samples);
      std::size_t blocked = 0;
      for (const auto word : expected) blocked += std::size_t(std::popcount(word));
      EXPECT_GT(blocked, 0u);
      EXPECT_LT(blocked, s.origins.size() * std::max(samples, 1u));
      for (const DeviceOptions& on :
           {DeviceOptions{}, DeviceOptions{.cores = test::one_core(), .work_group_size = 16},
            DeviceOptions{.packet_width = 1}, DeviceOptions{.packet_width = 4},
            DeviceOptions{.packet_width = 16},
            DeviceOptions{.precision = Precision::float64, .packet_width = 8}}) {
        Device device(on);
        for (const ShaftOptions& options :
             {ShaftOptions{}, ShaftOptions{32, 0}, ShaftOptions{32, 2}, ShaftOptions{5, 1000}}) {
          SCOPED_TRACE("samples " + std::to_string(samples) + ", width " + std::to_string(on.packet_width) +
                       ", budget " + std::to_string(options.budget));
          EXPECT_EQ(masks_of(device, *make_shaft(device, s.triangles, options), s, samples), expected);
        }
      }
    }
  }
}

// Receivers side by side on a floor and samples on a lamp above: shafts that are narrow, full, empty and blocked as a whole.
Setting floor_and_lamp() {
  std::mt19937_64 random(20302);
  Setting s = random_setting(random, 40, 0.2, 1, false);
  for (auto& t : s.triangles)
    for (auto& c : t.corner) c.z *= 0.5;
  s.triangles.push_back(
      {{{-0.9, -0.9, 0.1}, {0.1, -0.9, 0.1}, {-0.9, 0.3, 0.1}}, 900, 900});  // blocks many as a whole
  s.origins.clear(), s.targets.clear();
  for (int j = 0; j < 60; ++j)
    for (int i = 0; i < 60; ++i) s.origins.push_back(test::at({-0.9 + i * 0.03, -0.9 + j * 0.03, -0.8}, 901));
  for (int k = 0; k < 64; ++k)
    s.targets.push_back(test::at({-0.3 + k % 8 * 0.05, 0.1 + k / 8 * 0.05, 0.8}, 902));
  return s;
}

TEST(Shaft, BitsAreThoseOfSerialBetweenAFloorAndALamp) {
  const Setting s = floor_and_lamp();
  Device device;
  const auto serial = make_engine("serial", device, s.triangles);
  for (const std::uint32_t samples : {4u, 16u, 64u})
    for (const ShaftOptions& options :
         {ShaftOptions{}, ShaftOptions{32, 0}, ShaftOptions{32, 3}, ShaftOptions{4, 100}}) {
      const auto expected = masks_of(device, *serial, s, samples);
      const auto shaft = make_shaft(device, s.triangles, options);
      EXPECT_EQ(masks_of(device, *shaft, s, samples), expected)
          << samples << " samples, budget " << options.budget;
      EXPECT_EQ(shaft->counts().rays, std::uint64_t(s.origins.size()) * samples);
      // It looks at few of the pairs that serial tests, and at some.
      EXPECT_LT(shaft->counts().candidates, serial->counts().candidates / 4);
      EXPECT_GT(shaft->counts().candidates, 0u);
    }
}

TEST(Shaft, SaysHowManyRunsOfSamplesShaftsDecided) {
  Setting s = floor_and_lamp();
  Device device({.packet_width = 8});
  const auto share = [&] {
    const auto engine = make_shaft(device, s.triangles);
    EXPECT_EQ(engine->account(), "");  // nothing to say yet
    masks_of(device, *engine, s, 40);
    double percent = -1;
    const std::string said = engine->account();
    EXPECT_EQ(std::sscanf(said.c_str(), "shafts decided %lf %% of the runs", &percent), 1) << said;
    return percent;
  };
  EXPECT_GT(share(), 50);
  EXPECT_LT(share(), 99);
  // Told what to do, it has nothing to say.
  const auto told = make_shaft(device, s.triangles, {.budget = 8});
  masks_of(device, *told, s, 40);
  EXPECT_EQ(told->account(), "");
  s.triangles.clear();
  EXPECT_EQ(share(), 100);
}

TEST(Shaft, NearestHitsAreThoseOfSerial) {
  std::mt19937_64 random(20304);
  for (const bool lattice : {false, true}) {
    const Setting s = random_setting(random, lattice ? 12 : 300, 0.15, 400, lattice);
    for (const DeviceOptions& on : {DeviceOptions{}, DeviceOptions{.packet_width = 1},
                                    DeviceOptions{.precision = Precision::float64, .packet_width = 4}}) {
      Device device(on);
      const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
      for (const std::uint32_t samples : {0u, 7u}) {
        const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, samples};
        const auto nearest = [&](const std::string& name) {
          Array<std::uint32_t> triangle(device, segments.count(), "triangles");
          Array<float> t(device, segments.count(), "t");
          make_engine(name, device, s.triangles)->intersect_closest(segments, triangle, t);
          return std::pair(triangle.download(), t.download());
        };
        EXPECT_EQ(nearest("shaft"), nearest("serial"));
      }
    }
  }
}

TEST(Shaft, AnswersWithoutTrianglesAndWithOne) {
  Device device;
  Setting s;
  for (int i = 0; i < 20; ++i)
    s.origins.push_back(test::at({i * 0.05 - 0.5, 0, -0.5})), s.targets.push_back(test::at({0, 0, 0.5}));
  for (const std::uint32_t samples : {0u, 5u}) {
    const auto masks = masks_of(device, *make_engine("shaft", device, s.triangles), s, samples);
    EXPECT_EQ(masks, std::vector<std::uint32_t>(20, 0));
  }
  s.triangles.push_back({{{-2, -2, 0}, {2, -2, 0}, {0, 3, 0}}, 0, 0});
  for (const std::uint32_t samples : {0u, 5u}) {
    const auto masks = masks_of(device, *make_engine("shaft", device, s.triangles), s, samples);
    EXPECT_EQ(masks, std::vector<std::uint32_t>(20, samples ? 31 : 1));
  }
}

}  // namespace
}  // namespace clrad
