// One shoot: the unshot radiosity of one patch distributed to all that it sees.
#pragma once
#include "solve/state.hpp"

namespace clrad {

/// Traces the column of `patch` (form factor x visible fraction at every vertex), keeps it, and shoots the patch's unshot
/// radiosity through it. Section 1.3 of Drucker & Schroeder.
void shoot(SolveState& state, std::uint32_t patch);

/// Shoots the unshot radiosity of every patch whose column is kept through the kept columns, at patch level; vertices get
/// it in deliver_pending().
void reshoot_kept(SolveState& state);

/// Delivers to the vertices what reshoot_kept() shot since; columns that were not kept are traced again.
void deliver_pending(SolveState& state);

}  // namespace clrad
