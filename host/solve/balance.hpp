// The linear system of all patches: its rows, closed where the scene is, and what their sums say of the answer.
#pragma once
#include "solve/run.hpp"

namespace clrad {

/// Reflectance from which what a row lacks matters more to the balance of all than to one place: an amplification of 10. Rows
/// are closed then whatever convergence is asked, and those of vertices as well.
inline constexpr double reflects_much = 0.9;

/// Row sums of the kept columns, and from them loss, coupling and scale of each row (kernels/solve/balance.cl), closed where
/// state.balanced. Does nothing when columns have not changed since.
void set_up_rows(SolveState& state);

/// True when the row of `patch` is closed: its scene's are, and it sees at least a quarter of its hemisphere. After set_up_rows().
bool is_closed_row(const SolveState& state, std::uint32_t patch);

/// state.closes_rows and state.closes_vertices, from the scene and the options alone: not from the mesh or the way of the solve, so
/// that meshes of one scene can be compared. Rows of patches are closed in scenes proven closed: where rooms are as reflective as
/// most, that takes the mean error of irradiance down, and costs nothing at any place. Rows of vertices only where some material
/// reflects 0.9: what a vertex lacks of a far wall would be taken in proportion from its lamp, too, which is worse where direct
/// light is much of all.
void decide_closing(SolveState& state);

/// The same rule for a scene that is not meshed yet, whose materials reflect at most `reflectance`; `closed`: it is proven closed.
bool closes_rows(double reflectance, const SolveOptions& options, bool closed);
/// Of the materials without texture.
double largest_reflectance(const Scene& scene);

/// True when the rows of this scene are to be closed and are not yet.
bool can_close_rows(const SolveState& state);

/// Traces what columns are missing and closes the rows: irradiance and unshot radiosity are then those of the balance form.
/// False when the run was stopped.
bool close_rows(Run& run, double unshot_relative);

/// One cycle of GMRES on what is unshot, shot as a correction of all patches at once; then what is unshot anew. False when the
/// run was stopped: nothing has changed then, so that one that is resumed goes the same way.
bool solve_kept(Run& run, double unshot_relative);

/// At the end: vertex irradiance of closed rows (kernels/solve/balance.cl, close_vertices).
void close_vertices(SolveState& state);

/// Area mean of the row sums of form factors, each 1 at most, over the patches that face the scene; NaN where not all columns were traced.
double mean_row_sum(const SolveState& state);

/// Report::closure, and a warning (an error under --strict) where the answer depends on what rows lack more than on the
/// scene: amplification x row defect > 1, or the solver came to a stand.
void judge_rows(SolveState& state, Solution& solution);

}  // namespace clrad
