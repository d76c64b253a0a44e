// Everything that can light a point, for gathers: patches, and their elements.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/form_factor.hpp"

namespace clrad {

/// [band][node], from vertex and patch irradiance: a node's radiosity is that of its exposed part. Node i < patches is patch i, node
/// patches + e is element e.
std::vector<double> node_radiosity(const Solution& solution);

/// Patches as kernels/solve/sensor.cl reads them.
struct PatchNodes {
  std::vector<Point> corners;    // 4 a patch; a triangle repeats its last
  std::vector<double> shooters;  // shooter_record() of each
};
PatchNodes patch_nodes(const Solution& solution);

}  // namespace clrad
