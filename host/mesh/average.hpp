// Area averages over elements, alone and as quarters of one parent.
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

/// Each element's own area average of values [vertex]: among four such children, that of the parent's quadratic interpolant (off in
/// the third power of the edge), kept between the element's corners; elsewhere the mean of its corners. The weights above are
/// right for the four together alone: one child's own are off in the first power. Of an element with a covered corner:
/// by its weights, of the exposed part; 0 where there is none.
std::vector<double> element_averages(const Mesh& mesh, const std::vector<std::uint8_t>& covered,
                                     const std::vector<double>& values);

/// The area that each vertex stands for in these averages [m^2]; 0 where it is covered.
std::vector<double> vertex_areas(const Mesh& mesh, const std::vector<std::uint8_t>& covered);

}  // namespace clrad
