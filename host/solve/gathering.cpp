// Gathering, for comparison: every column is traced before anything is known of the light, then the linear system is
// relaxed (Goral et al. 1984; section 1.2 of Drucker & Schroeder).
#include "solve/balance.hpp"
#include "solve/run.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// False when the run was stopped.
bool trace_all(Run& run) {
  SolveState& state = run.state;
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    if (state.slot_of_patch[p] != 0xffffffffu) continue;
    double most = 0;
    for (std::uint32_t b = 0; b < state.bands; ++b)
      most = std::max({most, state.reflectance(b, p), state.material(p).emitted_exitance[b]});
    if (!(most > 0) || !(state.exposed[p] > 0)) continue;
    if (!run.goes_on(1)) return false;
    trace(state, p);
  }
  return true;
}

void sweep(SolveState& state) {
  if (state.options.solver == Solver::gathering) return reshoot_kept(state);
  set_up_rows(state);
  const auto stage = state.device.stage("gather at one patch after the other");
  for (const std::uint32_t patch : state.patch_of_slot) gather_row(state, patch);
  state.reshoots += state.patch_of_slot.size();
  restate(state);
}

}  // namespace

bool gather_until_converged(Run& run) {
  SolveState& state = run.state;
  if (!trace_all(run)) return false;
  for (;;) {
    const double unshot = unshot_relative(state);
    if (!run.goes_on(unshot)) return false;
    const bool converged = unshot < state.options.converge;
    if (can_close_rows(state)) {
      if (!close_rows(run, unshot)) return false;
      continue;
    }
    if (run.refined(converged)) continue;
    if (converged) return true;
    sweep(state);
  }
}

}  // namespace clrad
