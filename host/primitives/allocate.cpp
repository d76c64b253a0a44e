#include <fmt/format.h>

#include <algorithm>

#include "clrad/primitives.hpp"
#include "primitives/common.hpp"

namespace clrad {
namespace {

using namespace primitives;

constexpr const char* allocate_kernels = "primitives/allocate.cl";

/// Enqueues all of a compaction; returns where in scan_scratch() the count lies.
std::uint64_t compact_passes(Device& device, const cl::Buffer& flags, std::uint64_t n,
                             const cl::Buffer& indices) {
  check_count("compact", n);
  check_buffer("compact", "flags", flags, n);
  check_buffer("compact", "indices", indices, n);
  const bool tree = trees(device);
  const Blocks blocks = cut_blocks(device, n);
  auto& sums = grown_block_sums(device, blocks);
  if (blocks.count == 1) {
    device.run_local(allocate_kernels, tree ? "compact_short_trees" : "compact_short_blocks", blocks.local,
                     blocks.local, flags, n, sums, indices);
    return 0;
  }
  scan_block_sums(device, flags, n, blocks, 0, blocks.count, scan_flags, sums);
  device.run_local(allocate_kernels, tree ? "compact_trees" : "compact_blocks", blocks.items(), blocks.local,
                   flags, n, blocks.length, sums, indices);
  return blocks.count;
}

}  // namespace

void allocate_offsets_into(Device& device, const cl::Buffer& counts, std::uint64_t n, Allocation& allocation,
                           std::string_view what) {
  check_count("allocate", n);
  grow(device, allocation.offsets, n + 1, fmt::format("{}: offsets", what));
  allocation.total = 0;
  if (n == 0) {
    const std::uint32_t zero = 0;
    allocation.offsets.upload({&zero, 1});
    return;
  }
  check_buffer("allocate", "counts", counts, n);
  const std::uint64_t at = scan_passes(device, counts, allocation.offsets.buffer(), n, scan_append);
  allocation.total = check_total(fmt::format("allocate {}", what), read_total(device, at));
}

void allocate_into(Device& device, const cl::Buffer& counts, std::uint64_t n, Allocation& allocation,
                   std::string_view what) {
  allocate_offsets_into(device, counts, n, allocation, what);
  grow(device, allocation.owner, allocation.total, fmt::format("{}: owners", what));
  grow(device, allocation.rank, allocation.total, fmt::format("{}: ranks", what));
  if (allocation.total == 0) return;
  const auto requesters = static_cast<std::uint32_t>(n);
  if (trees(device)) {
    device.run(allocate_kernels, "allocate_owners_trees", allocation.total, allocation.offsets, requesters,
               allocation.total, allocation.owner, allocation.rank);
    return;
  }
  constexpr std::uint32_t share = 8192;
  const std::uint64_t steps = n + allocation.total;
  device.run_local(allocate_kernels, "allocate_owners_blocks", (steps + share - 1) / share, 1,
                   allocation.offsets, requesters, allocation.total, share, allocation.owner,
                   allocation.rank);
}

Allocation allocate(Device& device, const cl::Buffer& counts, std::uint64_t n, std::string_view what) {
  Allocation allocation;
  allocate_into(device, counts, n, allocation, what);
  return allocation;
}

std::uint32_t compact(Device& device, const cl::Buffer& flags, std::uint64_t n, const cl::Buffer& indices) {
  if (n == 0) return 0;
  const std::uint64_t at = compact_passes(device, flags, n, indices);
  return static_cast<std::uint32_t>(read_total(device, at));
}

void compact_on_device(Device& device, const cl::Buffer& flags, std::uint64_t n, const cl::Buffer& indices,
                       const cl::Buffer& count, std::uint64_t count_at) {
  check_buffer("compact_on_device", "count", count, 2 + count_at / 4);
  if (n == 0) {
    device.fill_bytes(count, 0, 8, count_at);
    return;
  }
  const std::uint64_t at = compact_passes(device, flags, n, indices);
  device.copy(scan_scratch(device).buffer(), count, 8, at * 8, count_at);
}

}  // namespace clrad
