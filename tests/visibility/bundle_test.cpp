// Occlusion by bundles of rays: the same pieces as rays cut one by one, the same bits as `serial`, and what waves spare.
#include "visibility/bundle.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "device/divided.hpp"
#include "visibility/chop.hpp"
#include "visibility/setting.hpp"

namespace {

using clrad::Array;
using clrad::ChopOptions;
using clrad::Device;
using clrad::DeviceOptions;
using clrad::OccluderTriangle;
using clrad::Point;
using clrad::PointArray;
using clrad::Segments;
using clrad::test::at;
using clrad::test::masks_of;
using clrad::test::random_setting;
using clrad::test::Setting;

TEST(Bundle, PiecesAndCandidatesAreThoseOfRaysCutOneByOne) {
  std::mt19937_64 random(20281);
  for (const bool lattice : {false, true}) {
    const Setting s = random_setting(random, 80, 0.2, 90, lattice);
    for (const unsigned width : {1u, 4u, 8u, 16u}) {
      Device device({.packet_width = width});
      const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
      for (const std::uint32_t samples : {0u, 1u, 5u, 16u, 33u, 90u})
        for (const ChopOptions& options :
             {ChopOptions{.cells = {6, 5, 4}, .slab = 0}, ChopOptions{.cells = {1, 7, 1}, .slab = 0},
              ChopOptions{.cells = {3, 1, 8}, .slab = 0}, ChopOptions{.cells = {1, 1, 1}}}) {
          SCOPED_TRACE("width " + std::to_string(width) + ", samples " + std::to_string(samples));
          const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, samples};
          auto bundles = clrad::make_chop(device, s.triangles, options);
          auto alone = clrad::make_chop(device, s.triangles, options);
          Array<std::uint32_t> masks(device, segments.origin_count * segments.words_per_origin(), "masks");
          Array<std::uint32_t> triangle(device, segments.count(), "triangles");
          Array<float> t(device, segments.count(), "t");
          bundles->occluded(segments, masks);
          alone->intersect_closest(segments, triangle, t);
          EXPECT_EQ(bundles->counts().rays, segments.count());
          EXPECT_EQ(bundles->counts().pieces, alone->counts().pieces);
          EXPECT_EQ(bundles->counts().candidates, alone->counts().candidates);
          EXPECT_GT(bundles->counts().candidates, 0u);
          // A ray is blocked exactly when it has a nearest hit.
          const auto bits = masks.download();
          const auto nearest = triangle.download();
          const std::uint32_t each = samples ? samples : 1, words = segments.words_per_origin();
          for (std::size_t r = 0; r < nearest.size(); ++r) {
            const std::size_t o = r / each, k = r % each;
            ASSERT_EQ(bits[o * words + k / 32] >> (k % 32) & 1u, nearest[r] != 0xffffffffu) << "ray " << r;
          }
        }
    }
  }
}

TEST(Bundle, BitsAreThoseOfSerialWhateverTheWidthTheGroupTheBatchAndTheWaves) {
  std::mt19937_64 random(20282);
  for (const bool lattice : {false, true}) {
    const Setting s = random_setting(random, lattice ? 12 : 120, 0.15, 150, lattice);
    for (const std::uint32_t samples : {0u, 3u, 16u, 17u, 100u}) {
      Device reference;
      const auto expected =
          masks_of(reference, *clrad::make_engine("serial", reference, s.triangles), s, samples);
      std::size_t blocked = 0;
      for (const auto word : expected) blocked += std::size_t(std::popcount(word));
      EXPECT_GT(blocked, 0u);
      EXPECT_LT(blocked, s.origins.size() * std::max(samples, 1u));
      for (const DeviceOptions& on :
           {DeviceOptions{}, DeviceOptions{.cores = clrad::test::one_core(), .work_group_size = 16},
            DeviceOptions{.packet_width = 1}, DeviceOptions{.packet_width = 4},
            DeviceOptions{.precision = clrad::Precision::float64, .packet_width = 8}}) {
        Device device(on);
        for (const ChopOptions& options : {ChopOptions{}, ChopOptions{.cells = {9, 7, 5}, .slab = 1},
                                           ChopOptions{.rays_per_batch = 70, .cells = {4, 6, 1}, .slab = 2},
                                           ChopOptions{.cells = {12, 12, 12}}}) {
          SCOPED_TRACE("width " + std::to_string(on.packet_width) + ", samples " + std::to_string(samples));
          auto chop = clrad::make_chop(device, s.triangles, options);
          EXPECT_EQ(masks_of(device, *chop, s, samples), expected);
        }
      }
    }
  }
}

TEST(Bundle, ExactTestsAreCountedTheSameWhateverTheCoresTheGroupAndTheBatch) {
  std::mt19937_64 random(20283);
  const Setting s = random_setting(random, 30, 0, 200, true);
  std::vector<std::uint64_t> first;
  for (const DeviceOptions& on :
       {DeviceOptions{}, DeviceOptions{.cores = clrad::test::one_core(), .work_group_size = 8}})
    for (const std::uint32_t batch : {0u, 320u}) {
      Device device(on);
      auto chop =
          clrad::make_chop(device, s.triangles, {.rays_per_batch = batch, .cells = {5, 5, 5}, .slab = 2});
      masks_of(device, *chop, s, 16);
      const auto c = chop->counts();
      const std::vector<std::uint64_t> mine = {c.rays, c.pieces, c.candidates, c.exact};
      if (first.empty()) first = mine;
      EXPECT_EQ(mine, first);
      EXPECT_GT(c.exact, 0u);
    }
}

TEST(Bundle, WavesTellWhatTheySpared) {
  Device device;
  // A wall that every ray meets in its first cells, the slanting ones (to the farther targets) no later.
  Setting s;
  s.triangles = {{{{-0.9, -3, -3}, {-0.9, 3.9, -3}, {-0.9, -3, 3.9}}, 0, 0},
                 {{{0.95, 0, 0}, {0.95, 0.1, 0}, {0.95, 0, 0.1}}, 1, 1}};
  std::mt19937_64 random(20284);
  std::uniform_real_distribution<double> unit(-0.4, 0.4);
  for (int i = 0; i < 100; ++i) s.origins.push_back(at({-0.95, unit(random), unit(random)}));
  for (int i = 0; i < 20; ++i) s.targets.push_back(at({0.9, unit(random), unit(random)}));
  s.origins[0].position.x = s.origins[1].position.x = -0.85;  // these two start behind it
  auto chop = clrad::make_chop(device, s.triangles, {.cells = {32, 4, 4}, .slab = 4});
  chop->count_waves();
  const auto bits = masks_of(device, *chop, s, 20);
  for (std::size_t o = 0; o < bits.size(); ++o)
    EXPECT_EQ(bits[o], o < 2 ? 0u : (1u << 20) - 1) << "origin " << o;
  const auto& waves = chop->waves();
  ASSERT_EQ(waves.size(), 4u);  // 4 + 8 + 16 cells, and the rest of 32
  EXPECT_EQ(waves[0].rays, 2000u);
  EXPECT_EQ(waves[0].blocked, 0u);
  std::uint64_t pieces = 0;
  for (std::size_t w = 0; w < waves.size(); ++w) {
    pieces += waves[w].pieces;
    EXPECT_EQ(waves[w].rays, 2000u) << "wave " << w;
    if (w > 0) {
      EXPECT_EQ(waves[w].blocked, 1960u) << "wave " << w;
      // Forty rays are left, of at most 17 x cells and as many more as they cross of y and z in all.
      EXPECT_LE(waves[w].pieces, 40u * (17 + 6)) << "wave " << w;
    }
  }
  EXPECT_EQ(pieces, chop->counts().pieces);
}

}  // namespace
