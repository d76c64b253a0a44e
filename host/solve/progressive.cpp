// The loop of progressive radiosity: shoot the brightest patch until little is unshot (Cohen et al. 1988; section 1.3 of
// Drucker & Schroeder).
#include <algorithm>

#include "clrad/primitives.hpp"
#include "solve/balance.hpp"
#include "solve/run.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// Of each patch: state.power.
void unshot_power(SolveState& state) {
  state.device.run("solve/select.cl", "unshot_power", state.patches, state.unshot, state.patch_area,
                   state.power, state.patches, state.bands);
}

double share_of_emitted(const SolveState& state, double power) {
  return state.emitted_power > 0 ? power / state.emitted_power : 0;
}

// The patches with the most unshot power, at most options.shooters of them, and how much all have, in float on the device.
struct Brightest {
  std::vector<std::uint32_t> patches;
  double unshot_relative;
};
Brightest select(SolveState& state) {
  const auto stage = state.device.stage("select the patch with the most unshot power");
  if (state.options.shooters == 1) {
    unshot_power(state);
    const auto [unshot, most] = sum_and_argmax_float(state.device, state.power.buffer(), state.patches);
    if (most.index == 0xffffffffu) return {{}, share_of_emitted(state, unshot)};
    return {{most.index}, share_of_emitted(state, unshot)};
  }
  Brightest result{{}, unshot_relative(state)};
  Array<std::uint32_t> keys(state.device, state.patches, "patches by power"),
      order(state.device, state.patches, "patches by power");
  state.device.run("solve/select.cl", "rank_power", state.patches, state.power, keys, order, state.patches);
  radix_sort(state.device, keys.buffer(), order.buffer(), state.patches);
  result.patches = order.download(0, std::min(state.options.shooters, state.patches));
  return result;
}

// The patches without a column that have light to shoot, the brightest first, at most options.shooters of them.
std::vector<std::uint32_t> brightest_unseen(SolveState& state) {
  const std::vector<float> power = state.power.download();
  std::vector<std::uint32_t> patches;
  for (std::uint32_t p = 0; p < state.patches; ++p)
    if (state.slot_of_patch[p] == 0xffffffffu && power[p] > 0) patches.push_back(p);
  std::stable_sort(patches.begin(), patches.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return power[a] > power[b]; });
  patches.resize(std::min<std::size_t>(patches.size(), state.options.shooters));
  return patches;
}

// Sweeps over kept columns go on while each leaves less than this share; then new columns are worth more.
constexpr double sweep_pays = 0.7;
// Cycles of the solver that leave more than half before it is given up: rounding or the rows are in the way.
constexpr std::uint32_t most_stalls = 3;

// Once the only light left is that of patches with columns, the linear system of these is solved instead of shooting
// it again and again, which would take 1 / (1 - rho) sweeps.
enum class Rest { solved, stalled, stopped };
Rest solve_rest(Run& run, double unshot) {
  SolveState& state = run.state;
  if (state.stalls >= most_stalls) return Rest::stalled;
  if (!solve_kept(run, unshot)) return Rest::stopped;
  const bool stalled = !(unshot_relative(state) < 0.5 * unshot);
  state.stalls = stalled ? state.stalls + 1 : 0;
  return Rest::solved;
}

}  // namespace

double unshot_relative(SolveState& state) {
  unshot_power(state);
  return share_of_emitted(state, reduce_sum_float(state.device, state.power.buffer(), state.patches));
}

bool shoot_until_converged(Run& run) {
  SolveState& state = run.state;
  for (;;) {
    Brightest brightest = select(state);
    if (!run.goes_on(brightest.unshot_relative)) return false;
    const double unshot = brightest.unshot_relative;
    const bool converged = unshot < state.options.converge || brightest.patches.empty();
    const auto kept = [&](std::uint32_t patch) { return state.slot_of_patch[patch] != 0xffffffffu; };
    std::vector<std::uint32_t> unseen;
    const bool again = !converged && kept(brightest.patches.front());
    if (again) unseen = brightest_unseen(state);
    const bool shot_all = again && unseen.empty();
    if ((converged || shot_all) && can_close_rows(state)) {
      if (!close_rows(run, unshot)) return false;
      continue;
    }
    if (run.refined(converged)) continue;
    if (converged) return true;
    if (shot_all) {
      const Rest rest = solve_rest(run, unshot);
      if (rest != Rest::solved) return rest == Rest::stalled;
    } else if (again && unshot < sweep_pays * state.unshot_before_sweep) {
      state.unshot_before_sweep = unshot;
      reshoot_kept(state);
    } else {
      if (again) brightest.patches = unseen;
      std::erase_if(brightest.patches, kept);
      shoot(state, brightest.patches);
      state.unshot_before_sweep = 1e9;
    }
  }
}

}  // namespace clrad
