// Where sensors look: points of the surfaces at which the light that they see is checked.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/solution.hpp"
#include "mesh/random.hpp"
#include "solve/check_points.hpp"
#include "solve/sensor.hpp"
#include "solve/state.hpp"

namespace clrad {

/// Some of the sensors, evenly chosen.
std::vector<Point> some_sensors(const SensorGather& gathered);

/// [origin * points + point]: 1 where nothing is in the way.
std::vector<std::uint8_t> sees(SolveState& state, const std::vector<Point>& origins,
                               const std::vector<Point>& points);

/// About `count` points where rays from some of the sensors end, and some of `spread`, which points_in_elements() drew, in the order of their elements. Each
/// one's weight is the share of the surfaces that it stands for, with as many to a surface as both ways of drawing bring there
/// (the balance heuristic of Veach & Guibas 1995): a wall beside a sensor, half of what it sees, is small pieces.
std::vector<CheckPoint> seen_points(SolveState& state, const Solution& solution, const SensorGather& gathered,
                                    std::span<const CheckPoint> spread, std::uint32_t count,
                                    std::uint64_t seed, Random& random);

}  // namespace clrad
