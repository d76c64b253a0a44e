// The sizes and powers that single precision holds.
#pragma once
#include <string>
#include <vector>

#include "clrad/options.hpp"
#include "clrad/scene.hpp"

namespace clrad {

/// Kernels work in the scene's frame, but hold areas in m^2 and powers in W, in float unless --precision says else. From
/// largest_exitance x largest_extent_m^2 = 1e35 W (a thousand such surfaces to float's 3.4e38) down to smallest_exitance x
/// (smallest_extent_m / 1000)^2 = 1e-36 W (float's full precision ends at 1.2e-38) all of them are normal numbers.
constexpr double smallest_extent_m = 1e-10, largest_extent_m = 1e10;
constexpr double smallest_exitance = 1e-10, largest_exitance = 1e15;  ///< of what emits [W/m^2 or lm/m^2]

/// Point and spot lights stand within this many frame units of the scene's middle: 0.5 to 1 million times its longest side.
constexpr double farthest_light = 0x1p20;

/// Adds an error for the scene's extent (rule "extent") and each emission (rule "emission") outside these, and for lights:
/// rule "light-intensity" where I / (frame unit)^2, or the irradiance of a directional one, is outside the range of
/// exitances, rule "light-position" where one is too far away.
void check_range(const Scene& scene, std::vector<Diagnostic>& findings);

/// Throws InputError of the first of these.
void require_range(const Scene& scene);

/// Throws InputError of the first sensor that is farther from the scene than visibility reaches: 2^33 times its frame, which
/// is once to twice its longest side. `file`: where they come from, for the message; may be empty.
void require_sensors_near(const Scene& scene, const std::vector<Sensor>& sensors,
                          const std::string& file = "");

}  // namespace clrad
