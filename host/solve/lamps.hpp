// What the brightest surfaces bring directly, apart from all other light: gathers ask for it anew (kernels/solve/sensor.cl).
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"

namespace clrad {

class SolveState;

struct LampLight {
  std::vector<std::uint32_t> polygons;  ///< the lamps, in file order
  std::vector<std::uint32_t> patches;   ///< of them, those that have shot
  /// [band][vertex]: the part of Solution::vertex_irradiance that comes straight from lamps and from point, spot and
  /// directional lights [W/m^2]; empty where there are neither.
  std::vector<double> vertex;
  bool interreflection = false;  ///< the solve followed light past the first surface
};

/// Polygons that emit at least `lamp_contrast` times the mean radiosity of all surfaces (bands summed), up to `most_lamps` of them; none
/// where there are more. What shines less casts shadows that a mesh shows as well as any other light.
constexpr double lamp_contrast = 4;
constexpr std::size_t most_lamps = 1024;
std::vector<std::uint32_t> lamps_of(const Solution& solution);

/// Columns of lamps that were not kept are traced again. `solution` needs scene, mesh and patch irradiance.
LampLight light_of_lamps(SolveState& state, const Solution& solution);

}  // namespace clrad
