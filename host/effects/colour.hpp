/// Scenes whose bands are multiples of each other are solved in one.
#pragma once
#include <optional>
#include <vector>

#include "clrad/scene.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Per band, its emission divided by that of the strongest; empty where reflectances differ between bands or emission is not
/// proportional (to 4 roundings of a double).
std::vector<double> band_factors(const Scene& scene);

/// The scene in its strongest band alone.
Scene one_band(const Scene& scene, const std::vector<double>& factors);

/// The scene in grey: reflectances, emission and shares are means over bands, of red, green and blue by their luminance.
Scene without_colour(const Scene& scene);

/// The solution of `scene` from that of its one band: everything that is linear in emission, times the factor of each band.
void spread_over_bands(Solution& solution, const Scene& scene, const std::vector<double>& factors);

}  // namespace clrad
