// Near patches light a vertex by their elements.
#pragma once
#include "solve/state.hpp"

namespace clrad {

/// Corrects the irradiance of every vertex from `first` on for what patches closer than half a patch lit it with: their
/// average becomes the average of their pieces (elements, at most 64 a patch) as the vertex sees them, each piece varying as
/// its corners do. Patch averages, energy and convergence stay as they are. Only
/// shooters whose vertex column is kept, and at most 16 bands.
void gather_near_field(SolveState& state, const Solution& solution, std::uint32_t first = 0);

}  // namespace clrad
