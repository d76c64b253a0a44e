// What displayed values have along elements' edges beyond the straight line between the edges' ends.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "clrad/mesh.hpp"

namespace clrad {

/// The elements' edges, each once, as both its sides know it: an edge with a T-vertex is two edges.
struct Edges {
  /// Per element: [2 k] is the edge from corner k to the next, or its first half; [2 k + 1] its second half, 0xffffffff where
  /// it has no T-vertex (or there is no corner k).
  std::vector<std::array<std::uint32_t, 8>> of_element;
  std::vector<std::array<std::uint32_t, 2>> ends;  ///< vertices, the lower number first
};

Edges edges_of(const Mesh& mesh);

/// Per edge, [band][edge], from values [band][vertex]: along it the value is, with t from 0 to 1,
///     (1 - t) a + t b + bend t (1 - t).
/// -2 bend is the second difference along the edge's line: the harmonic mean of those at its two ends where they agree in
/// sign, else 0 (van Leer 1974, "Towards the ultimate conservative difference scheme II": values on either side of a step
/// never overshoot). Where the line runs into a larger element, its next place is where it leaves that again, and the value what
/// the larger edge displays there (as ghost cells are filled in Berger & Colella 1989), less what a step within that edge might
/// do to it. At the border of a polygon, where there is but one of them, the next one inside is its partner;
/// 0 where there is none, and on edges that something covers. Never so much that a display of values that are not
/// negative gets negative.
std::vector<double> edge_bends(const Mesh& mesh, const Edges& edges, const std::vector<std::uint8_t>& covered,
                               const std::vector<double>& values, std::uint32_t bands);

}  // namespace clrad
