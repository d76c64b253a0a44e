#include <algorithm>

#include "clrad/primitives.hpp"
#include "primitives/common.hpp"

namespace clrad {
namespace {

using namespace primitives;

constexpr const char* reduce_kernels = "primitives/reduce.cl";
constexpr std::uint64_t sum_block = 1024;
constexpr std::uint32_t none = 0xffffffffu;
/// Segments a CPU work-group takes: enough to pay for its launch, few enough to spread.
constexpr unsigned segments_per_group = 64;

void check_segments(const char* primitive, const cl::Buffer& offsets, const cl::Buffer& out,
                    std::uint64_t segments) {
  check_count(primitive, segments);
  check_buffer(primitive, "offsets", offsets, segments + 1);
  check_buffer(primitive, "out", out, segments);
}

unsigned segment_local(const Device& device) {
  return trees(device) ? 0 : segments_per_group;
}

}  // namespace

void segmented_reduce_sum(Device& device, const cl::Buffer& in, const cl::Buffer& offsets,
                          const cl::Buffer& out, std::uint64_t segments) {
  if (segments == 0) return;
  check_segments("segmented_reduce_sum", offsets, out, segments);
  device.run_local(reduce_kernels, trees(device) ? "segment_sum_trees" : "segment_sum_blocks", segments,
                   segment_local(device), in, offsets, static_cast<std::uint32_t>(segments), out);
}

void segmented_reduce_min(Device& device, const cl::Buffer& in, const cl::Buffer& offsets,
                          const cl::Buffer& out, const cl::Buffer& index, std::uint64_t segments) {
  if (segments == 0) return;
  check_segments("segmented_reduce_min", offsets, out, segments);
  check_buffer("segmented_reduce_min", "index", index, segments);
  device.run_local(reduce_kernels, trees(device) ? "segment_min_trees" : "segment_min_blocks", segments,
                   segment_local(device), in, offsets, static_cast<std::uint32_t>(segments), out, index);
}

double reduce_sum_float(Device& device, const cl::Buffer& in, std::uint64_t n) {
  if (n == 0) return 0;
  check_count("reduce_sum_float", n);
  check_buffer("reduce_sum_float", "in", in, n);
  const std::uint64_t blocks = (n + sum_block - 1) / sum_block;
  auto& sums = device.kept<Scratch>().block_values;
  grow(device, sums, std::max<std::uint64_t>(blocks, 4096), "block sums");
  if (trees(device))
    device.run(reduce_kernels, "reduce_sum_trees", blocks * device.options().work_group_size, in, n, sums);
  else
    device.run_local(reduce_kernels, "reduce_sum_blocks", blocks, 4, in, n, sums);
  double total = 0;
  for (const float sum : sums.download(0, blocks)) total += double(sum);
  return total;
}

ArgMax argmax_float(Device& device, const cl::Buffer& in, std::uint64_t n) {
  ArgMax best{0, none};
  if (n == 0) return best;
  check_count("argmax_float", n);
  check_buffer("argmax_float", "in", in, n);
  const Blocks blocks = cut_blocks(device, n);
  auto& scratch = device.kept<Scratch>();
  grow(device, scratch.block_values, std::max<std::uint64_t>(blocks.count, 4096), "block maxima");
  grow(device, scratch.block_indices, std::max<std::uint64_t>(blocks.count, 4096), "block maxima");
  device.run_local(reduce_kernels, trees(device) ? "arg_trees" : "arg_blocks", blocks.items(), blocks.local,
                   in, n, blocks.length, -1.0f, scratch.block_values, scratch.block_indices);
  const auto values = scratch.block_values.download(0, blocks.count);
  const auto indices = scratch.block_indices.download(0, blocks.count);
  for (std::uint32_t b = 0; b < blocks.count; ++b)
    if (indices[b] != none && (best.index == none || values[b] > best.value)) best = {values[b], indices[b]};
  return best;
}

}  // namespace clrad
