// One shoot: the unshot radiosity of a patch distributed to all that it sees; and the other ways in which kept columns are
// used.
#pragma once
#include <functional>
#include <span>

#include "solve/state.hpp"

namespace clrad {

/// Takes the unshot radiosity of `patches` (none of them traced before), then traces the column of one after the other
/// (form factor x visible fraction at every vertex), keeps it, and shoots what was taken through it. Section 1.3 of
/// Drucker & Schroeder.
void shoot(SolveState& state, std::span<const std::uint32_t> patches);

/// Traces and keeps the column of `patch`; nothing is shot.
void trace(SolveState& state, std::uint32_t patch);

/// The column of `patch` at the receivers from `first` on whose flags `keep` leaves (flags of those in front, by receiver -
/// first), 0 elsewhere; overwritten by the next column. Nothing is kept or shot.
const RealArray& trace_some(SolveState& state, std::uint32_t patch, std::uint32_t first,
                            const std::function<void(Array<std::uint32_t>&)>& keep);

/// Irradiance of the vertices += column x shot[band][patch].
void deliver_column(SolveState& state, const RealArray& column, const RealArray& shot, std::uint32_t patch);

/// Shoots the unshot radiosity of every patch whose column is kept through the kept columns, at patch level; vertices get
/// it in deliver_pending().
void reshoot_kept(SolveState& state);

/// Delivers to the vertices what was shot at patch level since; columns that were not kept are traced again.
void deliver_pending(SolveState& state);

/// Shoots what every patch has shot so far again, at the vertices from `first` on only ("only the form factors between the
/// patches that have previously shot and the newly created vertices need to be recalculated", section 1.4), and averages
/// the columns over the elements as they are now. Nothing may be pending. Returns the rays it took. restate() follows.
std::uint64_t shoot_to_new(SolveState& state, std::uint32_t first);

/// The same by interpolation: vertex first + i gets the mean of parents[4 i .. 4 i + 3]. Wrong at shadows, and there to
/// show it.
void interpolate_to_new(SolveState& state, std::uint32_t first, const Array<std::uint32_t>& parents);

/// Patch irradiance and unshot radiosity anew from the kept columns and all that was ever shot (balance.cpp).
void restate(SolveState& state);

/// Patch irradiance as the mean of the vertices', for a solve without interreflection: its shots leave patches alone.
void gather_direct(SolveState& state);

/// One row of Gauss-Seidel: the radiosity of `patch` from that of all others; vertices get it in deliver_pending().
void gather_row(SolveState& state, std::uint32_t patch);

}  // namespace clrad
