/// Quads back from the triangles that glTF makes of them.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace clrad {

/// A triangle (count 3) or quad (count 4) by positions.
struct MergedFace {
  std::array<glm::dvec3, 4> corner{};
  std::uint32_t count = 3;
  std::uint32_t triangle = 0;  ///< the first of its triangles
};

/// Merges pairs of the given triangles (of one primitive, so of one material). A pair is a candidate when
/// exactly these two share an edge (equal positions), run along it in opposite directions, and form a quad
/// that is planar within kPlanarTolerance of its longer diagonal with a sine of at least 1e-3 at each corner,
/// none reflex. Candidates are taken by how nearly rectangular they are (largest |cosine| of a corner, in
/// steps of 2^-10), ties in file order; each triangle once. The result keeps the order of the first
/// triangles; triangles left over stay as they are.
std::vector<MergedFace> merge_quads(const std::vector<std::array<glm::dvec3, 3>>& triangles);

}  // namespace clrad
