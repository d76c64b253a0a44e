#include "solve/target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "clrad/error.hpp"
#include "device/working_time.hpp"
#include "effects/effects.hpp"
#include "scene/extent.hpp"
#include "solve/checkpoint.hpp"
#include "solve/next_setting.hpp"

namespace clrad {
namespace {

using Clock = std::chrono::steady_clock;

// The last part of a time budget: the program has to end, too.
constexpr double ending_s = 0.05;
constexpr int most_solves = 8;
// Where sensors are all that is asked for, what unshot light is short of is not told apart; it takes next to no time with columns that are kept.
constexpr double converge_at_sensors = 1e-5;
// A step that brings the error down by less was in vain; so many in a row are enough.
constexpr double worth_a_step = 0.9;
constexpr int most_in_vain = 2;
// Thrown out of a solve that will not be ready in time while there is a solution already.
struct OutOfTime {};

// One solve with it, which has so many seconds. What it is a step to says whether more points or rays help.
SolveOptions with_setting(const SolveOptions& options, const SolveSetting& setting, double seconds_left) {
  SolveOptions o = options;
  o.target_error = aims_at_sensors(options) ? enough(options) : 0, o.error = true;
  o.time_budget_s = std::isfinite(seconds_left) ? std::max(1e-3, seconds_left) : 0;
  // What is left unshot is to be no part of the error to speak of.
  if (options.target_error > 0)
    o.converge = std::min(o.converge, 0.1 * options.target_error);
  else if (aims_at_sensors(options))
    o.converge = std::min(o.converge, converge_at_sensors);
  o.converge = std::min(o.converge, setting.converge);
  o.mesh.patch_edge_m = setting.patch_edge_m;
  o.mesh.element_edge_m = setting.element_edge_m();
  o.samples = setting.samples, o.light_samples = setting.light_samples, o.sensor_rays = setting.sensor_rays;
  return o;
}

// A fresh run starts coarse, or at the size of patches and elements that was asked for; one that goes on from a
// checkpoint, with what that was of.
SolveSetting first_setting(const Scene& scene, const SolveOptions& o) {
  SolveSetting s;
  if (!o.resume.empty()) {
    const CheckpointSettings c = settings_of_checkpoint(o.resume);
    s.patch_edge_m = c.patch_edge_m;
    s.level = int(std::lround(std::log2(c.patch_edge_m / c.element_edge_m)));
    s.samples = c.samples, s.light_samples = c.light_samples;
    return s;
  }
  s.patch_edge_m = o.mesh.patch_edge_m > 0 ? o.mesh.patch_edge_m : extent_m(scene) / 4;
  if (o.mesh.element_edge_m > 0)
    s.level = std::max(0, int(std::ceil(std::log2(s.patch_edge_m / o.mesh.element_edge_m) - 1e-9)));
  else if (aims_at_sensors(o))
    s.level = 1;
  s.samples = o.samples, s.light_samples = o.light_samples;
  return s;
}

// What ends within the time.
double budget_of(const SolveOptions& o) {
  return o.time_budget_s > 0 ? std::max(0.5 * o.time_budget_s, o.time_budget_s - ending_s) : INFINITY;
}

// A coarse solve tells what takes time and what errs. All over, its estimate hangs on too few points to go by alone.
bool starts_coarser(const SolveOptions& o) {
  return o.resume.empty() && o.mesh.patch_edge_m <= 0;
}
SolveSetting coarser(SolveSetting s) {
  s.patch_edge_m *= 2, s.level = 1;
  return s;
}
// What meets a target of 1 % in a plain room, finer for a smaller one: many rooms are done with that. Where something stands in the way light
// varies within patches before it does between them. Edges are cut into whole patches: by root two at a time most walls come out even.
SolveSetting coarsest_for(SolveSetting s, double target, bool occlusion) {
  const auto halvings = [&](double met, double order) {
    return order * std::max(0.0, std::log2(met / target));
  };
  const double patches = std::min(2.0, std::round(2 * halvings(0.01, occlusion ? 0.6 : 0.3)) / 2),
               elements = occlusion ? halvings(0.05, 0.45) : patches;
  s = coarser(s);
  s.patch_edge_m *= std::exp2(-patches);
  s.level += std::max(0, int(elements - patches));
  s.sensor_rays <<= std::lround(2 * patches);
  return s;
}
std::vector<SolveSetting> first_settings(const Scene& scene, const SolveOptions& o) {
  SolveSetting first = first_setting(scene, o);
  if (!starts_coarser(o)) return {first};
  if (!aims_at_sensors(o)) return {coarser(first), first};
  const bool occlusion = plan_occlusion(scene, o).needed;
  // Meshes that are coarse enough for sensors take next to no time more by more samples.
  if (occlusion) first.samples *= 4, first.light_samples *= 4;
  if (!(o.target_error > 0) || o.mesh.element_edge_m > 0) return {coarser(first), first};
  return {o.time_budget_s > 0 ? coarser(first) : coarsest_for(first, o.target_error, occlusion)};
}

}  // namespace

TargetForecast foretell_target(Device& device, const Scene& scene, const SolveOptions& asked,
                               const SolveOnce& solve_once) {
  // Nothing is written, and nothing gone on with: these solves are tries.
  SolveOptions options = asked;
  options.checkpoint.clear(), options.resume.clear();
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  const std::vector<SolveSetting> settings = first_settings(scene, options);
  StageSeconds before = stage_seconds(device.profile());
  WorkingTime time(device);
  TargetForecast result;
  for (const SolveSetting& setting : settings) {
    SolveOptions probe = with_setting(options, setting, budget_of(options) - elapsed());
    time.restart();
    const Solution s = solve_once(probe);
    const TargetErrors errors = errors_of(s, options);
    const SolveCost cost = cost_of(scene, s, time.seconds(), before);
    probe.sensor_rays = s.report.sensor_rays;
    result.options = std::move(probe);
    result.error_relative = errors.total();
    result.probing_seconds = result.seconds = elapsed();
    if (s.stopped || (options.target_error > 0 && errors.total() <= enough(options))) break;
    if (&setting != &settings.back()) continue;
    SolveSetting solved = setting;
    solved.sensor_rays = s.report.sensor_rays;
    // In one step; solve_to_target() goes there by way of those that are no longer than they may be.
    const auto next =
        next_setting(scene, errors, solved, cost, enough(options), budget_of(options) - elapsed(), INFINITY);
    if (!next) break;
    result.options = with_setting(options, next->setting, INFINITY);
    result.error_relative = next->error;
    result.seconds += next->seconds;
  }
  result.options.target_error = 0, result.options.time_budget_s = 0;
  result.meets = options.target_error <= 0 || result.error_relative <= options.target_error;
  return result;
}

Solution solve_to_target(Device& device, const Scene& scene, const SolveOptions& options,
                         const SolveOnce& solve_once) {
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  const double budget = budget_of(options);
  const bool sensors = aims_at_sensors(options);
  const std::vector<SolveSetting> first = first_settings(scene, options);
  SolveSetting setting = first[0];
  StageSeconds before = stage_seconds(device.profile());
  WorkingTime time(device);
  std::optional<Solution> best;
  std::vector<TargetStep> steps;
  std::optional<TargetErrors> foretold;  // of the setting at hand
  double foretold_error = NAN, foretold_seconds = NAN;
  int in_vain = 0;
  std::string why;  // it ended before the target was met
  double error = INFINITY, best_judged = INFINITY, finishing = 0;
  for (int step = 0; step < most_solves; ++step) {
    SolveOptions o = with_setting(options, setting, budget - elapsed());
    if (step > 0) o.resume.clear();
    o.progress = [&, step](const Progress& p) {
      Progress shown = p;
      shown.stage = fmt::format("step {}: {}", step + 1, p.stage);
      shown.seconds = elapsed();
      if (options.progress && !options.progress(shown)) return false;
      if (elapsed() < budget - finishing) return true;
      if (best) throw OutOfTime();
      return false;
    };
    time.restart();
    std::optional<Solution> solution;
    try {
      solution = solve_once(o);
    } catch (const OutOfTime&) {
      why = "the time was up";
    } catch (const MemoryError& e) {
      if (!best) throw;
      why = fmt::format("a finer mesh does not fit into memory ({})", e.what());
    } catch (const Error&) {
      // What is there is good enough but for the distance kept.
      if (!(options.target_error > 0 && error <= options.target_error)) throw;
    }
    if (!solution) break;
    const double seconds = time.seconds();
    setting.sensor_rays = solution->report.sensor_rays;
    const TargetErrors errors = errors_of(*solution, options);
    const SolveCost cost = cost_of(scene, *solution, seconds, before);
    const bool stopped = solution->stopped, helped = errors.total() < worth_a_step * error;
    if (!stopped || !best)
      steps.push_back({setting.patch_edge_m, setting.element_edge_m(), setting.samples, setting.light_samples,
                       setting.sensor_rays, o.converge, errors.total(), seconds, foretold_error,
                       foretold_seconds});
    // What was stopped is short of light, whatever its estimate says of the rest. Where no target is to be met what was foretold counts as much as
    // the estimate, below which a few points say little.
    const double judged = sensors && foretold && !(options.target_error > 0)
                              ? std::sqrt(errors.total() * foretold_error)
                              : errors.total();
    if (!best || (!stopped && judged < best_judged))
      error = errors.total(), best_judged = judged, best = std::move(solution);
    if (stopped) {
      why = "it was stopped";
      break;
    }
    if (options.target_error > 0 && error <= enough(options)) break;
    // All over, the estimate of a mesh hangs on too few points to tell.
    in_vain = helped || !sensors || !(options.target_error > 0) ? 0 : in_vain + 1;
    if (in_vain == most_in_vain) {
      why = "finer settings hardly helped";
      break;
    }
    if (std::size_t(step) + 1 < first.size()) {
      setting = first[std::size_t(step) + 1];
      continue;
    }
    const TargetErrors planned = foretold ? tempered(errors, *foretold) : errors;
    const double left = budget - elapsed();
    const auto next =
        next_setting(scene, planned, setting, cost, enough(options), left,
                     options.target_error > 0 ? longest_of_target(sensors) : longest_of_budget(cost, left));
    if (!next) {
      why = std::isfinite(budget) ? "nothing finer fits into the time" : "nothing finer would help";
      break;
    }
    // What comes after the shots (near field, sensors, this estimate) has to fit in, too.
    const double growth = next->seconds / cost.total();
    finishing = std::min(0.3 * (budget - elapsed()), 0.25 * seconds * growth);
    foretold = next->errors;
    foretold_error = next->error, foretold_seconds = next->seconds;
    setting = next->setting;
  }
  Report& report = best->report;
  report.target.error_relative = options.target_error, report.target.time_budget_s = options.time_budget_s;
  report.target.at_sensors = sensors;
  report.target.met = options.target_error <= 0 || error <= options.target_error;
  report.target.steps = std::move(steps);
  report.seconds.total = elapsed();
  if (!report.target.met)
    report.warnings.push_back(fmt::format(
        "the error is {:.3g} %, not the {:.3g} % that were asked for: {}", 100 * error,
        100 * options.target_error, why.empty() ? fmt::format("{} settings were tried", most_solves) : why));
  return std::move(*best);
}

}  // namespace clrad
