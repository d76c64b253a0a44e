// Irradiance at points from a solution's own light, to check the solution by.
#pragma once
#include <span>
#include <vector>

#include "clrad/solution.hpp"
#include "clrad/visibility.hpp"
#include "solve/lights.hpp"

namespace clrad {

class Glass;

/// A check is not to be what decides how much memory a solve takes.
constexpr std::uint64_t most_check_bytes = 64 << 20;

/// How to gather.
struct CheckGather {
  const PointArray* points = nullptr;  ///< frame
  std::uint32_t rays = 64;             ///< about, from a point
  std::uint64_t seed = 1;
  bool flat = false;  ///< patches have that same radiosity everywhere
};

/// H at points by the solution's own radiosities, lamps and all, one way after the other: [point * bands + band]. With the same seed, flat or
/// not, the same rays. `shot`: the radiosity [band][patch] that patches have shot, of which B between vertices is a variation [W/m^2];
/// `reflecting`: it is, else B is that everywhere.
std::vector<std::vector<double>> gather_for_check(Device& device, const Solution& solution,
                                                  VisibilityEngine& engine, std::span<const double> shot,
                                                  bool reflecting, std::span<const CheckGather> ways,
                                                  const Glass* glass = nullptr, Lights* lights = nullptr);

/// H at points [point * bands + band] of patches that have that `radiosity` [band][patch] everywhere, W/m^2; it may be negative.
std::vector<double> gather_of_patches(Device& device, const Solution& solution, VisibilityEngine& engine,
                                      std::span<const double> radiosity, const CheckGather& way,
                                      const Glass* glass = nullptr);

}  // namespace clrad
