// What sensors see of what surfaces' light is off by.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/check_points.hpp"
#include "solve/state.hpp"

namespace clrad {

/// Square per band, mean over (some of) the sensors, of the error of their irradiance that comes with the light they see
/// [W^2/m^4]. `first`, `second` [point * bands + band]: by how much the light shown at the points differs from what the solution's own
/// light brings there, measured twice with independent noise [W/m^2]. That residual is handed on from point to point as light is (form
/// factors of the points' shares of the area, by what they see of each other), until little is left, and to the sensors; `regathered`: light
/// at the vertices was gathered anew before, so that one step lies between. The points' own products say nothing of how errors add up,
/// and are taken away.
std::vector<double> seen_error_square(SolveState& state, const Solution& solution,
                                      std::span<const CheckPoint> points, std::span<const double> first,
                                      std::span<const double> second, bool regathered);

}  // namespace clrad
