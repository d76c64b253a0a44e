#include "viewfactors/cull.hpp"

namespace clrad {

std::vector<std::uint32_t> cull_cells(Device& device, const PairTables& tables,
                                      std::span<const std::uint32_t> cells,
                                      std::vector<std::uint32_t>& list) {
  const auto count = std::uint32_t(cells.size() / cell_words);
  if (count == 0) return {};
  const auto stage = device.stage("find occluders of cells");
  const Array<std::uint32_t> words(device, cells, "cells");
  Array<std::uint32_t> lists(device, std::span<const std::uint32_t>(list), "occluders of cells");
  const Array<std::uint32_t> kept(device, count, "cells");
  device.run("viewfactors/cull.cl", "cull_cells", count, words, count, tables.quads, tables.pairs,
             tables.occluders, tables.sides, tables.planes, tables.vertices, lists, kept);
  list = lists.download();
  return kept.download();
}

}  // namespace clrad
