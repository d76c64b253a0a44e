#include <rapidcheck.h>

#include <algorithm>
#include <numeric>

#include "primitives/support.hpp"

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;

void expect_sorted(const Way& way, const Uints& keys, unsigned key_bits) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << keys.size() << ", " << key_bits << " bits");
  Device& device = device_for(way);
  const std::uint64_t n = keys.size();
  const std::uint32_t mask = key_bits == 32 ? 0xffffffffu : (1u << key_bits) - 1;
  Uints order(n), want_keys(n);
  std::iota(order.begin(), order.end(), 0u);  // the values: positions, so that an unstable sort shows
  Guarded<std::uint32_t> k(device, n), v(device, n);
  k.array.upload(keys);
  v.array.upload(order);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return (keys[a] & mask) < (keys[b] & mask); });
  for (std::uint64_t i = 0; i < n; ++i) want_keys[i] = keys[order[i]];
  radix_sort(device, k, v, n, key_bits);
  ASSERT_TRUE(k.values() == want_keys);
  ASSERT_TRUE(v.values() == order);
  ASSERT_TRUE(k.intact() && v.intact());
}

Uints random_keys(std::uint64_t n) {
  std::mt19937 random(seed() + std::uint32_t(n));
  Uints keys(n);
  for (auto& k : keys) k = random();
  return keys;
}

TEST(RadixSort, EverySizeShapeAndWorkGroup) {
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes()) expect_sorted(way, random_keys(n), 32);
}

TEST(RadixSort, OnlyTheLowKeyBitsCount) {
  for (const Way& way : ways())
    for (const unsigned bits : {0u, 1u, 3u, 4u, 5u, 8u, 9u, 12u, 16u, 20u, 24u, 31u, 32u})
      expect_sorted(way, random_keys(5003), bits);
  Device& device = device_for(ways()[0]);
  Array<std::uint32_t> a(device, 4, "a");
  EXPECT_THROW(radix_sort(device, a.buffer(), a.buffer(), 4, 33), UsageError);
}

TEST(RadixSort, EqualSortedAndReversedKeys) {
  for (const Way& way : ways())
    for (const std::uint64_t n : {1000ull, 70001ull}) {
      Uints keys(n, 7);
      expect_sorted(way, keys, 32);
      std::iota(keys.begin(), keys.end(), 0u);
      expect_sorted(way, keys, 32);
      for (auto& k : keys) k = ~k;
      expect_sorted(way, keys, 32);
      for (std::uint64_t i = 0; i < n; ++i) keys[i] = i % 2 ? 0xffffffffu : 0u;
      expect_sorted(way, keys, 32);
    }
}

TEST(RadixSort, NothingLaunchesForNoPairs) {
  Device& device = device_for(ways()[0]);
  device.reset_profile();
  radix_sort(device, cl::Buffer(), cl::Buffer(), 0);
  EXPECT_TRUE(device.profile().empty());
}

TEST(RadixSort, EqualsTheOracleOnAnyInput) {
  EXPECT_TRUE(rc::check("radix_sort", [] {
    const auto keys = *rc::gen::arbitrary<Uints>();
    const unsigned bits = *rc::gen::inRange(1u, 33u);
    for (const Way& way : {ways()[0], ways()[1]})
      if (!keys.empty()) expect_sorted(way, keys, bits);
    RC_ASSERT(!testing::Test::HasFailure());
  }));
}

}  // namespace
}  // namespace clrad
