#include <rapidcheck.h>

#include <cmath>
#include <limits>

#include "primitives/support.hpp"

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;
using Floats = std::vector<float>;

std::uint32_t combine(Op op, std::uint32_t a, std::uint32_t b) {
  if (op == Op::sum) return std::uint32_t(std::min<std::uint64_t>(0xffffffffu, std::uint64_t(a) + b));
  return op == Op::min ? std::min(a, b) : std::max(a, b);
}
float combine(Op op, float a, float b) {
  if (op == Op::sum) return a + b;
  if (std::isnan(a)) return b;
  return op == Op::min ? (b < a ? b : a) : (b > a ? b : a);
}

/// min, max and sums of uint are associative: the plain loop.
template <class T>
std::vector<T> plain_oracle(Op op, const std::vector<T>& in, const Uints& heads) {
  std::vector<T> out(in.size());
  for (std::size_t i = 0; i < in.size(); ++i)
    out[i] = i == 0 || heads[i] ? in[i] : combine(op, out[i - 1], in[i]);
  return out;
}

/// Float sums in the documented order, from its definition: spans (value, head seen) combined row, block,
/// level.
struct Span {
  float value;
  bool head;
};
Span join(Span a, Span b) {
  return {b.head ? b.value : a.value + b.value, a.head || b.head};
}

std::vector<Span> ordered_oracle(const std::vector<Span>& in) {
  std::vector<Span> out = in, totals;
  for (std::size_t block = 0; block < in.size(); block += 1024) {
    const std::size_t block_end = std::min(in.size(), block + 1024);
    for (std::size_t row = block; row < block_end; row += 16) {
      const std::size_t row_end = std::min(in.size(), row + 16);
      for (std::size_t d = 1; d < 16; d *= 2)
        for (std::size_t i = row_end; i-- > row + d;)
          out[i] = join(out[i - d], out[i]);  // downwards: old values below
      if (row > block)
        for (std::size_t i = row; i < row_end; ++i) out[i] = join(out[row - 1], out[i]);
    }
    totals.push_back(out[block_end - 1]);
  }
  if (totals.size() > 1) {
    totals = ordered_oracle(totals);
    for (std::size_t i = 1024; i < in.size(); ++i) out[i] = join(totals[i / 1024 - 1], out[i]);
  }
  return out;
}

Floats sum_oracle(const Floats& in, const Uints& heads) {
  std::vector<Span> spans(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) spans[i] = {in[i], heads[i] != 0};
  Floats out(in.size());
  spans = ordered_oracle(spans);
  for (std::size_t i = 0; i < in.size(); ++i) out[i] = spans[i].value;
  return out;
}

/// Bits, NaNs taken as equal.
bool same(const Floats& a, const Floats& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(std::isnan(a[i]) && std::isnan(b[i])) && bits_of({a[i]}) != bits_of({b[i]})) {
      ADD_FAILURE() << "at " << i << ": " << a[i] << " instead of " << b[i];
      return false;
    }
  return a.size() == b.size();
}

void expect_uint(const Way& way, const Uints& in, const Uints& heads) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << in.size());
  Device& device = device_for(way);
  const Array<std::uint32_t> from(device, std::span<const std::uint32_t>(in), "in");
  const Array<std::uint32_t> marks(device, std::span<const std::uint32_t>(heads), "heads");
  Guarded<std::uint32_t> out(device, in.size());
  for (const Op op : {Op::sum, Op::min, Op::max}) {
    segmented_scan_uint(device, op, from.buffer(), marks.buffer(), out, in.size());
    ASSERT_TRUE(out.values() == plain_oracle(op, in, heads)) << "operator " << int(op);
    ASSERT_TRUE(out.intact());
  }
  segmented_copy(device, from.buffer(), marks.buffer(), out, in.size());
  Uints copied = in;
  for (std::size_t i = 1; i < in.size(); ++i)
    if (!heads[i]) copied[i] = copied[i - 1];
  ASSERT_TRUE(out.values() == copied);
  ASSERT_TRUE(out.intact());
  segmented_copy(device, from.buffer(), marks.buffer(), from.buffer(), in.size());  // in place
  ASSERT_TRUE(from.download() == copied);
}

void expect_float(const Way& way, const Floats& in, const Uints& heads) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << in.size());
  Device& device = device_for(way);
  const Array<float> from(device, std::span<const float>(in), "in");
  const Array<std::uint32_t> marks(device, std::span<const std::uint32_t>(heads), "heads");
  Guarded<float> out(device, in.size());
  for (const Op op : {Op::min, Op::max, Op::sum}) {
    const Floats want = op == Op::sum ? sum_oracle(in, heads) : plain_oracle(op, in, heads);
    segmented_scan_float(device, op, from.buffer(), marks.buffer(), out, in.size());
    ASSERT_TRUE(same(out.values(), want)) << "operator " << int(op);
    ASSERT_TRUE(out.intact());
    const auto first = bits_of(out.values());
    segmented_scan_float(device, op, from.buffer(), marks.buffer(), out, in.size());
    ASSERT_TRUE(bits_of(out.values()) == first);  // a second run: also the payload of NaNs
  }
  segmented_scan_float(device, Op::sum, from.buffer(), marks.buffer(), from.buffer(), in.size());  // in place
  ASSERT_TRUE(same(from.download(), sum_oracle(in, heads)));
}

Uints random_heads(std::uint64_t n, unsigned one_in, std::mt19937& random) {
  Uints heads(n);
  for (auto& h : heads) h = random() % one_in == 0 ? random() | 1 : 0;
  return heads;
}

Uints random_uints(std::uint64_t n, std::mt19937& random) {
  Uints values(n);
  for (auto& v : values)
    v = random() % 64 == 0 ? random() : random() % 1000;  // large ones: sums saturate now and then
  return values;
}

Floats floats_of_any_size(std::uint64_t n, std::mt19937& random, bool special) {
  Floats values(n);
  for (auto& v : values) {
    v = float(int(random() % 20001) - 10000) * 1.1f;
    if (special && random() % 50 == 0) {
      const float specials[] = {0.0f,
                                -0.0f,
                                std::numeric_limits<float>::infinity(),
                                -std::numeric_limits<float>::infinity(),
                                std::numeric_limits<float>::quiet_NaN(),
                                std::numeric_limits<float>::denorm_min()};
      v = specials[random() % 6];
    }
  }
  return values;
}

TEST(SegmentedScan, UintEverySizeShapeAndWorkGroup) {
  std::mt19937 random(seed());
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes())
      expect_uint(way, random_uints(n, random), random_heads(n, n % 2 ? 7 : 1500, random));
}

TEST(SegmentedScan, FloatEverySizeShapeAndWorkGroup) {
  std::mt19937 random(seed());
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes())
      expect_float(way, floats_of_any_size(n, random, n % 3 == 0), random_heads(n, n % 2 ? 7 : 1500, random));
}

// No head at all (element 0 counts as one), all heads, the last element only, and one at each limit of the
// structure.
TEST(SegmentedScan, HeadsInSpecialPlaces) {
  std::mt19937 random(seed());
  for (const Way& way : ways())
    for (const std::uint64_t n : {17ull, 1025ull, 5000ull, 70001ull}) {
      const Uints in = random_uints(n, random);
      const Floats floats = floats_of_any_size(n, random, false);
      std::vector<Uints> cases{Uints(n, 0), Uints(n, 1)};
      for (const std::uint64_t at : {n - 1, std::uint64_t(15), std::uint64_t(16), std::uint64_t(1023),
                                     std::uint64_t(1024), std::uint64_t(65536)}) {
        if (at >= n) continue;
        cases.emplace_back(n, 0);
        cases.back()[at] = 0x80000000u;
      }
      for (const Uints& heads : cases) {
        expect_uint(way, in, heads);
        expect_float(way, floats, heads);
      }
    }
}

TEST(SegmentedScan, NothingLaunchesForNoValues) {
  Device& device = device_for(ways()[0]);
  device.reset_profile();
  segmented_scan_uint(device, Op::sum, cl::Buffer(), cl::Buffer(), cl::Buffer(), 0);
  segmented_scan_float(device, Op::min, cl::Buffer(), cl::Buffer(), cl::Buffer(), 0);
  segmented_copy(device, cl::Buffer(), cl::Buffer(), cl::Buffer(), 0);
  scan_float(device, Sum::inclusive, cl::Buffer(), cl::Buffer(), 0);
  EXPECT_TRUE(device.profile().empty());
}

TEST(SegmentedScan, EqualsTheOracleOnAnyInput) {
  rc::check("segmented_scan", [] {
    const auto in = *rc::gen::arbitrary<Uints>();
    if (in.empty()) return;
    const auto heads = *rc::gen::container<Uints>(in.size(), rc::gen::inRange(0u, 2u));
    const auto floats = *rc::gen::container<Floats>(in.size(), rc::gen::arbitrary<float>());
    for (const Way& way : {ways()[0], ways()[1]}) {
      expect_uint(way, in, heads);
      expect_float(way, floats, heads);
    }
    RC_ASSERT(!testing::Test::HasFailure());
  });
}

/// out[i] of an exclusive scan in the documented order: what lies before the block, plus the inclusive sum up
/// to i - 1 within it.
Floats exclusive_oracle(const Floats& in) {
  const std::size_t n = in.size();
  std::vector<Span> totals;
  Floats out(n);
  std::vector<Floats> within;
  for (std::size_t block = 0; block < n; block += 1024) {
    const Floats part(in.begin() + std::ptrdiff_t(block),
                      in.begin() + std::ptrdiff_t(std::min(n, block + 1024)));
    within.push_back(sum_oracle(part, Uints(part.size(), 0)));
    totals.push_back({within.back().back(), false});
  }
  totals = ordered_oracle(totals);
  for (std::size_t i = 1; i < n; ++i) {
    const std::size_t b = i / 1024, k = i % 1024;
    if (b == 0)
      out[i] = within[0][k - 1];
    else
      out[i] = k == 0 ? totals[b - 1].value : totals[b - 1].value + within[b][k - 1];
  }
  return out;
}

TEST(ScanFloat, EverySizeShapeAndWorkGroup) {
  std::mt19937 random(seed());
  for (const std::uint64_t n : sizes()) {
    const Floats in = floats_of_any_size(n, random, n % 5 == 0);
    const Floats inclusive = sum_oracle(in, Uints(n, 0)), exclusive = exclusive_oracle(in);
    for (const Way& way : ways()) {
      SCOPED_TRACE(testing::Message() << way << ", n = " << n);
      Device& device = device_for(way);
      const Array<float> from(device, std::span<const float>(in), "in");
      Guarded<float> out(device, n);
      scan_float(device, Sum::inclusive, from.buffer(), out, n);
      ASSERT_TRUE(same(out.values(), inclusive));
      scan_float(device, Sum::exclusive, from.buffer(), out, n);
      ASSERT_TRUE(same(out.values(), exclusive));
      ASSERT_TRUE(out.intact());
      scan_float(device, Sum::exclusive, from.buffer(), from.buffer(), n);
      ASSERT_TRUE(same(from.download(), exclusive));
    }
  }
}

}  // namespace
}  // namespace clrad
