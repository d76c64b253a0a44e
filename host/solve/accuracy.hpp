// What a solve is off by, measured on itself: its irradiance against careful gathers of its own light at some points.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/sensor.hpp"
#include "solve/state.hpp"

namespace clrad {

/// Fills in report.error (all but "rounding" and what effects add, which are there already) and each sensor's
/// irradiance_error. `before_near_field`: vertex irradiance [band][vertex] as the columns alone gave it. `gathered`: how sensors
/// were. After energy is accounted for and sensors are gathered.
///
/// At some vertices and at some points inside elements, more of both where it varies, light is gathered anew, twice over, with samples of
/// its own: exact form factors, near patches by their elements. What a vertex differs by from that is what samples, form
/// factors and patches' averages do; what the interpolated value inside an element differs by has what the elements do, besides.
/// Products of the differences from the two gathers have no noise of the gathers on average. The gathers take the
/// solution's own radiosities, so that an error that is the same everywhere comes back with every reflection: the mean difference
/// counts by the scene's amplification of light.
/// Returns the squares per band of what sensors are off by with the light that they see [W^2/m^4]; empty: there are no sensors, or nothing
/// to check.
std::vector<double> estimate_error(SolveState& state, Solution& solution,
                                   const std::vector<double>& before_near_field, SensorGather& gathered);

/// Fills in report.error's sensors_relative and sensor_parts, and adds `seen`, as estimate_error() returns it, to what their rays are off by.
void total_at_sensors(Solution& solution, const std::vector<double>& seen);

}  // namespace clrad
