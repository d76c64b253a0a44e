/// What the primitives share: checks of their arguments, and scratch that a device keeps between calls.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "clrad/device.hpp"

namespace clrad::primitives {

/// Most elements a primitive takes: positions fit 32 bits, and CLRAD_NONE stays free.
constexpr std::uint64_t most_elements = 0xffffffffu;

/// Throws UsageError when n is too large.
void check_count(std::string_view primitive, std::uint64_t n);
/// Throws UsageError when `buffer` is null or shorter than `count` values of 4 bytes.
void check_buffer(std::string_view primitive, std::string_view argument, const cl::Buffer& buffer,
                  std::uint64_t count);
/// Throws UsageError when `total` is past 32 bits.
std::uint32_t check_total(std::string_view primitive, std::uint64_t total);

/// Makes `array` at least `count` long: exactly so at first, an eighth more when it has to grow (contents are
/// lost).
template <class T>
void grow(Device& device, Array<T>& array, std::uint64_t count, std::string_view what) {
  if (array.buffer()() && array.size() >= count) return;
  const std::uint64_t room = array.size() == 0 ? count : count + count / 8;
  array = Array<T>();  // first: the budget need not hold both
  array = Array<T>(device, room, what);
}

/// Block totals of one level of a segmented scan, bits of uint or float.
struct SegmentLevel {
  Array<std::uint32_t> totals, heads;
};

/// What a device keeps between calls (Device::kept). In-order queues make sharing safe.
struct Scratch {
  Array<std::uint64_t> block_sums;
  Array<float> block_values, block_float_sums;
  Array<std::uint32_t> block_indices;
  Array<std::uint32_t> sort_keys, sort_values, sort_counts;
  std::array<SegmentLevel, 4> levels;  ///< blocks of 1024: 2^32 values have 2^22, 2^12, 4 totals
};
inline Array<std::uint64_t>& scan_scratch(Device& device) {
  return device.kept<Scratch>().block_sums;
}

/// How one scan over n values is cut into blocks (kernels/primitives/scan.cl).
struct Blocks {
  std::uint64_t length = 0;
  std::uint32_t count = 0;
  unsigned local = 0;           ///< work-items per block
  std::uint32_t at_a_time = 0;  ///< blocks that go through all passes while they are in the cache

  std::uint64_t items(std::uint32_t block_count) const { return std::uint64_t(block_count) * local; }
  std::uint64_t items() const { return items(count); }
};
Blocks cut_blocks(const Device& device, std::uint64_t n);

inline bool trees(const Device& device) {
  return device.options().shape == Shape::trees;
}

/// `mode` bits of kernels/primitives/scan.cl.
constexpr std::uint32_t scan_inclusive = 1, scan_flags = 2, scan_append = 4;

/// The kept array of block sums, long enough for `blocks`.
Array<std::uint64_t>& grown_block_sums(Device& device, const Blocks& blocks);
/// Sums up to each of the blocks [first, last): sums[b] is what comes before block b, sums[blocks.count] the
/// total. Ranges are taken in ascending order, the first from 0.
void scan_block_sums(Device& device, const cl::Buffer& in, std::uint64_t n, const Blocks& blocks,
                     std::uint32_t first, std::uint32_t last, std::uint32_t mode, Array<std::uint64_t>& sums);
/// All passes of a scan; returns where in scan_scratch() the total (ulong) lies.
std::uint64_t scan_passes(Device& device, const cl::Buffer& in, const cl::Buffer& out, std::uint64_t n,
                          std::uint32_t mode);
std::uint64_t read_total(Device& device, std::uint64_t at);

}  // namespace clrad::primitives
