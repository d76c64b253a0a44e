#include <rapidcheck.h>

#include <cmath>
#include <limits>

#include "primitives/support.hpp"

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;
using Floats = std::vector<float>;
constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t none = 0xffffffffu;

/// The documented order, written down plainly: rows of 16 by pairs, rows of a block of 1024 left to right.
float block_sum(const float* x, std::size_t n) {
  float sum = -0.0f;
  for (std::size_t row = 0; row < n; row += 16) {
    float r[16];
    for (std::size_t k = 0; k < 16; ++k) r[k] = row + k < n ? x[row + k] : -0.0f;
    for (std::size_t width = 8; width > 0; width /= 2)
      for (std::size_t k = 0; k < width; ++k) r[k] = r[2 * k] + r[2 * k + 1];
    sum += r[0];
  }
  return sum;
}

float segment_sum(const float* x, std::size_t n) {
  if (n == 0) return 0.0f;
  float sum = -0.0f;
  for (std::size_t b = 0; b < n; b += 1024) sum += block_sum(x + b, std::min<std::size_t>(1024, n - b));
  return sum;
}

struct Min {
  float value = inf;
  std::uint32_t index = none;
};
Min segment_min(const Floats& x, std::uint32_t begin, std::uint32_t end) {
  Min m;
  for (std::uint32_t i = begin; i < end; ++i)
    if (!std::isnan(x[i]) && (m.index == none || x[i] < m.value)) m = {x[i], i};
  return m;
}

/// Lengths of segments with many short, some empty and a few that straddle blocks and work-groups.
Uints random_offsets(std::uint64_t n, std::mt19937& random) {
  Uints offsets{0};
  while (offsets.back() < n) {
    const unsigned kind = random() % 16;
    const std::uint64_t length = kind == 0   ? 0
                                 : kind == 1 ? random() % 5000
                                 : kind == 2 ? 250 + random() % 20
                                             : random() % 40;
    offsets.push_back(std::uint32_t(std::min<std::uint64_t>(n, offsets.back() + length)));
  }
  if (random() % 2) offsets.push_back(std::uint32_t(n));  // an empty one at the end
  return offsets;
}

Floats random_floats(std::uint64_t n, std::mt19937& random, bool special) {
  Floats values(n);
  for (auto& v : values) {
    v = float(int(random() % 2001) - 1000) / 8;  // many ties
    if (special && random() % 8 == 0) {
      const float specials[] = {0.0f, -0.0f, inf, -inf, nan, std::numeric_limits<float>::denorm_min(),
                                -nan, 1e38f};
      v = specials[random() % 8];
    }
  }
  return values;
}

void expect_segments(const Way& way, const Floats& values, const Uints& offsets) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << values.size()
                                  << ", segments = " << offsets.size() - 1);
  Device& device = device_for(way);
  const std::uint64_t segments = offsets.size() - 1;
  const Array<float> in(device, std::span<const float>(values), "in");
  const Array<std::uint32_t> at(device, std::span<const std::uint32_t>(offsets), "offsets");
  Floats sums(segments), mins(segments);
  Uints indices(segments);
  for (std::uint64_t s = 0; s < segments; ++s) {
    sums[s] = segment_sum(values.data() + offsets[s], offsets[s + 1] - offsets[s]);
    const Min m = segment_min(values, offsets[s], offsets[s + 1]);
    mins[s] = m.value;
    indices[s] = m.index;
  }
  Guarded<float> out(device, segments);
  Guarded<std::uint32_t> index(device, segments);
  segmented_reduce_min(device, in.buffer(), at.buffer(), out, index, segments);
  ASSERT_TRUE(bits_of(out.values()) == bits_of(mins));
  ASSERT_TRUE(index.values() == indices);
  ASSERT_TRUE(out.intact() && index.intact());
  segmented_reduce_sum(device, in.buffer(), at.buffer(), out, segments);
  const Floats got = out.values();
  for (std::uint64_t s = 0; s < segments; ++s)  // the payload of a NaN is not part of the contract
    ASSERT_TRUE((std::isnan(got[s]) && std::isnan(sums[s])) || bits_of({got[s]}) == bits_of({sums[s]}))
        << "segment " << s << ": " << got[s] << " instead of " << sums[s];
  ASSERT_TRUE(out.intact());
}

TEST(SegmentedReduce, EverySizeShapeAndWorkGroup) {
  std::mt19937 random(seed());
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes()) {
      expect_segments(way, random_floats(n, random, true), random_offsets(n, random));
      expect_segments(way, random_floats(n, random, false), {0, std::uint32_t(n)});
    }
}

TEST(SegmentedReduce, SingleEmptyAndOneElementSegments) {
  std::mt19937 random(seed());
  for (const Way& way : ways()) {
    expect_segments(way, {1.0f}, {0, 1});
    expect_segments(way, {1.0f}, {0, 0, 0, 1, 1, 1});
    Uints ones(3001);
    for (std::uint32_t i = 0; i < ones.size(); ++i) ones[i] = i;
    expect_segments(way, random_floats(3000, random, true), ones);
    expect_segments(way, {1.0f}, Uints(5000, 0));
  }
}

TEST(SegmentedReduce, MinOfNansInfinitiesZerosAndTies) {
  for (const Way& way : ways()) {
    expect_segments(way, {nan, nan, nan}, {0, 3});
    expect_segments(way, {nan, inf, nan, inf}, {0, 4});
    expect_segments(way, {0.0f, -0.0f, -0.0f, 0.0f}, {0, 2, 4});
    Floats ties(700, 5.0f);
    ties[0] = nan;
    expect_segments(way, ties, {0, 700});
    ties[333] = ties[334] = ties[600] = -inf;
    expect_segments(way, ties, {0, 700});
    Floats infinite(700, inf);
    infinite[0] = infinite[1] = nan;
    expect_segments(way, infinite, {0, 700});
  }
}

TEST(SegmentedReduce, EqualsTheOracleOnAnyInput) {
  EXPECT_TRUE(rc::check("segmented_reduce", [] {
    const auto values = *rc::gen::arbitrary<Floats>();
    const auto cuts = *rc::gen::container<Uints>(rc::gen::inRange(0u, std::uint32_t(values.size()) + 1));
    if (values.empty()) return;
    Uints offsets = cuts;
    offsets.push_back(0);
    offsets.push_back(std::uint32_t(values.size()));
    std::sort(offsets.begin(), offsets.end());
    for (const Way& way : {ways()[0], ways()[1]}) expect_segments(way, values, offsets);
    RC_ASSERT(!testing::Test::HasFailure());
  }));
}

TEST(Reduce, SumInBlocksOf1024WhateverTheShape) {
  std::mt19937 random(seed());
  for (const std::uint64_t n : sizes()) {
    Floats values = random_floats(n, random, false);
    for (auto& v : values) v *= 1.1f;  // sums round, so that another order would show
    double want = 0;
    for (std::size_t b = 0; b < n; b += 1024)
      want += double(block_sum(values.data() + b, std::min<std::size_t>(1024, n - b)));
    for (const Way& way : ways()) {
      Device& device = device_for(way);
      const Array<float> in(device, std::span<const float>(values), "in");
      ASSERT_EQ(reduce_sum_float(device, in.buffer(), n), want) << way << ", n = " << n;
    }
  }
}

TEST(Reduce, ArgmaxTakesTheLowestOfTiesAndSkipsNan) {
  std::mt19937 random(seed());
  for (const std::uint64_t n : sizes())
    for (const bool special : {false, true}) {
      const Floats values = random_floats(n, random, special);
      ArgMax want{0, none};
      for (std::uint32_t i = 0; i < n; ++i)
        if (!std::isnan(values[i]) && (want.index == none || values[i] > want.value)) want = {values[i], i};
      for (const Way& way : ways()) {
        Device& device = device_for(way);
        const Array<float> in(device, std::span<const float>(values), "in");
        const ArgMax got = argmax_float(device, in.buffer(), n);
        ASSERT_EQ(got.index, want.index) << way << ", n = " << n;
        if (want.index != none) {
          ASSERT_TRUE(bits_of({got.value}) == bits_of({want.value}));
        }
      }
    }
}

TEST(Reduce, SumAndArgmaxAtOnceAreWhatEachIsAlone) {
  std::mt19937 random(seed());
  for (const std::uint64_t n : sizes()) {
    const Floats values = random_floats(n, random, false);
    for (const Way& way : ways()) {
      Device& device = device_for(way);
      const Array<float> in(device, std::span<const float>(values), "in");
      const SumAndArgMax both = sum_and_argmax_float(device, in.buffer(), n);
      ASSERT_EQ(both.sum, reduce_sum_float(device, in.buffer(), n)) << way << ", n = " << n;
      const ArgMax most = argmax_float(device, in.buffer(), n);
      ASSERT_EQ(both.most.index, most.index) << way << ", n = " << n;
      ASSERT_EQ(both.most.value, most.value) << way << ", n = " << n;
    }
  }
}

TEST(Reduce, NothingAndNothingButNan) {
  for (const Way& way : ways()) {
    Device& device = device_for(way);
    device.reset_profile();
    EXPECT_EQ(reduce_sum_float(device, cl::Buffer(), 0), 0.0);
    EXPECT_EQ(argmax_float(device, cl::Buffer(), 0).index, none);
    EXPECT_EQ(sum_and_argmax_float(device, cl::Buffer(), 0).most.index, none);
    segmented_reduce_sum(device, cl::Buffer(), cl::Buffer(), cl::Buffer(), 0);
    EXPECT_TRUE(device.profile().empty());
    const Floats values(70000, nan);
    const Array<float> in(device, std::span<const float>(values), "in");
    EXPECT_EQ(argmax_float(device, in.buffer(), values.size()).index, none);
    EXPECT_TRUE(std::isnan(reduce_sum_float(device, in.buffer(), values.size())));
  }
}

}  // namespace
}  // namespace clrad
