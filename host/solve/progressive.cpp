// The loop of progressive radiosity: shoot the brightest patch until little is unshot (Cohen et al. 1988; section 1.3 of
// Drucker & Schroeder).
#include <algorithm>

#include "clrad/primitives.hpp"
#include "solve/run.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// The patches with the most unshot power, at most options.shooters of them, and how much all have, in float on the device.
struct Brightest {
  std::vector<std::uint32_t> patches;
  double unshot_relative;
};
Brightest select(SolveState& state) {
  const auto stage = state.device.stage("select the patch with the most unshot power");
  Brightest result{{}, unshot_relative(state)};
  if (state.options.shooters == 1) {
    const ArgMax best = argmax_float(state.device, state.power.buffer(), state.patches);
    if (best.index != 0xffffffffu) result.patches.push_back(best.index);
    return result;
  }
  Array<std::uint32_t> keys(state.device, state.patches, "patches by power"),
      order(state.device, state.patches, "patches by power");
  state.device.run("solve/select.cl", "rank_power", state.patches, state.power, keys, order, state.patches);
  radix_sort(state.device, keys.buffer(), order.buffer(), state.patches);
  result.patches = order.download(0, std::min(state.options.shooters, state.patches));
  return result;
}

}  // namespace

double unshot_relative(SolveState& state) {
  state.device.run("solve/select.cl", "unshot_power", state.patches, state.unshot, state.patch_area,
                   state.power, state.patches, state.bands);
  const double unshot = reduce_sum_float(state.device, state.power.buffer(), state.patches);
  return state.emitted_power > 0 ? unshot / state.emitted_power : 0;
}

bool shoot_until_converged(Run& run) {
  SolveState& state = run.state;
  for (;;) {
    Brightest brightest = select(state);
    if (!run.goes_on(brightest.unshot_relative)) return false;
    const bool converged = brightest.unshot_relative < state.options.converge || brightest.patches.empty();
    if (run.refined(converged)) continue;
    if (converged) return true;
    const auto kept = [&](std::uint32_t patch) { return state.slot_of_patch[patch] != 0xffffffffu; };
    if (kept(brightest.patches.front())) {
      reshoot_kept(state);
      continue;
    }
    std::erase_if(brightest.patches, kept);
    shoot(state, brightest.patches);
  }
}

}  // namespace clrad
