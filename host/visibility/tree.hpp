/// The occluders in a tree of boxes, built on the device (kernels/visibility/tree.cl): what `shaft` walks.
#pragma once
#include "visibility/occluders.hpp"

namespace clrad {

struct Tree {
  /// balanced: pairs by their numbers alone, as trees that would be too deep are built.
  Tree(Device& device, const Occluders& occluders, bool balanced = false);

  std::uint32_t count = 0;  ///< triangles
  std::uint32_t inner = 0;  ///< nodes of up to 8 children; at least one, even over nothing
  std::uint32_t depth = 0;  ///< levels of pairs, the leaves' included
  double cost = 0;  ///< expected tests of a line through the root's box (surface area heuristic), as pairs
  Array<std::uint32_t> nodes;  ///< 64 words each, the root first; see kernels/visibility/tree.cl, tree_widen
  Array<clrad_triangle> triangles;   ///< in the tree's order
  Array<clrad_facet> facets;         ///< of each
  Array<std::uint32_t> input_index;  ///< of each, which input triangle it is

  /// Deeper trees are built again, balanced: walks keep a stack for this many levels.
  static constexpr std::uint32_t most_depth = 64;
};

}  // namespace clrad
