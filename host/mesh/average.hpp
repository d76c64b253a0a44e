// Area averages over elements that are quarters of one parent.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/mesh.hpp"

namespace clrad {

/// Sets the weights of parallelograms and triangles. Where all four children of a parent are leaves, their vertices are those
/// of a quadratic rule on the parent: Simpson's product rule on a quad, the middles of the sides on a triangle. Their
/// average is off in the fourth power of the edge (third on a triangle), where the interpolant's own is off in the
/// second and always to the same side. Elsewhere, each corner counts alike. Elements with a covered corner keep their weights.
void average_by_parents(Mesh& mesh, const std::vector<std::uint8_t>& covered);

}  // namespace clrad
