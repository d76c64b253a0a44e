#include "visibility/grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "clrad/primitives.hpp"

namespace clrad {
namespace {

constexpr const char* grid_kernels = "visibility/grid.cl";
constexpr double pad = 0x1p-16;  // CLRAD_VOXEL_PAD
constexpr std::uint32_t most_cells = 1024;

using Cells = std::array<std::uint32_t, 3>;

/// The box leaves twice the pad around the triangles: where a segment is clipped to it, it is still clear of
/// them.
std::vector<float> make_frame(const Occluders& occluders, const Cells& cells) {
  std::vector<float> frame(12);
  for (int a = 0; a < 3; ++a) {
    const double low = occluders.box_low[a] - 4 * pad, high = occluders.box_high[a] + 4 * pad;
    frame[a] = float(low);
    frame[3 + a] = float((high - low) / cells[a]);
    frame[6 + a] = 1.0f / frame[3 + a];
    frame[9 + a] = float(cells[a]);
  }
  return frame;
}

/// Nearly cubic voxels, `longest` of them along the box's longest side.
Cells cells_for(const Occluders& occluders, double longest) {
  const auto size = occluders.box_high - occluders.box_low;
  const double most = std::max({size.x, size.y, size.z, pad});
  Cells cells;
  for (int a = 0; a < 3; ++a)
    cells[a] = std::uint32_t(std::clamp(std::round(longest * size[a] / most), 1.0, double(most_cells)));
  return cells;
}

}  // namespace

/// One resolution tried: pairs of triangle and voxel, still in triangle order.
struct Grid::Lists {
  Cells cells;
  Array<float> frame;
  Allocation slots;  // owner: triangle
  Array<std::uint32_t> flags, voxel, held, first_block;
  std::uint32_t blocks = 0;
};

Grid::Lists Grid::overlaps(Device& device, const Occluders& occluders, Cells resolution) {
  const std::uint32_t n = occluders.count, count = resolution[0] * resolution[1] * resolution[2];
  Lists l;
  l.cells = resolution;
  l.frame = Array<float>(device, make_frame(occluders, resolution), "grid frame");
  Array<std::uint32_t> counts(device, std::max(n, 1u), "grid counts");
  device.run(grid_kernels, "grid_ranges", n, n, occluders.triangles, l.frame, counts);
  l.slots = allocate(device, counts.buffer(), n, "grid slots");
  const std::uint32_t slots = l.slots.total;
  l.flags = Array<std::uint32_t>(device, std::max(slots, 1u), "grid overlap flags");
  l.voxel = Array<std::uint32_t>(device, std::max(slots, 1u), "grid voxel numbers");
  l.held = Array<std::uint32_t>(device, count, "grid voxel counts");
  l.held.fill_zero();
  device.run(grid_kernels, "grid_overlap", slots, slots, occluders.triangles, l.frame, l.slots.owner,
             l.slots.rank, l.flags, l.voxel, l.held);
  l.first_block = Array<std::uint32_t>(device, count + 1, "grid list starts");
  device.run(grid_kernels, "grid_blocks", count + 1, count + 1, count, l.held, l.first_block);
  scan_uint(device, Sum::exclusive, l.first_block.buffer(), l.first_block.buffer(), count + 1);
  l.blocks = l.first_block.at(count);
  return l;
}

void Grid::sort(Device& device, Lists l) {
  cells = l.cells;
  frame = std::move(l.frame);
  held = std::move(l.held);
  first_block = std::move(l.first_block);
  blocks = l.blocks;
  const std::uint32_t slots = l.slots.total, count = voxels();

  Array<std::uint32_t> picked(device, std::max(slots, 1u), "grid pairs");
  const std::uint32_t pairs = compact(device, l.flags.buffer(), slots, picked.buffer());
  l.flags = {};
  Array<std::uint32_t> keys(device, std::max(pairs, 1u), "grid pair voxels");
  Array<std::uint32_t> values(device, std::max(pairs, 1u), "grid pair triangles");
  device.run(grid_kernels, "grid_pairs", pairs, pairs, picked, l.voxel, l.slots.owner, keys, values);
  picked = {};
  l.voxel = {};
  l.slots = {};
  radix_sort(device, keys.buffer(), values.buffer(), pairs,
             std::max(1u, unsigned(std::bit_width(count - 1))));

  Array<std::uint32_t> first(device, count, "grid pair starts");
  scan_uint(device, Sum::exclusive, held.buffer(), first.buffer(), count);
  Array<std::uint32_t> wanted(device, count, "grid block counts");
  device.run(grid_kernels, "grid_blocks", count, count, count, held, wanted);
  const auto owners = allocate(device, wanted.buffer(), count, "grid blocks");
  const std::uint32_t n = blocks * width;
  lanes = Array<std::uint32_t>(device, std::max(n, 1u), "grid lists");
  device.run(grid_kernels, "grid_lanes", n, n, owners.owner, owners.rank, held, first, values, lanes);
  device.finish();
}

Grid::Grid(Device& device, const Occluders& occluders, Cells wanted, const GridCosts& costs)
    : width(device.options().packet_width) {
  const auto stage = device.stage("build the grid");
  if (wanted[0] != 0) {
    sort(device, overlaps(device, occluders, wanted));
    return;
  }
  // A segment between two random places spans a third of the box along each axis, hence (nx + ny + nz) / 3
  // planes; each of its pieces meets the lists of a voxel taken at random. Bundles have their samples on a patch of an
  // eighth of the scene, so half way they are n / 16 cells wide and share a voxel with width / (1 + n / 16)^2 others.
  const auto cost = [&](const Lists& l) {
    const double sum = double(l.cells[0]) + l.cells[1] + l.cells[2], pieces = 1 + (sum - 3) / 3;
    const double apart = 1 + (sum / 3 - 1) / 16, share = std::min(1.0, apart * apart / width);
    const double blocks_in_one = l.blocks / (double(l.cells[0]) * l.cells[1] * l.cells[2]);
    return (sum > 3 ? costs.cut : 0) +
           pieces * (costs.piece + (costs.block + costs.load * share) * blocks_in_one);
  };
  // No voxel of the coarsest grid tried needs to hold more than about 512 blocks.
  const double start = std::max(1.0, std::cbrt(occluders.count / (512.0 * width)));
  std::optional<Lists> best;
  double least = 0;
  int worse = 0;
  Cells last{};
  for (double longest = start; longest <= most_cells && worse < 2; longest *= longest < 4 ? 1.5 : 1.25) {
    const Cells cells_now = cells_for(occluders, longest);
    if (cells_now == last) continue;
    last = cells_now;
    const double voxels_now = double(cells_now[0]) * cells_now[1] * cells_now[2];
    if (best && (voxels_now > 16.0 * occluders.count + 64 || voxels_now * 40 > device.ledger()->limit / 16.0))
      break;
    try {
      Lists lists = overlaps(device, occluders, cells_now);
      const double mine = cost(lists);
      // Lists and their packets of kernels/visibility/chop.cl: some 100 bytes a lane.
      if (best && double(lists.blocks) * width * 100 > device.ledger()->limit / 4.0) break;
      if (!best || mine < least) {
        best = std::move(lists);
        least = mine;
        worse = 0;
      } else {
        ++worse;
      }
    } catch (const Error&) {
      if (!best) throw;
      break;  // too many slots for the budget: the finest grid that fits it is taken
    }
  }
  sort(device, std::move(*best));
}

}  // namespace clrad
