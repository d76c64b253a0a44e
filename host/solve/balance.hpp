// The linear system of all patches: its rows, closed where the scene is, and what their sums say of the answer.
#pragma once
#include "solve/run.hpp"

namespace clrad {

/// Row sums of the kept columns, and from them loss, coupling and scale of each row (kernels/solve/balance.cl), closed where
/// state.balanced. Does nothing when columns have not changed since.
void set_up_rows(SolveState& state);

/// True when the row of `patch` is closed: its scene's are, and it sees at least a quarter of its hemisphere. After set_up_rows().
bool is_closed_row(const SolveState& state, std::uint32_t patch);

/// True when the rows of this scene should be closed, are not yet, and can be: every exposed patch has its column, or
/// reflectances amplify so much that tracing the missing ones (of dark patches) is worth it.
bool can_close_rows(const SolveState& state);

/// Traces what columns are missing and closes the rows: irradiance and unshot radiosity are then those of the balance form.
/// False when the run was stopped.
bool close_rows(Run& run, double unshot_relative);

/// One cycle of GMRES on what is unshot, shot as a correction of all patches at once; then what is unshot anew.
void solve_kept(SolveState& state);

/// At the end: vertex irradiance of closed rows (kernels/solve/balance.cl, close_vertices).
void close_vertices(SolveState& state);

/// Report::closure, and a warning (an error under --strict) where the answer depends on what rows lack more than on the
/// scene: amplification x row defect > 1, or the solver came to a stand.
void judge_rows(SolveState& state, Solution& solution);

}  // namespace clrad
