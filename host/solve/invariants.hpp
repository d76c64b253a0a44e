// What must hold of every solve, checked at its end and reported with its size.
#pragma once
#include "clrad/solution.hpp"
#include "solve/state.hpp"

namespace clrad {

/// Emitted, absorbed and unshot power per band, and what is unaccounted for: in a closed scene the discretisation error
/// of point form factors, in an open one also what left. Fills Report::energy.
void account_energy(SolveState& state, Solution& solution);

/// Row sums, 0 <= F <= 1, reciprocity and energy; violations go to Report::warnings, or throw DeviceError when
/// options.strict. Fills Report::invariants.
void check_invariants(SolveState& state, Solution& solution);

}  // namespace clrad
