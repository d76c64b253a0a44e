#include "solve/run.hpp"

#include <algorithm>
#include <cmath>

#include "solve/checkpoint.hpp"
#include "solve/refine.hpp"

namespace clrad {
namespace {

// Unshot power falls about exponentially, so its logarithm is extrapolated; early on there is nothing to go by.
double seconds_left(double seconds, double unshot, double goal) {
  if (unshot <= goal) return 0;
  if (!(unshot < 0.5) || seconds < 0.5) return -1;
  return seconds * std::log(unshot / goal) / std::log(1 / unshot);
}

}  // namespace

double Run::seconds() const {
  return seconds_before + std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

VisibilityCounts Run::counts() const {
  VisibilityCounts all = state.engine.counts();
  all.rays += counts_before.rays;
  all.pieces += counts_before.pieces;
  all.candidates += counts_before.candidates;
  all.exact += counts_before.exact;
  return all;
}

void Run::keep_checkpoint() {
  const double before = seconds();
  write_checkpoint(state.options.checkpoint, *this);
  const double after = seconds();
  next_checkpoint = after + std::max(state.options.checkpoint_every_s, 19 * (after - before));
}

bool Run::goes_on(double unshot_relative) {
  solution.unshot_relative = unshot_relative;
  if (!state.options.checkpoint.empty() && seconds() >= next_checkpoint) keep_checkpoint();
  if (!state.options.progress) return true;
  const Progress progress{"shoot", state.shoots, unshot_relative, seconds(),
                          seconds_left(seconds(), unshot_relative, state.options.converge)};
  return state.options.progress(progress);
}

bool Run::refined(bool converged) {
  const AdaptiveOptions& adaptive = state.options.adaptive;
  if (!(adaptive.tolerance > 0) || (!converged && state.shoots_since_refined < adaptive.every)) return false;
  return refine(state, solution, triangles, converged);
}

}  // namespace clrad
