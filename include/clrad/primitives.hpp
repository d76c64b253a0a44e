/// Data-parallel primitives on device buffers, usable on their own: scan, segmented scan and reduce, processor
/// allocation, compaction, radix sort (Blelloch, "Vector Models for Data-Parallel Computing", 1990; section 1.3.2 of
/// Drucker & Schroeder). Results are bit-identical whatever the work-group size, the shape or the number of cores
/// (the payload of a NaN apart). n = 0 launches nothing. Buffers that are too short, and n past 2^32 - 1, throw UsageError.
#pragma once
#include <cstdint>

#include "clrad/device.hpp"

namespace clrad {

enum class Sum { exclusive, inclusive };
enum class Op { sum, min, max };

/// Prefix sums of n values. in and out may be the same buffer. Returns the total. Throws UsageError when the total does
/// not fit 32 bits.
std::uint32_t scan_uint(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out,
                        std::uint64_t n);
/// The same with nothing read by the host: total gets the sum as a ulong (8 bytes), which the caller checks when it suits.
void scan_uint_on_device(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out,
                         std::uint64_t n, const cl::Buffer& total);
/// Float sums in a fixed order (kernels/primitives/segmented.cl): rows of 16 by the scan of Hillis & Steele, the 64 rows
/// of a block of 1024 from left to right, blocks by the same again. in and out may be the same buffer. out[0] of an
/// exclusive scan is 0.
void scan_float(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out, std::uint64_t n);

/// Inclusive scans that start anew at every head (heads[i] != 0; element 0 is a head whatever heads[0] says). in and out
/// may be the same buffer. Float sums keep the order of scan_float, which depends on positions, not on where segments
/// start. Sums of uint past 32 bits stay at 0xffffffff, since no host reads them. min and max: NaN never wins over a
/// number, of equal values (-0 and +0) the first is kept.
void segmented_scan_uint(Device&, Op, const cl::Buffer& in, const cl::Buffer& heads, const cl::Buffer& out,
                         std::uint64_t n);
void segmented_scan_float(Device&, Op, const cl::Buffer& in, const cl::Buffer& heads, const cl::Buffer& out,
                          std::uint64_t n);
/// Copies the value at each head over its segment (32-bit values of any kind).
void segmented_copy(Device&, const cl::Buffer& in, const cl::Buffer& heads, const cl::Buffer& out,
                    std::uint64_t n);

/// One result per segment [offsets[s], offsets[s+1]), s < segments (offsets holds segments + 1 values). Empty segments
/// give 0 for sum, +inf for min. For min, `index` gets the lowest position that attains it (CLRAD_NONE when empty);
/// NaN never wins, and nothing but NaN counts as empty. Sums: a row of 16 by pairs, the 64 rows of a block of 1024 from
/// left to right, blocks (from the segment's start) from left to right.
void segmented_reduce_sum(Device&, const cl::Buffer& in, const cl::Buffer& offsets, const cl::Buffer& out,
                          std::uint64_t segments);
void segmented_reduce_min(Device&, const cl::Buffer& in, const cl::Buffer& offsets, const cl::Buffer& out,
                          const cl::Buffer& index, std::uint64_t segments);

/// Sum in double on the host of fixed blocks of 1024 floats on the device, these as in segmented_reduce_sum (n = 0: 0).
double reduce_sum_float(Device&, const cl::Buffer& in, std::uint64_t n);
struct ArgMax {
  float value;
  std::uint32_t index;  ///< lowest that attains it; CLRAD_NONE when n = 0 or all NaN
};
ArgMax argmax_float(Device&, const cl::Buffer& in, std::uint64_t n);
/// Both at once, with one wait for the device.
struct SumAndArgMax {
  double sum;
  ArgMax most;
};
SumAndArgMax sum_and_argmax_float(Device&, const cl::Buffer& in, std::uint64_t n);

/// Processor allocation: requester i gets counts[i] consecutive slots.
struct Allocation {
  std::uint32_t total = 0;
  Array<std::uint32_t> offsets;  ///< n + 1 values; slots of i are [offsets[i], offsets[i+1])
  Array<std::uint32_t> owner;    ///< per slot, who asked for it
  Array<std::uint32_t> rank;     ///< per slot, its number within its owner's slots
};
Allocation allocate(Device&, const cl::Buffer& counts, std::uint64_t n, std::string_view what = "allocation");
/// The same into arrays that are kept from call to call and only ever grow (they may be longer than n + 1 and total).
void allocate_into(Device&, const cl::Buffer& counts, std::uint64_t n, Allocation& allocation,
                   std::string_view what = "allocation");
/// Offsets and total only: owner and rank stay as they are.
void allocate_offsets_into(Device&, const cl::Buffer& counts, std::uint64_t n, Allocation& allocation,
                           std::string_view what = "allocation");

/// The indices i with flags[i] != 0, ascending. Returns how many; `indices` needs room for n (at least 1) values.
std::uint32_t compact(Device&, const cl::Buffer& flags, std::uint64_t n, const cl::Buffer& indices);
/// The same with nothing read by the host: count gets how many as a ulong (8 bytes), `count_at` bytes from its beginning.
void compact_on_device(Device&, const cl::Buffer& flags, std::uint64_t n, const cl::Buffer& indices,
                       const cl::Buffer& count, std::uint64_t count_at = 0);

/// Stable ascending sort of (key, value) pairs of uint32, in place, by the low key_bits bits of the keys.
void radix_sort(Device&, const cl::Buffer& keys, const cl::Buffer& values, std::uint64_t n,
                unsigned key_bits = 32);

/// The calls above keep their scratch arrays with the device; this gives them back to its memory budget.
void release_primitive_scratch(Device&);

}  // namespace clrad
