/// Devices of both shapes and several work-group sizes, random data with a printed seed, and canaries.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "clrad/primitives.hpp"

namespace clrad::test {

struct Way {
  Shape shape;
  unsigned group;
};

inline std::ostream& operator<<(std::ostream& out, const Way& way) {
  return out << (way.shape == Shape::trees ? "trees" : "blocks") << " of " << way.group;
}

/// Both shapes; the work-group size matters to trees. 48: less than the 64 rows of a block of 1024, and no
/// power of two.
inline std::vector<Way> ways() {
  return {{Shape::blocks, 64}, {Shape::trees, 48}, {Shape::trees, 128}};
}

/// Kept from test to test, so that kernels are built once.
inline Device& device_for(const Way& way) {
  static std::map<std::pair<int, unsigned>, std::unique_ptr<Device>> devices;
  auto& device = devices[{int(way.shape), way.group}];
  if (!device) {
    DeviceOptions options;
    options.shape = way.shape;
    options.work_group_size = way.group;
    device = std::make_unique<Device>(options);
  }
  return *device;
}

inline std::uint32_t seed() {
  static const std::uint32_t value = [] {
    const char* given = std::getenv("CLRAD_TEST_SEED");
    const std::uint32_t s = given ? std::uint32_t(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    printf("seed: CLRAD_TEST_SEED=%u\n", s);
    return s;
  }();
  return value;
}

/// Around every limit at which the code takes another path: rows of 16, work-groups, blocks of 1024 and 4096,
/// tiles.
inline std::vector<std::uint64_t> sizes() {
  return {1,    2,    15,   16,    17,    31,    33,    47,    48,    49,     63,     64,     65,
          127,  128,  129,  255,   256,   257,   767,   769,   1023,  1024,   1025,   4095,   4096,
          4097, 8191, 8193, 16383, 16384, 16385, 16387, 65535, 65537, 131071, 131073, 1000003};
}

/// An output longer than it has to be; `intact` tells whether what lies past it is as it was.
template <class T>
struct Guarded {
  static constexpr std::uint64_t margin = 37;
  static constexpr std::uint32_t canary = 0xdeadbeefu;
  std::uint64_t count;
  Array<T> array;
  Guarded(Device& device, std::uint64_t n) : count(n), array(device, n + margin, "test output") {
    device.fill_bytes(array.buffer(), canary, array.bytes());
  }
  std::vector<T> values() const { return array.download(0, count); }
  bool intact() const {
    const auto tail = array.download(count, margin);
    for (const T& t : tail) {
      std::uint32_t bits;
      static_assert(sizeof(T) == 4);
      std::memcpy(&bits, &t, 4);
      if (bits != canary) return false;
    }
    return true;
  }
  operator const cl::Buffer&() const { return array.buffer(); }
};

inline std::vector<std::uint32_t> bits_of(const std::vector<float>& values) {
  std::vector<std::uint32_t> bits(values.size());
  if (!values.empty()) std::memcpy(bits.data(), values.data(), values.size() * 4);
  return bits;
}

}  // namespace clrad::test
