// What lies around a new vertex in the level above.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "clrad/mesh.hpp"

namespace clrad {

/// Per vertex, from which to tell what the level above displayed at its place; 0xffffffff where there is none that is exposed.
/// In the middle of an edge of its parents: on the edge's line, one edge before the first end and one after the second, then two
/// edges before and two after. In the middle of a quad: the middles of the quad's edges.
std::vector<std::array<std::uint32_t, 4>> around_parents(const Mesh& mesh,
                                                         const std::vector<std::uint8_t>& covered);

}  // namespace clrad
