// Splits elements of the mesh: the quadtree grows at its leaves.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/frame.hpp"
#include "clrad/mesh.hpp"

namespace clrad {

/// What one subdivision changed.
struct Subdivision {
  std::uint32_t first_vertex = 0;  ///< new vertices are those from here on
  std::uint32_t split = 0;           ///< elements split, those that balance forced included
  std::vector<std::uint32_t> owner;  ///< per element now: the element before that it was or came from
};

/// Splits element e where split[e] != 0 (one word an element; elements of lattice_depth stay), and neighbours of split
/// elements until edges meet at most one T-vertex. Appends the vertices that this needs to the mesh, in Morton order within
/// each polygon, and lays its element array anew. Throws UsageError past 2^31 vertices. kernels/mesh/subdivide.cl.
Subdivision subdivide(Device& device, const Scene& scene, const Frame& frame, Mesh& mesh,
                      std::vector<std::uint32_t> split);

}  // namespace clrad
