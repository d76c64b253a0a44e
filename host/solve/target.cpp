#include "solve/target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "clrad/error.hpp"
#include "mesh/build.hpp"
#include "scene/extent.hpp"
#include "solve/checkpoint.hpp"
#include "solve/sensor.hpp"
#include "solve/vertex_gather.hpp"

namespace clrad {
namespace {

using Clock = std::chrono::steady_clock;

// How the parts of the error fall with what they are made of; from `./run bench budget`. Patches sample each other's light, so that
// finer ones lessen the error of visibility, too. The orders of what sensors see are from a grid of settings at the Cornell box's points alone.
constexpr double order_of_receiving = 1.2, order_of_shooting = 1.2, order_of_samples = 0.5,
                 order_of_visibility_in_patches = 0.5, order_of_sensor_rays = 0.6,
                 order_of_seen_in_elements = 0.8, order_of_seen_in_patches = 0.4;
// Predictions are not exact: the next setting is to come out a little below the target, and well inside the time.
constexpr double aim_at_sensors = 0.85, aim_all_over = 0.9, share_of_time_left = 0.75;
// The estimate at sensors is of few points and may be too low: while there is a way to, it is brought this far below the target.
constexpr double enough_at_sensors = 0.9;
// What a sensor sees is off by this much more where the mesh is too fine for its vertices to be gathered anew.
constexpr double without_vertices = 2.5;
// The last part of a time budget: the program has to end, too.
constexpr double ending_s = 0.05;
// A next solve takes at most this many times the last one's time: what the last one said of the error is too far off beyond.
constexpr double longest_step = 12;
constexpr int most_solves = 8;
// Unshot light that makes more of the error than this share of what is aimed at is shot on, down to the second share: it is cheap,
// and how much error goes with it depends on the scene (where most light leaves, more).
constexpr double much_unshot = 0.25, little_unshot = 0.15, least_converge = 1e-7;
// A step that brings the error down by less was in vain; so many in a row are enough.
constexpr double worth_a_step = 0.9;
constexpr int most_in_vain = 2;
constexpr std::uint32_t most_samples = 1024, most_sensor_rays = 1u << 20;

struct Setting {
  double patch_edge_m = 0;
  int level = 2;  // elements are patches / 2^level
  std::uint32_t samples = 4, light_samples = 256, sensor_rays = 1024;
  double converge = INFINITY;  // at most
  double element_edge_m() const { return std::ldexp(patch_edge_m, -level); }
};

// Thrown out of a solve that will not be ready in time while there is a solution already.
struct OutOfTime {};

struct TargetErrors {
  double receiving = 0, shooting = 0, visibility = 0, unshot = 0, rest = 0;  // RMS over the scene
  double seen = 0, sampling = 0;  // at sensors: by the solution's own error, by rays
  bool at_sensors = false;
  double total() const {
    if (at_sensors) return std::hypot(seen, sampling);
    return std::sqrt(receiving * receiving + shooting * shooting + visibility * visibility + unshot * unshot +
                     rest * rest);
  }
};

bool aims_at_sensors(const SolveOptions& o) {
  return o.target_of == TargetOf::sensors || o.target_of == TargetOf::worst_sensor ||
         (o.target_of == TargetOf::automatic && !o.sensors.empty());
}

// The estimate that ends the search.
double enough(const SolveOptions& o) {
  return o.target_error * (aims_at_sensors(o) ? enough_at_sensors : 1);
}

double error_part(const Report& report, const char* name) {
  for (const ErrorPart& p : report.error.parts)
    if (p.name == name) return p.relative;
  return 0;
}

// The largest error of a sensor, relative to the mean of all.
double worst_sensor(const Solution& s) {
  double worst = 0, mean = 0, values = 0;
  for (const SensorResult& sensor : s.sensors)
    for (std::size_t b = 0; b < sensor.irradiance.size(); ++b)
      worst = std::max(worst, sensor.irradiance_error[b]), mean += sensor.irradiance[b], values += 1;
  return mean > 0 ? worst / (mean / values) : 0;
}

TargetErrors errors_of(const Solution& s, const SolveOptions& o) {
  const Report& r = s.report;
  TargetErrors e;
  e.receiving = error_part(r, "mesh-receive"), e.shooting = error_part(r, "mesh-shoot"),
  e.visibility = error_part(r, "visibility"), e.unshot = error_part(r, "convergence");
  const double known = std::hypot(std::hypot(e.receiving, e.shooting, e.visibility), e.unshot);
  e.rest = std::sqrt(std::max(0.0, r.error.total_relative * r.error.total_relative - known * known));
  e.at_sensors = aims_at_sensors(o);
  if (!e.at_sensors) return e;
  const double all = r.error.sensors_relative;
  const double scale = o.target_of == TargetOf::worst_sensor && all > 0 ? worst_sensor(s) / all : 1;
  for (const ErrorPart& p : r.error.sensor_parts)
    (p.name == "sensor rays" ? e.sampling : e.seen) = scale * p.relative;
  return e;
}

// A few points say what a mesh is off by, and one of them can be most of it: what the last step foretold counts as much.
TargetErrors tempered(const TargetErrors& found, const TargetErrors& foretold) {
  TargetErrors e = found;
  for (double TargetErrors::*part :
       {&TargetErrors::receiving, &TargetErrors::shooting, &TargetErrors::visibility, &TargetErrors::seen})
    e.*part = (found.*part + foretold.*part) / 2;
  return e;
}

// What a solve took, of what mesh.
struct Cost {
  double shooting_s = 0, sensors_s = 0;
  MeshSize mesh;
  MeshSize before;       // without backs and subdivision, as candidates are counted
  double uncovered = 1;  // of the vertices
  std::uint64_t sensors = 0;
  double unshot_relative = 0;
  double total() const { return shooting_s + sensors_s; }
};

// A candidate's mesh with as much more of everything as the last one had in the end.
MeshSize grown(const Cost& now, MeshSize mesh) {
  for (double MeshSize::*count :
       {&MeshSize::patches, &MeshSize::elements, &MeshSize::vertices, &MeshSize::edges})
    if (now.before.*count > 0) mesh.*count *= now.mesh.*count / (now.before.*count);
  return mesh;
}

double rays_at_vertices(const Cost& now, const MeshSize& mesh, const Setting& setting) {
  return rays_at_vertices(mesh, now.uncovered, now.sensors, setting.sensor_rays);
}

// Edges of elements and patches go by their numbers: polygons are cut into whole ones.
TargetErrors predicted(const TargetErrors& now, const Setting& at, const Cost& cost, const Setting& next,
                       const MeshSize& mesh) {
  const double elements = std::sqrt(cost.mesh.elements / mesh.elements),
               patches = std::sqrt(cost.mesh.patches / mesh.patches);
  const double samples = double(next.samples) / at.samples, rays = double(next.sensor_rays) / at.sensor_rays;
  TargetErrors e = now;
  e.receiving *= std::pow(elements, order_of_receiving);
  e.shooting *= std::pow(patches, order_of_shooting);
  e.visibility *= std::pow(samples, -order_of_samples) * std::pow(patches, order_of_visibility_in_patches);
  e.sampling *= std::pow(rays, -order_of_sensor_rays);
  // Sensors see means over surfaces, which patches' sizes matter less for; noise has the share in it that it has all over.
  const double before = std::hypot(now.receiving, now.shooting, now.visibility),
               noise = before > 0 ? std::pow(now.visibility / before, 2) : 0,
               less_noise = now.visibility > 0 ? e.visibility / now.visibility : 1;
  // Where light is not gathered anew at vertices, rays end in averages of patches, and finer elements are no help.
  const bool before_regathers = rays_at_vertices(cost, cost.mesh, at) > 0,
             regathers = rays_at_vertices(cost, mesh, next) > 0;
  double finer = std::pow(patches, order_of_seen_in_patches);
  if (regathers) finer *= std::pow(elements, order_of_seen_in_elements);
  if (before_regathers != regathers) finer *= regathers ? 1 / without_vertices : without_vertices;
  e.seen *= std::sqrt((1 - noise) * finer * finer + noise * less_noise * less_noise);
  return e;
}

// Rays from sensors and from vertices, where light is gathered anew there. A fixed part is for launches.
double gather_work(const Cost& now, const MeshSize& mesh, const Setting& setting) {
  constexpr double launches = 1e5;
  return launches + double(now.sensors) * (setting.sensor_rays + mesh.patches) +
         rays_at_vertices(now, mesh, setting);
}

// Columns are patches x vertices, with a ray a sample, and some launches for each patch whatever its size.
double predicted_seconds(const Cost& now, const Setting& at, const Setting& next, const MeshSize& mesh) {
  constexpr double launches = 15000, ray = 0.15;  // of a column, in vertices; of a sample, in vertices
  const auto column = [&](double vertices, std::uint32_t samples) {
    return launches + vertices * (1 + ray * samples);
  };
  const double shooting = now.shooting_s * (mesh.patches * column(mesh.vertices, next.samples)) /
                          (now.mesh.patches * column(now.mesh.vertices, at.samples));
  const double sensors = now.sensors_s * gather_work(now, mesh, next) / gather_work(now, now.mesh, at);
  return shooting + sensors;
}

// None where a polygon would have more patches along one side than can be numbered.
std::optional<MeshSize> size_of_mesh(const Scene& scene, const Setting& setting) {
  try {
    return count_mesh(scene, {setting.patch_edge_m, setting.element_edge_m()});
  } catch (const UsageError&) {
    return std::nullopt;
  }
}

// All settings that are as fine as `at`, and a little finer at a time, and how large a mesh they have.
template <class Visit>
void each_finer(const Scene& scene, const Setting& at, bool sensors, Visit visit) {
  for (int p = 0; p <= 24; ++p)
    for (int level = std::max(1, at.level - 3); level <= std::min(5, at.level + 3); ++level) {
      Setting meshed = at;
      meshed.patch_edge_m = at.patch_edge_m * std::exp2(-p / 8.0), meshed.level = level;
      if (meshed.element_edge_m() > at.element_edge_m() * 1.001) continue;
      const std::optional<MeshSize> mesh = size_of_mesh(scene, meshed);
      if (!mesh) return;
      for (std::uint32_t samples = 1; samples <= 64; samples *= 4)
        for (std::uint32_t rays = 1; rays <= (sensors ? 1024u : 1u); rays *= 2) {
          Setting next = meshed;
          next.samples *= samples, next.light_samples *= samples, next.sensor_rays *= rays;
          if (next.samples > most_samples || next.sensor_rays > most_sensor_rays) continue;
          visit(next, *mesh);
        }
    }
}

// Less unshot light, where that makes much of the error; says whether. At sensors it is part of what they see, and not told apart.
bool shoot_on(Setting& setting, TargetErrors& errors, double unshot_relative, double target) {
  const double aim = target > 0 ? target : errors.total();
  if (errors.at_sensors || errors.unshot <= much_unshot * aim) return false;
  const double converge = unshot_relative * little_unshot * aim / errors.unshot;
  if (converge < least_converge) return false;
  setting.converge = converge;
  errors.unshot = little_unshot * aim;
  return true;
}

struct NextSetting {
  Setting setting;
  TargetErrors errors;  // these and the rest foretold
  double error, seconds;
};

// Steps of a time budget: where the next one may not take all that is left, it is the one in the middle of two that grow alike, so that
// another after it still fits in.
double longest_of_budget(const Cost& cost, double seconds_left) {
  const double growth = seconds_left * share_of_time_left / cost.total();
  return growth > longest_step ? std::min(longest_step, std::sqrt(growth)) : longest_step;
}

std::optional<NextSetting> next_setting(const Scene& scene, TargetErrors errors, Setting at, const Cost& cost,
                                        double target, double seconds_left, double longest = longest_step) {
  const double before = errors.total();
  const bool again = shoot_on(at, errors, cost.unshot_relative, target);
  const double aim = target * (errors.at_sensors ? aim_at_sensors : aim_all_over);
  std::optional<NextSetting> best;
  double best_cost = 0;
  const double most_seconds = std::min(seconds_left * share_of_time_left, longest * cost.total());
  each_finer(scene, at, errors.at_sensors, [&](const Setting& next, const MeshSize& counted) {
    const MeshSize mesh = grown(cost, counted);
    if (!again && counted.patches == cost.before.patches && counted.elements == cost.before.elements &&
        next.samples == at.samples && next.sensor_rays == at.sensor_rays)
      return;
    const double seconds = predicted_seconds(cost, at, next, mesh);
    if (seconds > most_seconds) return;
    const TargetErrors then = predicted(errors, at, cost, next, mesh);
    const double error = then.total();
    const bool meets = target > 0 && error <= aim, best_meets = target > 0 && best && best->error <= aim;
    if (!meets && error > (target > 0 ? 0.75 : 0.9) * before) return;
    // Where none meets the target: the most for the time.
    const double cost_of_error = target > 0 ? error * std::pow(seconds, 0.4) : error;
    const bool better = !best                 ? true
                        : meets != best_meets ? meets
                        : meets               ? seconds < best->seconds
                                              : cost_of_error < best_cost;
    if (better) best = NextSetting{next, then, error, seconds}, best_cost = cost_of_error;
  });
  return best;
}

SolveOptions with_setting(const SolveOptions& options, const Setting& setting) {
  SolveOptions o = options;
  o.target_error = 0, o.time_budget_s = 0, o.error = true;
  // What is left unshot is to be no part of the error to speak of.
  if (options.target_error > 0) o.converge = std::min(o.converge, 0.1 * options.target_error);
  o.converge = std::min(o.converge, setting.converge);
  o.mesh.patch_edge_m = setting.patch_edge_m;
  o.mesh.element_edge_m = setting.element_edge_m();
  o.samples = setting.samples, o.light_samples = setting.light_samples, o.sensor_rays = setting.sensor_rays;
  return o;
}

// A fresh run starts coarse, or at the size of patches and elements that was asked for; one that goes on from a
// checkpoint, with what that was of.
Setting first_setting(const Scene& scene, const SolveOptions& o) {
  Setting s;
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

double sensor_seconds(const Report& report) {
  for (const StageProfile& stage : report.stages)
    if (stage.name == "gather at sensors") return stage.seconds;
  return 0;
}

// `sensors_before`: what earlier solves of this device took at sensors, since its profile goes on; grows.
Cost cost_of(const Scene& scene, const Solution& s, double seconds, double& sensors_before) {
  Cost cost;
  cost.sensors_s = sensor_seconds(s.report) - sensors_before;
  sensors_before += cost.sensors_s;
  cost.shooting_s = std::max(1e-4, seconds - cost.sensors_s);
  const auto covered = std::count(s.vertex_covered.begin(), s.vertex_covered.end(), 1);
  cost.before = count_mesh(scene, {s.mesh.patch_edge_m, s.mesh.element_edge_m});
  const double elements = double(s.mesh.elements.size()), vertices = s.vertex_count();
  cost.mesh = {double(s.mesh.patches.size()), elements, vertices,
               vertices + elements - double(s.scene.polygons.size())};
  cost.uncovered = 1 - double(covered) / double(std::max(1u, s.vertex_count()));
  cost.sensors = s.sensors.size();
  cost.unshot_relative = s.unshot_relative;
  return cost;
}

// What ends within the time.
double budget_of(const SolveOptions& o) {
  return o.time_budget_s > 0 ? std::max(0.5 * o.time_budget_s, o.time_budget_s - ending_s) : INFINITY;
}

// Kernels are loaded by the coarsest solve that there is, so that the next one's time says what finer ones take.
bool starts_coarser(const SolveOptions& o) {
  return o.resume.empty() && o.mesh.patch_edge_m <= 0;
}
Setting coarser(Setting s) {
  s.patch_edge_m *= 2, s.level = 1;
  return s;
}

}  // namespace

TargetForecast foretell_target(const Scene& scene, const SolveOptions& asked, const SolveOnce& solve_once) {
  // Nothing is written, and nothing gone on with: these solves are tries.
  SolveOptions options = asked;
  options.checkpoint.clear(), options.resume.clear();
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  std::vector<Setting> settings{first_setting(scene, options)};
  if (starts_coarser(options)) settings.insert(settings.begin(), coarser(settings[0]));
  TargetForecast result;
  double sensors_before = 0;
  for (const Setting& setting : settings) {
    SolveOptions probe = with_setting(options, setting);
    const double began = elapsed();
    const Solution s = solve_once(probe);
    const TargetErrors errors = errors_of(s, options);
    const Cost cost = cost_of(scene, s, elapsed() - began, sensors_before);
    result.options = std::move(probe);
    result.error_relative = errors.total();
    result.probing_seconds = result.seconds = elapsed();
    if (s.stopped || (options.target_error > 0 && errors.total() <= enough(options))) break;
    if (&setting != &settings.back()) continue;
    // All in one step, as solve_to_target() would by way of a few that take little of the time.
    const auto next =
        next_setting(scene, errors, setting, cost, enough(options), budget_of(options) - elapsed(), INFINITY);
    if (!next) break;
    result.options = with_setting(options, next->setting);
    result.error_relative = next->error;
    result.seconds += next->seconds;
  }
  result.meets = options.target_error <= 0 || result.error_relative <= options.target_error;
  return result;
}

Solution solve_to_target(const Scene& scene, const SolveOptions& options, const SolveOnce& solve_once) {
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  const double budget = budget_of(options);
  const bool sensors = aims_at_sensors(options);
  Setting setting = first_setting(scene, options);
  std::optional<Setting> first;
  if (starts_coarser(options)) first = setting, setting = coarser(setting);
  std::optional<Solution> best;
  std::vector<TargetStep> steps;
  std::optional<TargetErrors> foretold;  // of the setting at hand
  double foretold_error = NAN, foretold_seconds = NAN;
  int in_vain = 0;
  std::string why;  // it ended before the target was met
  double sensors_before = 0, error = INFINITY, finishing = 0;
  for (int step = 0; step < most_solves; ++step) {
    SolveOptions o = with_setting(options, setting);
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
    const double began = elapsed();
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
    const double seconds = elapsed() - began;
    const TargetErrors errors = errors_of(*solution, options);
    const Cost cost = cost_of(scene, *solution, seconds, sensors_before);
    const bool stopped = solution->stopped, helped = errors.total() < worth_a_step * error;
    if (!stopped || !best)
      steps.push_back({setting.patch_edge_m, setting.element_edge_m(), setting.samples, setting.light_samples,
                       setting.sensor_rays, o.converge, errors.total(), seconds, foretold_error,
                       foretold_seconds});
    // What was stopped is short of light, whatever its estimate says of the rest.
    if (!best || (!stopped && errors.total() < error)) error = errors.total(), best = std::move(solution);
    if (stopped) {
      why = "it was stopped";
      break;
    }
    if (options.target_error > 0 && error <= enough(options)) break;
    // All over, the estimate of a mesh hangs on too few points to tell.
    in_vain = helped || !sensors ? 0 : in_vain + 1;
    if (in_vain == most_in_vain) {
      why = "finer settings hardly helped";
      break;
    }
    if (first) {
      setting = *first, first.reset();
      continue;
    }
    const TargetErrors planned = foretold ? tempered(errors, *foretold) : errors;
    const double left = budget - elapsed();
    const auto next = next_setting(scene, planned, setting, cost, enough(options), left,
                                   options.target_error > 0 ? longest_step : longest_of_budget(cost, left));
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
