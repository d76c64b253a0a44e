// What gathers at points see (kernels/solve/sensor.cl), on the device.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/solution.hpp"
#include "mesh/bend.hpp"
#include "solve/lamps.hpp"

namespace clrad {

/// Patches, what is interpolated on them, and lamps. Radiosities and emitted exitances are [band][patch], brightness [patch] (bands
/// summed), irradiance [band][vertex], bend [band][edge], rho [band][element], lamp_exitance [band][lamp].
struct Surroundings {
  std::uint32_t patches, elements, vertices, edge_count, lamp_count, depth = 0;
  PointArray corners, lamp_corners;
  RealArray shooters, irradiance, bend, rho, lamps, lamp_exitance;
  /// [0]: of everything, [1]: without what lamps emit.
  std::array<RealArray, 2> brightness, radiosity, emitted;
  Array<std::uint32_t> quads, reflects, patch_first, code, level, vertex, middle, edge;
  Edges edges;
  std::vector<double> vertex_values, edge_values;  ///< `irradiance` and `bend`
  bool any_reflects = false;
};

/// Of a solution with scene, mesh, frame, vertex and patch irradiance; `planes`: plane_ids() of the scene. With `lamps` (null: none) the irradiance
/// between vertices is without what comes straight from them.
Surroundings surroundings_of(Device& device, const Solution& solution, std::span<const std::uint32_t> planes,
                             const LampLight* lamps);

/// Other irradiance between vertices: [band][vertex], and what edges have besides, [band][edge]; empty: by the second differences of
/// vertices.
void interpolate(Surroundings& s, Device& device, const Solution& solution, std::vector<double> irradiance,
                 std::vector<double> bend = {});

}  // namespace clrad
