// What stands in for values at covered vertices where something is interpolated.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"

namespace clrad {

/// Each covered vertex of values [band][vertex] gets the mean of the uncovered corners of its elements (each as often as it is
/// one), ring by ring inwards.
void fill_covered(const Mesh& mesh, std::vector<std::uint8_t> covered, std::vector<double>& values,
                  std::uint32_t bands);

}  // namespace clrad
