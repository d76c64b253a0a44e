/// The uniform grid of `chop`: which triangles each voxel holds. Built on the device, in parallel.
#pragma once
#include <array>
#include <cstdint>

#include "clrad/device.hpp"
#include "visibility/occluders.hpp"

namespace clrad {

/// What the grid's resolution is chosen by: the mean cost of a segment, in any one unit (here nanoseconds of one core,
/// measured with `./run bench visibility --profile --cells NxNxN`).
struct GridCosts {
  double cut = 10;    ///< to cut at all
  double piece = 8;   ///< to cut one ray/voxel piece out of a ray
  double block = 14;  ///< to test one ray against a block of DeviceOptions::packet_width triangles
  double load = 50;   ///< to load a block for those of a bundle's rays that meet its voxel
};

class Grid {
 public:
  /// cells: voxels along x, y, z, at most 1024 each; {0, 0, 0}: by `costs`, each pass trying a finer grid
  /// until two in a row do not pay or the lists would take more than a quarter of the device's memory budget.
  Grid(Device& device, const Occluders& occluders, std::array<std::uint32_t, 3> cells = {0, 0, 0},
       const GridCosts& costs = {});

  std::array<std::uint32_t, 3> cells{1, 1, 1};
  std::uint32_t voxels() const { return cells[0] * cells[1] * cells[2]; }
  std::uint32_t width = 1;   ///< triangles in a block
  std::uint32_t blocks = 0;  ///< of all voxels

  Array<float> frame;         ///< 12: corner, cell size, 1 / cell size, cells (kernels/shared/voxel.cl)
  Array<std::uint32_t> held;  ///< voxels: triangles in the list of each
  Array<std::uint32_t>
      first_block;             ///< voxels + 1: blocks of voxel v are [first_block[v], first_block[v + 1])
  Array<std::uint32_t> lanes;  ///< blocks * width: occluder index, CLRAD_NONE past a list's end

 private:
  struct Lists;
  Lists overlaps(Device& device, const Occluders& occluders, std::array<std::uint32_t, 3> resolution);
  void sort(Device& device, Lists lists);
};

}  // namespace clrad
