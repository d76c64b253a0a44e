#include "primitives/support.hpp"

#include <rapidcheck.h>

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;

void expect_allocation(const Way& way, const Uints& counts) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << counts.size());
  Device& device = device_for(way);
  Uints offsets(1, 0), owner, rank;
  for (std::uint32_t i = 0; i < counts.size(); ++i) {
    for (std::uint32_t k = 0; k < counts[i]; ++k) owner.push_back(i), rank.push_back(k);
    offsets.push_back(std::uint32_t(owner.size()));
  }
  const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(counts), "counts");
  const Allocation fresh = allocate(device, from.buffer(), counts.size());
  ASSERT_EQ(fresh.total, owner.size());
  ASSERT_TRUE(fresh.offsets.download() == offsets);
  ASSERT_TRUE(fresh.owner.download() == owner);
  ASSERT_TRUE(fresh.rank.download() == rank);

  // Into kept arrays that are longer than needed: nothing past the end is touched.
  constexpr std::uint32_t canary = 0xdeadbeefu;
  Allocation kept;
  for (auto* array : {&kept.offsets, &kept.owner, &kept.rank}) {
    *array = Array<std::uint32_t>(device, std::max(offsets.size(), owner.size()) + 37, "kept");
    device.fill_bytes(array->buffer(), canary, array->bytes());
  }
  allocate_into(device, from.buffer(), counts.size(), kept);
  ASSERT_EQ(kept.total, owner.size());
  const auto check = [&](const Array<std::uint32_t>& array, Uints want) {
    want.resize(array.size(), canary);
    return array.download() == want;
  };
  ASSERT_TRUE(check(kept.offsets, offsets));
  ASSERT_TRUE(check(kept.owner, owner));
  ASSERT_TRUE(check(kept.rank, rank));
}

Uints random_counts(std::uint64_t n, std::uint32_t most) {
  std::mt19937 random(seed() + std::uint32_t(n) * 7);
  Uints counts(n);
  for (auto& c : counts) c = random() % 3 == 0 ? 0 : random() % (most + 1);
  return counts;
}

TEST(Allocate, EverySizeShapeAndWorkGroup) {
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes()) expect_allocation(way, random_counts(n, n > 100000 ? 3 : 40));
}

TEST(Allocate, NobodyAsksAndNobodyIsThere) {
  for (const Way& way : ways()) {
    expect_allocation(way, Uints(5, 0));
    expect_allocation(way, Uints(70000, 0));
    Device& device = device_for(way);
    device.reset_profile();
    const Allocation none = allocate(device, cl::Buffer(), 0);
    EXPECT_EQ(none.total, 0u);
    EXPECT_EQ(none.offsets.download(), Uints{0});
    EXPECT_TRUE(device.profile().empty());
  }
}

// One requester with a million slots among requesters with none, at the start, in the middle and at the end.
TEST(Allocate, OneLargeRequesterAmongManyEmptyOnes) {
  for (const Way& way : ways())
    for (const std::size_t at : {std::size_t(0), std::size_t(131072), std::size_t(300000)}) {
      Uints counts(300001, 0);
      counts[at] = 1000003;
      expect_allocation(way, counts);
    }
}

TEST(Allocate, OnesTwosAndSixteens) {
  for (const Way& way : ways())
    for (const std::uint32_t each : {1u, 2u, 15u, 16u, 17u, 33u}) expect_allocation(way, Uints(20011, each));
}

TEST(Allocate, TotalsPast32BitsThrowAndLeaveTheDeviceUsable) {
  for (const Way& way : ways()) {
    Device& device = device_for(way);
    const Uints counts(1u << 16, 1u << 16);
    const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(counts), "counts");
    EXPECT_THROW(allocate(device, from.buffer(), counts.size(), "slots"), UsageError);
    expect_allocation(way, random_counts(5000, 5));
  }
}

TEST(Allocate, KeptArraysGrowAndAreReused) {
  Device& device = device_for(ways()[0]);
  Allocation kept;
  for (const std::uint32_t each : {3u, 5u, 1u}) {
    const Uints counts(1000, each);
    const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(counts), "counts");
    allocate_into(device, from.buffer(), counts.size(), kept);
    ASSERT_EQ(kept.total, 1000 * each);
    const Uints owner = kept.owner.download(0, kept.total), rank = kept.rank.download(0, kept.total);
    for (std::uint32_t s = 0; s < kept.total; ++s) {
      ASSERT_EQ(owner[s], s / each);
      ASSERT_EQ(rank[s], s % each);
    }
  }
  EXPECT_GE(kept.owner.size(), 5000u);
  const auto owner = kept.owner.buffer()();
  const Uints counts(1000, 2);
  const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(counts), "counts");
  allocate_offsets_into(device, from.buffer(), counts.size(), kept);
  EXPECT_EQ(kept.total, 2000u);
  EXPECT_EQ(kept.offsets.at(1000), 2000u);
  EXPECT_EQ(kept.owner.buffer()(), owner);
}

void expect_compacted(const Way& way, const Uints& flags) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << flags.size());
  Device& device = device_for(way);
  Uints want;
  for (std::uint32_t i = 0; i < flags.size(); ++i)
    if (flags[i]) want.push_back(i);
  const auto kept = std::uint32_t(want.size());
  const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(flags), "flags");
  Guarded<std::uint32_t> indices(device, flags.size());
  want.resize(flags.size(), Guarded<std::uint32_t>::canary);  // places past the count stay as they were
  ASSERT_EQ(compact(device, from.buffer(), flags.size(), indices), kept);
  ASSERT_TRUE(indices.values() == want);
  ASSERT_TRUE(indices.intact());
  const Array<std::uint32_t> count(device, 2, "count");
  compact_on_device(device, from.buffer(), flags.size(), indices, count.buffer());
  ASSERT_EQ(count.download(), (Uints{kept, 0}));
  ASSERT_TRUE(indices.values() == want);
}

TEST(Compact, EverySizeShapeAndWorkGroup) {
  std::mt19937 random(seed());
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes()) {
      Uints flags(n);
      for (auto& f : flags) f = random() % 3 ? 0 : random() | 1;  // any value but 0 keeps
      expect_compacted(way, flags);
    }
}

TEST(Compact, NoneAllOneAndRuns) {
  for (const Way& way : ways())
    for (const std::uint64_t n : {17ull, 4097ull, 100003ull}) {
      expect_compacted(way, Uints(n, 0));
      expect_compacted(way, Uints(n, 0x80000000u));
      Uints flags(n, 0);
      flags[n - 1] = 1;
      expect_compacted(way, flags);
      for (std::uint64_t i = 0; i < n; ++i) flags[i] = i / 100 % 2;
      expect_compacted(way, flags);
    }
  Device& device = device_for(ways()[0]);
  device.reset_profile();
  EXPECT_EQ(compact(device, cl::Buffer(), 0, cl::Buffer()), 0u);
  EXPECT_TRUE(device.profile().empty());
}

TEST(Allocate, EqualsTheOracleOnAnyInput) {
  rc::check("allocate", [] {
    const auto counts = *rc::gen::container<Uints>(rc::gen::inRange(0u, 50u));
    for (const Way& way : {ways()[0], ways()[1]})
      if (!counts.empty()) {
        expect_allocation(way, counts);
        expect_compacted(way, counts);
      }
    RC_ASSERT(!testing::Test::HasFailure());
  });
}

}  // namespace
}  // namespace clrad
