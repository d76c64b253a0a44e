#include "primitives/support.hpp"

#include <rapidcheck.h>

namespace clrad {
namespace {

using namespace test;
using Uints = std::vector<std::uint32_t>;

struct Scanned {
  Uints values;
  std::uint64_t total;
};

Scanned oracle(Sum kind, const Uints& in) {
  Scanned s{Uints(in.size()), 0};
  for (std::size_t i = 0; i < in.size(); ++i) {
    if (kind == Sum::exclusive) s.values[i] = std::uint32_t(s.total);
    s.total += in[i];
    if (kind == Sum::inclusive) s.values[i] = std::uint32_t(s.total);
  }
  return s;
}

Uints random_values(std::uint64_t n, std::uint32_t most) {
  std::mt19937 random(seed() + std::uint32_t(n));
  Uints values(n);
  for (auto& v : values) v = most ? random() % (most + 1) : 0;
  return values;
}

void expect_scan(const Way& way, Sum kind, const Uints& in) {
  SCOPED_TRACE(testing::Message() << way << ", n = " << in.size()
                                  << (kind == Sum::inclusive ? ", inclusive" : ", exclusive"));
  Device& device = device_for(way);
  const Scanned want = oracle(kind, in);
  Array<std::uint32_t> from(device, std::span<const std::uint32_t>(in), "in");
  Guarded<std::uint32_t> out(device, in.size());
  ASSERT_EQ(scan_uint(device, kind, from.buffer(), out, in.size()), want.total);
  ASSERT_TRUE(out.values() == want.values);
  ASSERT_TRUE(out.intact());
  ASSERT_TRUE(from.download() == in);
  // In place, and without a host read.
  Array<std::uint32_t> total(device, 2, "total");
  scan_uint_on_device(device, kind, from.buffer(), from.buffer(), in.size(), total.buffer());
  ASSERT_TRUE(from.download() == want.values);
  ASSERT_EQ(total.at(0) | std::uint64_t(total.at(1)) << 32, want.total);
}

TEST(Scan, EverySizeShapeAndWorkGroup) {
  for (const Way& way : ways())
    for (const std::uint64_t n : sizes())
      for (const Sum kind : {Sum::exclusive, Sum::inclusive}) expect_scan(way, kind, random_values(n, 4000));
}

TEST(Scan, NothingLaunchesForNoValues) {
  for (const Way& way : ways()) {
    Device& device = device_for(way);
    device.reset_profile();
    EXPECT_EQ(scan_uint(device, Sum::exclusive, cl::Buffer(), cl::Buffer(), 0), 0u);
    EXPECT_TRUE(device.profile().empty());
  }
}

TEST(Scan, ShortArraysTakeOneLaunch) {
  for (const Way& way : ways()) {
    Device& device = device_for(way);
    Array<std::uint32_t> values(device, 3000, "values");
    values.fill_zero();
    device.reset_profile();
    scan_uint(device, Sum::exclusive, values.buffer(), values.buffer(), 3000);
    ASSERT_EQ(device.profile().size(), 1u);
    EXPECT_EQ(device.profile()[0].launches, 1u);
  }
}

// The largest total that fits, and the first that does not: as one value, as the last carry, and spread over
// blocks.
TEST(Scan, TotalsPast32BitsThrowAndLeaveTheDeviceUsable) {
  for (const Way& way : ways()) {
    SCOPED_TRACE(testing::Message() << way);
    Device& device = device_for(way);
    for (const std::uint64_t n : {2ull, 3000ull, 100000ull, 1000003ull}) {
      Uints in(n, 0);
      in[0] = 0xffffffffu;
      expect_scan(way, Sum::inclusive, in);
      in[n - 1] = 1;
      Array<std::uint32_t> from(device, std::span<const std::uint32_t>(in), "in");
      Guarded<std::uint32_t> out(device, n);
      EXPECT_THROW(scan_uint(device, Sum::exclusive, from.buffer(), out, n), UsageError);
      EXPECT_TRUE(out.intact());
    }
    const Uints many(1u << 17, 0xffffffffu);  // wraps within every block; 2^49 - 2^17 in all
    Array<std::uint32_t> from(device, std::span<const std::uint32_t>(many), "in");
    EXPECT_THROW(scan_uint(device, Sum::exclusive, from.buffer(), from.buffer(), many.size()), UsageError);
    expect_scan(way, Sum::exclusive, random_values(100000, 9));
  }
}

TEST(Scan, BuffersThatAreTooShortAreRefused) {
  Device& device = device_for(ways()[0]);
  Array<std::uint32_t> small(device, 100, "small"), large(device, 200, "large");
  EXPECT_THROW(scan_uint(device, Sum::exclusive, small.buffer(), large.buffer(), 101), UsageError);
  EXPECT_THROW(scan_uint(device, Sum::exclusive, large.buffer(), small.buffer(), 101), UsageError);
  EXPECT_THROW(scan_uint(device, Sum::exclusive, cl::Buffer(), small.buffer(), 1), UsageError);
}

TEST(Scan, MoreValuesThanPositionsFitIn32BitsAreRefused) {
  Device& device = device_for(ways()[0]);
  EXPECT_THROW(scan_uint(device, Sum::exclusive, cl::Buffer(), cl::Buffer(), std::uint64_t(1) << 32),
               UsageError);
  EXPECT_THROW(compact(device, cl::Buffer(), std::uint64_t(1) << 32, cl::Buffer()), UsageError);
  EXPECT_THROW(scan_float(device, Sum::exclusive, cl::Buffer(), cl::Buffer(), std::uint64_t(1) << 32),
               UsageError);
}

// Longer than what goes through the cache at a time, so that sums carry from one range of blocks to the next.
TEST(Scan, SeveralRangesOfBlocks) {
  for (const Way& way : ways()) expect_scan(way, Sum::exclusive, random_values(5000011, 800));
}

TEST(Scan, EqualsTheOracleOnAnyInput) {
  EXPECT_TRUE(rc::check("scan_uint", [] {
    const auto in = *rc::gen::container<Uints>(rc::gen::inRange(0u, 1000u));
    if (in.empty()) return;
    for (const Way& way : {ways()[0], ways()[1]}) {
      Device& device = device_for(way);
      Array<std::uint32_t> values(device, std::span<const std::uint32_t>(in), "in");
      const Scanned want = oracle(Sum::exclusive, in);
      RC_ASSERT(scan_uint(device, Sum::exclusive, values.buffer(), values.buffer(), in.size()) == want.total);
      RC_ASSERT(values.download() == want.values);
    }
  }));
}

// As a host application would: its own context, queue and buffers, the library on top.
TEST(Scan, OnAHostApplicationsOwnContextQueueAndBuffers) {
  std::vector<cl::Platform> platforms;
  cl::Platform::get(&platforms);
  std::vector<cl::Device> found;
  platforms.at(0).getDevices(CL_DEVICE_TYPE_ALL, &found);
  const cl::Context context(found.at(0));
  const cl::CommandQueue queue(context, found[0]);
  for (const std::uint64_t n : {1000ull, 100001ull}) {
    Uints values = random_values(n, 100);
    const Scanned want = oracle(Sum::inclusive, values);
    const cl::Buffer buffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, n * 4, values.data());
    {
      Device device(context, found[0], queue);
      EXPECT_EQ(scan_uint(device, Sum::inclusive, buffer, buffer, n), want.total);
    }
    queue.enqueueReadBuffer(buffer, CL_TRUE, 0, n * 4, values.data());
    EXPECT_TRUE(values == want.values);
  }
}

TEST(Scan, ScratchIsKeptBetweenCallsAndCanBeGivenBack) {
  Device device{DeviceOptions{}};
  Array<std::uint32_t> values(device, 100000, "values");
  values.fill_zero();
  const auto before = device.ledger()->held;
  scan_uint(device, Sum::exclusive, values.buffer(), values.buffer(), 100000);
  const auto with_scratch = device.ledger()->held;
  EXPECT_GT(with_scratch, before);
  scan_uint(device, Sum::exclusive, values.buffer(), values.buffer(), 100000);
  EXPECT_EQ(device.ledger()->held, with_scratch);
  release_primitive_scratch(device);
  EXPECT_EQ(device.ledger()->held, before);
}

}  // namespace
}  // namespace clrad
