// What sensors see of what surfaces' light is off by.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/check_points.hpp"
#include "solve/sensor.hpp"
#include "solve/state.hpp"

namespace clrad {

/// By how much what sensors' rays find at points differs from what the same rays would bring there, measured twice with independent noise,
/// [point * bands + band], W/m^2.
struct Residual {
  std::vector<double> first, second;
};

/// At `points`, each with about `rays` rays, in `gathered.around`, which is as it was afterwards. 0 where something covers a point.
Residual residual_of_seen(SolveState& state, const Solution& solution, SensorGather& gathered,
                          std::span<const CheckPoint> points, std::uint32_t rays, std::uint64_t seed);

/// Square per band, mean over (some of) the sensors, of the error of their irradiance that comes with the light they see [W^2/m^4]: the
/// residual is handed on from point to point as light is (form factors of the points' shares of the area, by what they see of each
/// other) until little is left, and what it has come to is gathered at the sensors. Errors at so few points do not average out
/// as much as those of the whole surfaces would, so that it is rather too high.
std::vector<double> seen_error_square(SolveState& state, const Solution& solution,
                                      const std::vector<Point>& sensors, std::span<const CheckPoint> points,
                                      const Residual& residual);

}  // namespace clrad
