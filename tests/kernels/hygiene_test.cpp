// Kernels that a solve on one device does not launch, at sizes that oclgrind bears: tests/kernels/oclgrind runs this suite
// for memory errors, races and uninitialised memory. Here only the answers are checked.
#include <gtest/gtest.h>

#include <numeric>

#include "clrad/primitives.hpp"
#include "clrad/visibility.hpp"
#include "device/layout.hpp"
#include "visibility/chop.hpp"
#include "visibility/snap.hpp"

namespace clrad {
namespace {

using Words = std::vector<std::uint32_t>;

class KernelHygiene : public ::testing::TestWithParam<Shape> {
 protected:
  // As in the tests of the primitives, so that kernels are compiled once; oclgrind, which calls itself a GPU, gets a packet
  // width of 1.
  KernelHygiene()
      : device_({.shape = GetParam(), .work_group_size = GetParam() == Shape::trees ? 48u : 64u}) {}

  // More blocks of 4096 than one launch takes, so that sums of blocks are scanned, too; and one that takes a single launch.
  static constexpr std::uint32_t long_size = 20000, short_size = 100;
  static Words ramp(std::uint32_t n) {
    Words values(n);
    for (std::uint32_t i = 0; i < n; ++i) values[i] = i * 7 % 5;
    return values;
  }
  Device device_;
};

TEST_P(KernelHygiene, ScanAllocateAndCompact) {
  for (const std::uint32_t n : {short_size, long_size}) {
    const Words values = ramp(n);
    Words sums(n);
    std::exclusive_scan(values.begin(), values.end(), sums.begin(), 0u);
    const Array<std::uint32_t> in(device_, values, "in");
    Array<std::uint32_t> out(device_, n, "out");
    EXPECT_EQ(scan_uint(device_, Sum::exclusive, in.buffer(), out.buffer(), n), sums.back() + values.back());
    EXPECT_EQ(out.download(), sums);
    const Allocation slots = allocate(device_, in.buffer(), n);
    ASSERT_EQ(slots.total, sums.back() + values.back());
    const Words owner = slots.owner.download(0, slots.total), rank = slots.rank.download(0, slots.total);
    for (std::uint32_t i = 0, at = 0; i < n; ++i)
      for (std::uint32_t k = 0; k < values[i]; ++k, ++at) {
        ASSERT_EQ(owner[at], i);
        ASSERT_EQ(rank[at], k);
      }
    const std::uint32_t kept = compact(device_, in.buffer(), n, out.buffer());
    EXPECT_EQ(kept, n - (n + 4) / 5);
    const Words indices = out.download(0, kept);
    for (std::uint32_t i = 1; i < kept; ++i) ASSERT_GT(indices[i], indices[i - 1]);
  }
}

TEST_P(KernelHygiene, SegmentsReductionsAndSorting) {
  for (const std::uint32_t n : {short_size, long_size}) {
    std::vector<float> values(n);
    Words heads(n), offsets{0}, keys(n), order(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      values[i] = float(i * 37 % 101);  // sums of whole numbers are exact
      heads[i] = i % 10 == 0;
      if (i > 0 && heads[i]) offsets.push_back(i);
      keys[i] = i * 40503 % 65536, order[i] = i;
    }
    offsets.push_back(n);
    const auto segments = std::uint32_t(offsets.size() - 1);
    const Array<float> in(device_, values, "in");
    const Array<std::uint32_t> flags(device_, heads, "heads"), ends(device_, offsets, "offsets");
    Array<float> out(device_, n, "out");
    Array<std::uint32_t> index(device_, n, "index");
    segmented_scan_float(device_, Op::sum, in.buffer(), flags.buffer(), out.buffer(), n);
    EXPECT_EQ(out.at(0), values[0]);
    EXPECT_EQ(out.at(9), std::accumulate(values.begin(), values.begin() + 10, 0.0f));
    scan_float(device_, Sum::inclusive, in.buffer(), out.buffer(), n);
    EXPECT_EQ(out.at(n - 1), std::accumulate(values.begin(), values.end(), 0.0f));
    segmented_reduce_sum(device_, in.buffer(), ends.buffer(), out.buffer(), segments);
    EXPECT_EQ(out.at(0), std::accumulate(values.begin(), values.begin() + 10, 0.0f));
    segmented_reduce_min(device_, in.buffer(), ends.buffer(), out.buffer(), index.buffer(), segments);
    EXPECT_EQ(out.at(0), 0);
    EXPECT_EQ(index.at(0), 0u);
    EXPECT_EQ(reduce_sum_float(device_, in.buffer(), n), std::accumulate(values.begin(), values.end(), 0.0));
    const ArgMax most = argmax_float(device_, in.buffer(), n);
    EXPECT_EQ(most.value, *std::max_element(values.begin(), values.end()));
    EXPECT_EQ(most.index, std::max_element(values.begin(), values.end()) - values.begin());
    const Array<std::uint32_t> sorted(device_, keys, "keys"), carried(device_, order, "values");
    radix_sort(device_, sorted.buffer(), carried.buffer(), n, 16);
    const Words by_key = sorted.download();
    EXPECT_TRUE(std::is_sorted(by_key.begin(), by_key.end()));
    EXPECT_EQ(carried.at(0), 0u);
  }
}

TEST_P(KernelHygiene, SegmentedScansOfEachKind) {
  const Words values = ramp(long_size);
  Words heads(long_size);
  for (std::uint32_t i = 0; i < long_size; ++i) heads[i] = i % 10 == 0;
  const Array<std::uint32_t> in(device_, values, "in"), flags(device_, heads, "heads");
  const Array<float> floats(device_, std::vector<float>(values.begin(), values.end()), "in");
  Array<std::uint32_t> out(device_, long_size, "out");
  Array<float> real(device_, long_size, "out");
  segmented_copy(device_, in.buffer(), flags.buffer(), out.buffer(), long_size);
  EXPECT_EQ(out.at(long_size - 1), values[long_size - 10]);
  // The last segment's ten values are 0 to 4, twice.
  for (const auto& [op, last] : {std::pair{Op::sum, 20u}, {Op::min, 0u}, {Op::max, 4u}}) {
    segmented_scan_uint(device_, op, in.buffer(), flags.buffer(), out.buffer(), long_size);
    EXPECT_EQ(out.at(long_size - 1), last);
    segmented_scan_float(device_, op, floats.buffer(), flags.buffer(), real.buffer(), long_size);
    EXPECT_EQ(real.at(long_size - 1), float(last));
  }
}

// Flags of the receivers that are nearer to a patch's box than the reach stay; solves need it only where memory is short.
TEST(KernelHygieneOf, ReceiversNearAPatch) {
  Device device({.work_group_size = 64});
  std::vector<Point> points;
  for (int i = 0; i < 5; ++i) points.push_back({{0.2 * i, 0.0, 0.1}, {0, 0, 1}});
  const PointArray receivers(device, points, "receivers");
  // The second box is 0 to 0.1 along each axis, so the receivers are 0, 0.1, 0.3, 0.5 and 0.7 from it.
  const RealArray boxes(device, std::vector<double>{9, 9, 9, 9, 9, 9, 0, 0, 0, 0.1, 0.1, 0.1}, "patch boxes");
  Array<std::uint32_t> flags(device, Words{1, 1, 0, 1}, "flags");
  device.run("solve/near_field.cl", "keep_near", 4, receivers, boxes, 1u, Real{0.4}, flags, 1u, 4u);
  EXPECT_EQ(flags.download(), (Words{1, 1, 0, 0}));
}

// Many small triangles in rows, and rays that thread them: enough triangles for `serial` to divide, and waves for `chop`.
TEST(KernelHygieneOf, EnginesAndThePredicate) {
  Device device({.work_group_size = 64});
  std::vector<OccluderTriangle> triangles;
  for (int i = 0; i < 640; ++i) {
    const double x = -0.9 + 0.1 * (i % 18), y = -0.9 + 0.05 * (i / 18), z = 0.003 * (i % 7);
    triangles.push_back(
        {{{x, y, z}, {x + 0.06, y, z}, {x, y + 0.03, z + 0.01}}, std::uint32_t(i), std::uint32_t(i)});
  }
  std::vector<Point> from, to;
  for (int i = 0; i < 5; ++i) from.push_back({{-0.87 + 0.31 * i, -0.9 + 0.3 * i, -0.9}, {0, 0, 1}});
  for (int i = 0; i < 6; ++i) to.push_back({{0.9 - 0.2 * i, -0.8 + 0.25 * i, 0.9}, {0, 0, -1}});
  const PointArray origins(device, from, "origins"), targets(device, to, "targets");
  const auto serial = make_engine("serial", device, triangles);
  const auto chop = make_chop(device, triangles, {.cells = {4, 4, 2}, .slab = 1});
  for (const std::uint32_t samples : {0u, 2u, 6u}) {
    const Segments segments{.origins = &origins, .origin_count = 5, .targets = &targets, .samples = samples};
    Array<std::uint32_t> one(device, 5, "masks"), other(device, 5, "masks");
    serial->occluded(segments, one);
    chop->occluded(segments, other);
    EXPECT_EQ(one.download(), other.download()) << samples;
    const std::uint64_t n = segments.count();
    Array<std::uint32_t> first(device, n, "nearest"), second(device, n, "nearest");
    Array<float> t(device, n, "t"), s(device, n, "t");
    serial->intersect_closest(segments, first, t);
    chop->intersect_closest(segments, second, s);
    EXPECT_EQ(first.download(), second.download()) << samples;
    EXPECT_EQ(t.download(), s.download()) << samples;
  }
  std::vector<clrad_triangle> snapped(5);
  std::vector<clrad_facet> facets(5);
  for (std::size_t i = 0; i < 5; ++i) ASSERT_TRUE(snap_triangle(triangles[i], snapped[i], facets[i]));
  const Array<clrad_triangle> pair_triangles(device, snapped, "triangles");
  const Array<clrad_facet> pair_facets(device, facets, "facets");
  const Array<std::uint32_t> verdicts(device, 5, "verdicts");
  const Array<float> where(device, 5, "t");
  device.run("visibility/predicate.cl", "predicate_pairs", 5, origins, targets, 5u, pair_triangles,
             pair_facets, verdicts, where);
  for (const std::uint32_t v : verdicts.download()) EXPECT_LE(v, 7u);
}

TEST(KernelHygieneOf, ThePeak) {
  Device device({.work_group_size = 64});
  Array<float> sums(device, std::vector<float>(6, -1), "sums");
  device.run("device/peak.cl", "peak", 6, 5u, 2u, 0.5f, 1.0f, sums);
  // Twelve chains from i on: x / 4 + 3 / 2 of each.
  EXPECT_EQ(sums.download(), (std::vector<float>{34.5, 37.5, 40.5, 43.5, 46.5, -1}));
}

TEST(KernelHygieneOf, Layouts) {
  Device device({.work_group_size = 64});
  const auto expected = host_layout(false);
  const Array<std::uint32_t> out(device, expected.size(), "layout");
  const Array<clrad_point_float> points(device, std::vector<clrad_point_float>(1), "points");
  const Array<clrad_triangle> triangles(device, std::vector<clrad_triangle>(1), "triangles");
  device.run("device/layout.cl", "layout", 1, out, points, triangles);
  EXPECT_EQ(out.download(), expected);
}

INSTANTIATE_TEST_SUITE_P(BothShapes, KernelHygiene, ::testing::Values(Shape::blocks, Shape::trees),
                         [](const auto& way) { return way.param == Shape::trees ? "Trees" : "Blocks"; });

}  // namespace
}  // namespace clrad
