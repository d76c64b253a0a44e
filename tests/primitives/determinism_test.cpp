#include <numeric>

#include "device/divided.hpp"

#include "primitives/support.hpp"

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;

/// Bits of everything whose order of operations could show.
struct Answers {
  Uints scan, segmented, segment_sums, owner, sorted;
  double sum;
  bool operator==(const Answers&) const = default;
};

Answers answers(const DeviceOptions& options) {
  Device device(options);
  std::mt19937 random(7);  // a fixed input: the runs must agree with each other
  const std::uint64_t n = 100003;
  std::vector<float> values(n);
  for (auto& v : values) v = float(int(random() % 20001) - 10000) * 1.1f;
  Uints heads(n), counts(n), positions(n), offsets{0};
  for (auto& h : heads) h = random() % 1500 == 0;
  for (auto& c : counts) c = random() % 4;
  std::iota(positions.begin(), positions.end(), 0u);
  for (std::uint32_t i = 0; i < n; ++i)
    if (heads[i]) offsets.push_back(i);
  offsets.push_back(std::uint32_t(n));
  const std::uint64_t segments = offsets.size() - 1;

  const Array<float> in(device, std::span<const float>(values), "values"), out(device, n, "out");
  const Array<std::uint32_t> marks(device, std::span<const std::uint32_t>(heads), "heads"),
      wanted(device, std::span<const std::uint32_t>(counts), "counts"),
      places(device, std::span<const std::uint32_t>(positions), "positions"),
      limits(device, std::span<const std::uint32_t>(offsets), "offsets");
  Answers a;
  scan_float(device, Sum::inclusive, in.buffer(), out.buffer(), n);
  a.scan = bits_of(out.download());
  segmented_scan_float(device, Op::sum, in.buffer(), marks.buffer(), out.buffer(), n);
  a.segmented = bits_of(out.download());
  segmented_reduce_sum(device, in.buffer(), limits.buffer(), out.buffer(), segments);
  a.segment_sums = bits_of(out.download(0, segments));
  a.owner = allocate(device, wanted.buffer(), n).owner.download();
  radix_sort(device, wanted.buffer(), places.buffer(), n, 2);
  a.sorted = places.download();
  a.sum = reduce_sum_float(device, in.buffer(), n);
  return a;
}

// One core and all of them, both shapes, work-groups of 1, 32 and 64: the same bits.
TEST(Primitives, SameBitsOnOneCoreInBothShapesAndAnyWorkGroup) {
  DeviceOptions options;
  options.shape = Shape::blocks;
  const Answers want = answers(options);
  EXPECT_TRUE(answers(options) == want) << "a second run";
  options.cores = test::one_core();
  EXPECT_TRUE(answers(options) == want) << "one core";
  options.cores = 0;
  options.shape = Shape::trees;
  for (const unsigned group : {1u, 32u}) {
    options.work_group_size = group;
    EXPECT_TRUE(answers(options) == want) << "trees of " << group;
  }
}

}  // namespace
}  // namespace clrad
