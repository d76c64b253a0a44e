// The outline of an element with the vertices that finer neighbours put on its edges: what files draw instead of its bare
// corners, so that no crack opens between elements of different level.
#pragma once
#include <array>
#include <cstdint>

#include "clrad/mesh.hpp"

namespace clrad {

struct Outline {
  std::array<std::uint32_t, 8> vertex{};
  std::uint32_t vertices = 0;  ///< 3 to 8
};

/// Corners and T-vertices, counter-clockwise. Starts at the first T-vertex, or at corner 0 without one: the triangles (0, k,
/// k + 1) then have area in every convex element, since of three neighbours in a row on one edge only those around a
/// T-vertex are collinear, and the first T-vertex shares its edge with none of the others.
Outline outline(const Element& element);

}  // namespace clrad
