// How large a scene is.
#pragma once
#include "clrad/scene.hpp"

namespace clrad {

/// Longest side of the box around all polygons [m]; -infinity where there are none.
double extent_m(const Scene& scene);

}  // namespace clrad
