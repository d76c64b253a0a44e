/// How far two answers to one scene are apart.
#pragma once
#include <cstdint>
#include <string>

#include "clrad/solution.hpp"

namespace clrad {

/// Irradiance of `solution` against that of `reference`, relative to the mean of the reference: root of the area-weighted
/// mean over points and bands of (H - H_ref)^2, and the largest |H - H_ref|. Points are the vertices that nothing covers where
/// both have the same mesh, else the means of the input polygons. One band stands for all of a solution with more. Throws
/// UsageError when the scenes have different numbers of polygons, or of bands other than one.
Comparison compare(const Solution& solution, const Solution& reference);

}  // namespace clrad
