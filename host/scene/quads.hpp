/// Quads back from the triangles that glTF makes of them.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace clrad {

/// A triangle (count 3) or quad (count 4) by positions.
struct MergedFace {
  std::array<glm::dvec3, 4> corner{};
  std::uint32_t count = 3;
  std::uint32_t triangle = 0;      ///< the first of its triangles
  std::array<glm::dvec2, 4> uv{};  ///< texture coordinates, where there are any
};

/// Merges pairs of the given triangles (of one primitive, so of one material). A pair is a candidate when
/// exactly these two share an edge (equal positions), run along it in opposite directions, and form a quad
/// that is planar within kPlanarTolerance of its longer diagonal with a sine of at least 1e-3 at each corner,
/// none reflex. Candidates are taken by how nearly rectangular they are (largest |cosine| of a corner, in
/// steps of 2^-10), ties in file order; each triangle once. The result keeps the order of the first
/// triangles; triangles left over stay as they are.
///
/// `uv`, where it is not empty, are texture coordinates of the triangles' corners; then a pair has to have the same ones along
/// the shared edge, and one linear map from the plane to the texture, within 1e-4 of what its coordinates span.
std::vector<MergedFace> merge_quads(const std::vector<std::array<glm::dvec3, 3>>& triangles,
                                    const std::vector<std::array<glm::dvec2, 3>>& uv = {});

}  // namespace clrad
