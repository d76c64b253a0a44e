// Adaptive subdivision as the solution proceeds.
#pragma once
#include "clrad/solution.hpp"
#include "solve/state.hpp"

namespace clrad {

/// Splits the elements across which radiosity differs by more than options.adaptive.tolerance x the scene's mean reflected
/// radiosity (what is still unshot estimated), where no limit forbids it, and shoots all that was shot so far again at the
/// new vertices. Fills in Report::refinement of `solution`, whose mesh and vertex_covered are the state's. `triangles`: the
/// occluders. Once the solution has converged, elements are judged with their near field, as they will be displayed.
/// Returns whether anything was split.
bool refine(SolveState& state, Solution& solution, const std::vector<OccluderTriangle>& triangles,
            bool converged);

/// Irradiance that the unshot light would bring if it were spread evenly, per band (Cohen et al. 1988, section 3.4):
/// sum of unshot power / area x 1 / (1 - mean reflectance).
std::vector<double> ambient_irradiance(SolveState& state);

}  // namespace clrad
