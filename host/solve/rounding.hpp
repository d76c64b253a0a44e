// The rounding part of the error budget.
#pragma once
#include "solve/state.hpp"

namespace clrad {

/// Adds a bound "rounding" to the report's error: how far irradiance (so radiosity, too) at any vertex and of any patch
/// can be from what exact arithmetic would give with the same mesh, samples and shots, as a share of itself or of the
/// scene's area mean, whichever is larger; the worst band counts. Infinite (null in JSON) where the linear system
/// amplifies without a bound. Visibility is decided exactly and adds nothing. It is about the scene as this precision holds its
/// coordinates: a vertex that these put in the plane of a polygon that touches its own (the foot of a block on the lattice of
/// the floor) sees all of that polygon or nothing, and which of the two their last bit says.
void bound_rounding(SolveState& state, Solution& solution);

}  // namespace clrad
