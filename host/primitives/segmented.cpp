#include <algorithm>

#include "clrad/primitives.hpp"
#include "primitives/common.hpp"

namespace clrad {
namespace {

using namespace primitives;

constexpr const char* segmented_kernels = "primitives/segmented.cl";
constexpr std::uint64_t block = 1024;
/// Blocks of 1024 that a CPU work-group takes.
constexpr unsigned blocks_per_group = 4;
constexpr std::uint32_t with_heads = 1, exclusive = 2;

/// Kernel names of one operator on one type.
struct Kernels {
  const char *totals_blocks, *scan_blocks, *totals_trees, *scan_trees;
};
#define CLRAD_KERNELS(name)                                                              \
  Kernels {                                                                              \
    name "_totals_blocks", name "_scan_blocks", name "_totals_trees", name "_scan_trees" \
  }
constexpr Kernels sum_uint = CLRAD_KERNELS("sum_uint"), min_uint = CLRAD_KERNELS("min_uint"),
                  max_uint = CLRAD_KERNELS("max_uint"), first_uint = CLRAD_KERNELS("first_uint"),
                  sum_float = CLRAD_KERNELS("sum_float"), min_float = CLRAD_KERNELS("min_float"),
                  max_float = CLRAD_KERNELS("max_float");
#undef CLRAD_KERNELS

void scan_level(Device& device, const Kernels& kernels, const cl::Buffer& in, const cl::Buffer& heads,
                const cl::Buffer& out, std::uint64_t n, std::uint32_t mode, unsigned depth) {
  const bool tree = trees(device);
  const std::uint64_t blocks = (n + block - 1) / block;
  const std::uint64_t group = device.options().work_group_size, teams = group < 64 ? 1 : group / 64;
  const std::uint64_t items = tree ? (blocks + teams - 1) / teams * group : blocks;
  const unsigned local = tree ? 0 : blocks_per_group;
  SegmentLevel& level = device.kept<Scratch>().levels[depth];
  grow(device, level.totals, std::max<std::uint64_t>(blocks, block), "block totals of a segmented scan");
  grow(device, level.heads, std::max<std::uint64_t>(blocks, block), "block heads of a segmented scan");
  if (blocks > 1) {
    device.run_local(segmented_kernels, tree ? kernels.totals_trees : kernels.totals_blocks, items, local, in,
                     heads, n, mode, level.totals, level.heads);
    scan_level(device, kernels, level.totals.buffer(), level.heads.buffer(), level.totals.buffer(), blocks,
               with_heads, depth + 1);
  }
  device.run_local(segmented_kernels, tree ? kernels.scan_trees : kernels.scan_blocks, items, local, in,
                   heads, n, mode, level.totals, out);
}

void scan(const char* primitive, Device& device, const Kernels& kernels, const cl::Buffer& in,
          const cl::Buffer& heads, const cl::Buffer& out, std::uint64_t n, std::uint32_t mode) {
  if (n == 0) return;
  check_count(primitive, n);
  check_buffer(primitive, "in", in, n);
  if (mode & with_heads) check_buffer(primitive, "heads", heads, n);
  check_buffer(primitive, "out", out, n);
  scan_level(device, kernels, in, heads, out, n, mode, 0);
}

}  // namespace

void segmented_scan_uint(Device& device, Op op, const cl::Buffer& in, const cl::Buffer& heads,
                         const cl::Buffer& out, std::uint64_t n) {
  const Kernels& kernels = op == Op::sum ? sum_uint : op == Op::min ? min_uint : max_uint;
  scan("segmented_scan_uint", device, kernels, in, heads, out, n, with_heads);
}

void segmented_scan_float(Device& device, Op op, const cl::Buffer& in, const cl::Buffer& heads,
                          const cl::Buffer& out, std::uint64_t n) {
  const Kernels& kernels = op == Op::sum ? sum_float : op == Op::min ? min_float : max_float;
  scan("segmented_scan_float", device, kernels, in, heads, out, n, with_heads);
}

void segmented_copy(Device& device, const cl::Buffer& in, const cl::Buffer& heads, const cl::Buffer& out,
                    std::uint64_t n) {
  scan("segmented_copy", device, first_uint, in, heads, out, n, with_heads);
}

void scan_float(Device& device, Sum kind, const cl::Buffer& in, const cl::Buffer& out, std::uint64_t n) {
  // Without heads the kernel reads none; any buffer will do.
  scan("scan_float", device, sum_float, in, in, out, n, kind == Sum::exclusive ? exclusive : 0);
}

}  // namespace clrad
