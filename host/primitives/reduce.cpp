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

namespace {

// What one pass over blocks leaves on the device, still to be read.
std::uint64_t enqueue_block_sums(Device& device, const cl::Buffer& in, std::uint64_t n) {
  check_count("reduce_sum_float", n);
  check_buffer("reduce_sum_float", "in", in, n);
  const std::uint64_t blocks = (n + sum_block - 1) / sum_block;
  auto& sums = device.kept<Scratch>().block_float_sums;
  grow(device, sums, std::max<std::uint64_t>(blocks, 4096), "block sums");
  if (trees(device))
    device.run(reduce_kernels, "reduce_sum_trees", blocks * device.options().work_group_size, in, n, sums);
  else
    device.run_local(reduce_kernels, "reduce_sum_blocks", blocks, 4, in, n, sums);
  return blocks;
}

std::uint64_t enqueue_block_maxima(Device& device, const cl::Buffer& in, std::uint64_t n) {
  check_count("argmax_float", n);
  check_buffer("argmax_float", "in", in, n);
  const Blocks blocks = cut_blocks(device, n);
  auto& scratch = device.kept<Scratch>();
  grow(device, scratch.block_values, std::max<std::uint64_t>(blocks.count, 4096), "block maxima");
  grow(device, scratch.block_indices, std::max<std::uint64_t>(blocks.count, 4096), "block maxima");
  device.run_local(reduce_kernels, trees(device) ? "arg_trees" : "arg_blocks", blocks.items(), blocks.local,
                   in, n, blocks.length, -1.0f, scratch.block_values, scratch.block_indices);
  return blocks.count;
}

// With one wait; either count may be 0.
SumAndArgMax read_blocks(Device& device, std::uint64_t sum_count, std::uint64_t most_count) {
  const auto& scratch = device.kept<Scratch>();
  std::vector<float> sums(sum_count), values(most_count);
  std::vector<std::uint32_t> indices(most_count);
  device.read_later(scratch.block_float_sums.buffer(), 0, sum_count * 4, sums.data());
  device.read_later(scratch.block_values.buffer(), 0, most_count * 4, values.data());
  device.read_later(scratch.block_indices.buffer(), 0, most_count * 4, indices.data());
  device.finish();
  SumAndArgMax result{0, {0, none}};
  for (const float sum : sums) result.sum += double(sum);
  for (std::uint64_t b = 0; b < most_count; ++b)
    if (indices[b] != none && (result.most.index == none || values[b] > result.most.value))
      result.most = {values[b], indices[b]};
  return result;
}

}  // namespace

double reduce_sum_float(Device& device, const cl::Buffer& in, std::uint64_t n) {
  return n == 0 ? 0 : read_blocks(device, enqueue_block_sums(device, in, n), 0).sum;
}

ArgMax argmax_float(Device& device, const cl::Buffer& in, std::uint64_t n) {
  return n == 0 ? ArgMax{0, none} : read_blocks(device, 0, enqueue_block_maxima(device, in, n)).most;
}

SumAndArgMax sum_and_argmax_float(Device& device, const cl::Buffer& in, std::uint64_t n) {
  if (n == 0) return {0, {0, none}};
  const std::uint64_t sums = enqueue_block_sums(device, in, n);
  return read_blocks(device, sums, enqueue_block_maxima(device, in, n));
}

}  // namespace clrad
