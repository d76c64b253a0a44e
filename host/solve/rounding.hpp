// The rounding part of the error budget.
#pragma once
#include "solve/state.hpp"

namespace clrad {

/// Adds a bound "rounding" to the report's error: how far irradiance (so radiosity, too) at any vertex and of any patch
/// can be from what exact arithmetic would give with the same mesh, samples and shots, as a share of itself or of the
/// scene's area mean, whichever is larger; the worst band counts. Infinite (null in JSON) where the linear system
/// amplifies without a bound. Visibility is decided exactly and adds nothing.
void bound_rounding(SolveState& state, Solution& solution);

}  // namespace clrad
