#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "clrad/primitives.hpp"
#include "primitives/common.hpp"

namespace clrad {
namespace {

using namespace primitives;

constexpr const char* sort_kernels = "primitives/sort.cl";
/// Longer ping-pong arrays are given back after each call.
constexpr std::uint64_t kept_pairs = 4u << 20;

}  // namespace

void radix_sort(Device& device, const cl::Buffer& keys, const cl::Buffer& values, std::uint64_t n,
                unsigned key_bits) {
  if (key_bits > 32) throw UsageError(fmt::format("radix_sort: key_bits is {}; at most 32", key_bits));
  if (n < 2 || key_bits == 0) return;
  check_count("radix_sort", n);
  check_buffer("radix_sort", "keys", keys, n);
  check_buffer("radix_sort", "values", values, n);
  const bool tree = trees(device);
  const unsigned group = device.options().work_group_size, local = tree ? group : 1, bits = tree ? 4 : 8;
  // On CPUs few blocks, since each writes 256 streams; enough to keep the cores evenly busy.
  const std::uint64_t wanted = std::max<std::uint64_t>(4096, (n + 127) / 128);
  const std::uint64_t length = tree ? group * 16ull : wanted;
  const auto blocks = static_cast<std::uint32_t>((n + length - 1) / length);

  auto& scratch = device.kept<Scratch>();
  grow(device, scratch.sort_keys, n, "keys while sorting");
  grow(device, scratch.sort_values, n, "values while sorting");
  grow(device, scratch.sort_counts, (std::uint64_t(blocks) << bits), "digit counts while sorting");

  const cl::Buffer* from[2] = {&keys, &values};
  const cl::Buffer* to[2] = {&scratch.sort_keys.buffer(), &scratch.sort_values.buffer()};
  for (unsigned shift = 0; shift < key_bits; shift += bits) {
    const std::uint32_t mask = (1u << std::min(bits, key_bits - shift)) - 1;
    const std::uint64_t counters = std::uint64_t(blocks) * (mask + 1);
    device.run_local(sort_kernels, tree ? "sort_count_trees" : "sort_count_blocks",
                     std::uint64_t(blocks) * local, local, *from[0], n, length, blocks, shift, mask,
                     scratch.sort_counts);
    scan_passes(device, scratch.sort_counts.buffer(), scratch.sort_counts.buffer(), counters, 0);
    device.run_local(sort_kernels, tree ? "sort_move_trees" : "sort_move_blocks",
                     std::uint64_t(blocks) * local, local, *from[0], *from[1], n, length, blocks, shift, mask,
                     scratch.sort_counts, *to[0], *to[1]);
    std::swap(from[0], to[0]);
    std::swap(from[1], to[1]);
  }
  if (from[0] != &keys) {
    device.copy(*from[0], keys, n * 4);
    device.copy(*from[1], values, n * 4);
  }
  if (n > kept_pairs) scratch.sort_keys = {}, scratch.sort_values = {};
}

}  // namespace clrad
