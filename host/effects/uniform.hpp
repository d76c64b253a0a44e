/// Scenes that are equally bright everywhere.
#pragma once
#include "clrad/scene.hpp"

namespace clrad {

/// True where the scene is proven closed and all surfaces have the same reflectance and emission. Every row of form factors
/// sums to 1 there (scenes of more than 20,000 polygons are not looked at), so B = E / (1 - rho) at every point solves B = E + rho F B.
bool is_uniform_enclosure(const Scene& scene);

}  // namespace clrad
