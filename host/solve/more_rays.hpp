// More rays at sensors, where a target wants for nothing else.
#pragma once
#include <cstdint>

#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "solve/sensor.hpp"

namespace clrad {

/// The RMS error by rays at sensors falls with their number to this power (`./run bench targets --steps`).
constexpr double order_of_sensor_rays = 0.6;

/// No setting has more.
constexpr std::uint32_t most_sensor_rays = 1u << 20;

/// How many rays from each sensor should bring its estimated error down to options.target_error, a power of two times
/// options.sensor_rays; 0: those that are there do, or what sensors see is too wrong for any number, or the target is of the worst sensor, or they
/// would take more than `seconds_left` where those that are there took `seconds`.
std::uint32_t rays_for_target(const Solution& solution, const SolveOptions& options,
                              const SensorGather& gathered, double seconds, double seconds_left);

}  // namespace clrad
