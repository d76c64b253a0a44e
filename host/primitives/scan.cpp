#include <fmt/format.h>

#include <algorithm>

#include "clrad/primitives.hpp"
#include "primitives/common.hpp"

namespace clrad {
namespace primitives {

namespace {
constexpr const char* scan_kernels = "primitives/scan.cl";
/// 8 MiB of input, which the caches of most CPUs hold. Measured: flat between 2 and 16 MiB.
constexpr std::uint64_t cached_values = 2u << 20;
}  // namespace

void check_count(std::string_view primitive, std::uint64_t n) {
  if (n > most_elements)
    throw UsageError(fmt::format("{}: {} values; at most {} are supported", primitive, n, most_elements));
}

void check_buffer(std::string_view primitive, std::string_view argument, const cl::Buffer& buffer,
                  std::uint64_t count) {
  const std::uint64_t bytes = buffer() ? buffer.getInfo<CL_MEM_SIZE>() : 0;
  if (bytes < count * 4)
    throw UsageError(fmt::format("{}: buffer `{}` holds {} bytes; {} values need {}", primitive, argument,
                                 bytes, count, count * 4));
}

std::uint32_t check_total(std::string_view primitive, std::uint64_t total) {
  if (total > 0xffffffffu)
    throw UsageError(fmt::format("{}: the total is {}, which does not fit 32 bits", primitive, total));
  return static_cast<std::uint32_t>(total);
}

Blocks cut_blocks(const Device& device, std::uint64_t n) {
  const bool tree = trees(device);
  const std::uint64_t group = device.options().work_group_size;
  const std::uint64_t unit = tree ? group * 16 : 4096, most_blocks = tree ? 2048 : 4096;
  Blocks blocks;
  blocks.length =
      n <= 4 * unit ? 4 * unit
                    : unit * std::max<std::uint64_t>(1, (n + unit * most_blocks - 1) / (unit * most_blocks));
  blocks.count = static_cast<std::uint32_t>((n + blocks.length - 1) / blocks.length);
  blocks.local = tree ? static_cast<unsigned>(group) : 1;
  // The last pass of a CPU reads what the first has just brought into the cache; a GPU wants few launches.
  blocks.at_a_time =
      tree ? blocks.count
           : static_cast<std::uint32_t>(std::max<std::uint64_t>(1, cached_values / blocks.length));
  return blocks;
}

Array<std::uint64_t>& grown_block_sums(Device& device, const Blocks& blocks) {
  Array<std::uint64_t>& sums = scan_scratch(device);
  grow(device, sums, std::max<std::uint64_t>(blocks.count + 1, 4097), "block sums of a scan");
  return sums;
}

void scan_block_sums(Device& device, const cl::Buffer& in, std::uint64_t n, const Blocks& blocks,
                     std::uint32_t first, std::uint32_t last, std::uint32_t mode,
                     Array<std::uint64_t>& sums) {
  const bool tree = trees(device);
  device.run_local(scan_kernels, tree ? "scan_sums_trees" : "scan_sums_blocks", blocks.items(last - first),
                   blocks.local, in, n, blocks.length, first, mode, sums);
  device.run_local(scan_kernels, tree ? "scan_top_trees" : "scan_top_blocks", blocks.local, blocks.local,
                   sums, first, last);
}

std::uint64_t scan_passes(Device& device, const cl::Buffer& in, const cl::Buffer& out, std::uint64_t n,
                          std::uint32_t mode) {
  const bool tree = trees(device);
  const Blocks blocks = cut_blocks(device, n);
  Array<std::uint64_t>& sums = grown_block_sums(device, blocks);
  if (blocks.count == 1) {
    device.run_local(scan_kernels, tree ? "scan_short_trees" : "scan_short_blocks", blocks.local,
                     blocks.local, in, n, mode, sums, out);
    return 0;
  }
  for (std::uint32_t first = 0; first < blocks.count; first += blocks.at_a_time) {
    const std::uint32_t last = std::min(blocks.count, first + blocks.at_a_time);
    scan_block_sums(device, in, n, blocks, first, last, mode, sums);
    device.run_local(scan_kernels, tree ? "scan_trees" : "scan_blocks", blocks.items(last - first),
                     blocks.local, in, n, blocks.length, first, mode, sums, out);
  }
  return blocks.count;
}

std::uint64_t read_total(Device& device, std::uint64_t at) {
  std::uint64_t total = 0;
  device.read(scan_scratch(device).buffer(), at * 8, 8, &total);
  return total;
}

namespace {
std::uint32_t mode_of(Sum kind) {
  return kind == Sum::inclusive ? scan_inclusive : 0;
}

void check(const cl::Buffer& in, const cl::Buffer& out, std::uint64_t n) {
  check_count("scan_uint", n);
  check_buffer("scan_uint", "in", in, n);
  check_buffer("scan_uint", "out", out, n);
}
}  // namespace

}  // namespace primitives

using namespace primitives;

void release_primitive_scratch(Device& device) {
  device.finish();
  device.drop_kept<Scratch>();
}

std::uint32_t scan_uint(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out,
                        std::uint64_t n) {
  if (n == 0) return 0;
  check(in, out, n);
  const std::uint64_t at = scan_passes(device, in, out, n, mode_of(kind));
  return check_total("scan_uint", read_total(device, at));
}

void scan_uint_on_device(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out,
                         std::uint64_t n, const cl::Buffer& total) {
  check_buffer("scan_uint_on_device", "total", total, 2);
  if (n == 0) {
    device.fill_bytes(total, 0, 8);
    return;
  }
  check(in, out, n);
  const std::uint64_t at = scan_passes(device, in, out, n, mode_of(kind));
  device.copy(scan_scratch(device).buffer(), total, 8, at * 8, 0);
}

}  // namespace clrad
