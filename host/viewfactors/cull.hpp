// Occluders of cells, from cell to half cell. Launches kernels/viewfactors/cull.cl.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/device.hpp"

namespace clrad {

/// Pairs of polygons as kernels see them, see kernels/viewfactors/tables.cl.
struct PairTables {
  Array<std::uint32_t> pairs, occluders, sides;
  RealArray normals, planes, vertices, quads;
};

constexpr std::uint64_t cell_words = 8;  // as in the kernel file
constexpr std::uint32_t hidden =
    0xffffffffu;  ///< instead of a number of occluders: nothing of the shooter is visible

/// cells: cell_words each, the last two saying where in `list` the cell's occluders are. Those that can hide something from
/// some point of the cell are moved to the front of its list; their number, or `hidden`, is the result of each.
std::vector<std::uint32_t> cull_cells(Device& device, const PairTables& tables,
                                      std::span<const std::uint32_t> cells, std::vector<std::uint32_t>& list);

}  // namespace clrad
