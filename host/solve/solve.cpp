// A solve from scene to solution: mesh, what is covered, one of the solvers, then what is gathered from its result.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>

#include "clrad/effects.hpp"
#include "clrad/solver.hpp"
#include "device/working_time.hpp"
#include "effects/colour.hpp"
#include "mesh/average.hpp"
#include "mesh/build.hpp"
#include "mesh/texture.hpp"
#include "mesh/touch.hpp"
#include "scene/enclosure.hpp"
#include "scene/planes.hpp"
#include "scene/range.hpp"
#include "scene/texture.hpp"
#include "solve/accuracy.hpp"
#include "solve/balance.hpp"
#include "solve/check_options.hpp"
#include "solve/checkpoint.hpp"
#include "solve/clip.hpp"
#include "solve/covered.hpp"
#include "solve/invariants.hpp"
#include "solve/lamps.hpp"
#include "solve/more_rays.hpp"
#include "solve/near_field.hpp"
#include "solve/next_setting.hpp"
#include "solve/refine.hpp"
#include "solve/rounding.hpp"
#include "solve/run.hpp"
#include "solve/sensor.hpp"
#include "solve/shoot.hpp"
#include "solve/target.hpp"
#include "solve/transmission.hpp"
#include "visibility/chop.hpp"
#include "visibility/engine_tree.hpp"
#include "visibility/open.hpp"

namespace clrad {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::unique_ptr<VisibilityEngine> engine_for(Device& device, bool occlusion,
                                             const std::vector<OccluderTriangle>& triangles,
                                             const SolveOptions& options) {
  if (!occlusion) return make_open(device);
  const std::string name = options.engine == "auto" ? "shaft" : options.engine;
  if (name != "chop") return make_engine(name, device, triangles);
  return make_chop(device, triangles, {.rays_per_batch = options.rays_per_batch, .cells = options.grid});
}

std::uint64_t host_peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::uint64_t(usage.ru_maxrss) * 1024;
}

// Why this engine, and what it chose itself.
std::string engine_account(const SolveOptions& o, const VisibilityEngine& engine) {
  if (engine.name() == "none") return "no surface can stand between two others, or occlusion was left out";
  std::string why = o.engine == "auto" ? "auto: the fastest on every scene measured" : "asked for";
  if (const std::string own = engine.account(); !own.empty()) why += "; " + own;
  return why;
}

// What was left out that the scene calls for, as part of the error and as a warning.
void note_left_out(Report& report) {
  for (const Effect& effect : report.effects) {
    if (!effect.needed || effect.runs) continue;
    const double error = effect.skip_error_relative;
    report.error.parts.push_back({"without " + effect.name, error >= 0 ? error : NAN, false});
    report.warnings.push_back(fmt::format("{} was left out, but: {}; {}", effect.name, effect.reason,
                                          error >= 0
                                              ? fmt::format("the error is up to {:.2g} of all light", error)
                                              : "--compare with a solution that has it measures the error"));
  }
}

void write_down_options(const Device& device, const SolveOptions& o, const Mesh& mesh,
                        const VisibilityEngine& engine, Report& report) {
  const char* estimators[] = {"disk", "subdisk", "exact"};
  const char* solvers[] = {"progressive", "gathering", "gauss-seidel"};
  report.options = {
      {"engine", engine.name()},
      {"engine_account", engine_account(o, engine)},
      {"form_factor", estimators[int(o.estimator)]},
      {"samples", fmt::to_string(o.samples)},
      {"light_samples", fmt::to_string(o.light_samples)},
      {"converge", fmt::to_string(o.converge)},
      {"solver", solvers[int(o.solver)]},
      {"closure", o.closure == Closure::on    ? "on"
                  : o.closure == Closure::off ? "off"
                                              : "auto"},
      {"shooters", fmt::to_string(o.shooters)},
      {"adaptive", fmt::to_string(o.adaptive.tolerance)},
      {"seed", fmt::to_string(o.seed)},
      {"patch_edge_m", fmt::to_string(mesh.patch_edge_m)},
      {"element_edge_m", fmt::to_string(mesh.element_edge_m)},
      {"precision", device.options().precision == Precision::float64 ? "double" : "float"},
      {"cores", fmt::to_string(device.options().cores)},
      {"memory_bytes", fmt::to_string(device.options().memory_bytes)},
      {"work_group_size", fmt::to_string(device.options().work_group_size)},
      {"packet_width", fmt::to_string(device.options().packet_width)},
  };
}

bool scene_needs(std::span<const Effect> effects, std::string_view name) {
  return std::any_of(effects.begin(), effects.end(),
                     [&](const Effect& e) { return e.name == name && e.needed; });
}

// Light that passes glass is neither kept in nor accounted for, so what is closed by it or holds it is open.
Enclosure opened_by_glass(const Scene& scene) {
  const Polygon& first = scene.polygons[glass_polygons(scene).at(0)];
  return {false, fmt::format("light passes the glass \"{}\" at {}", first.name, first.where.text())};
}

void warn_of_specular(const SolveState& state, Report& report) {
  const auto& polygons = state.scene.polygons;
  const bool mirrors = std::any_of(polygons.begin(), polygons.end(), [&](const Polygon& p) {
    const std::vector<double>& s = state.scene.materials[p.material].specular;
    return std::any_of(s.begin(), s.end(), [](double share) { return share > 0; });
  });
  if (mirrors)
    report.warnings.emplace_back(
        "light that reaches diffuse surfaces by way of mirrors is not solved; pictures follow mirrors");
  if (state.through_glass && state.options.closure == Closure::on)
    report.warnings.emplace_back(
        "--closure on: rows of form factors are left as they are, since glass takes a share of the light");
}

// The bands of `scene`, all at once.
Solution solve_bands(Device& device, const Scene& scene, const SolveOptions& options,
                     const std::vector<Effect>& effects, const WorkingTime& building) {
  Solution solution;
  solution.scene = scene;
  solution.bands = std::uint32_t(scene.bands.size());
  solution.frame = frame_with_sensors(scene, options.sensors);
  const std::vector<std::uint32_t> planes = plane_ids(scene);
  std::unique_ptr<Checkpoint> resumed;
  if (!options.resume.empty()) resumed = std::make_unique<Checkpoint>(options.resume, device, scene, options);
  if (!resumed) solution.mesh = build_mesh(scene, solution.frame, planes, options.mesh);
  auto triangles = occluder_triangles(scene, solution.frame, planes);
  std::unique_ptr<Glass> glass;
  if (runs(effects, "transmission")) {
    glass = std::make_unique<Glass>(device, scene, triangles);
    triangles = without_glass(scene, triangles);
  }

  const bool occlusion = runs(effects, "occlusion");
  const auto engine = engine_for(device, occlusion, triangles, options);
  std::optional<EngineTree> tree;
  if (occlusion) tree.emplace(device, *engine, triangles);
  if (resumed) {
    resumed->read_mesh(solution);
  } else {
    if (occlusion) move_off_touched(device, scene, solution.frame, **tree, solution.mesh);
    const auto overlaid = overlaid_vertices(scene, solution.mesh);
    if (occlusion)
      solution.vertex_covered = covered_vertices(device, scene, solution.mesh, triangles, *engine, overlaid);
    else  // nothing stands on anything: only what lies in the same plane covers
      solution.vertex_covered.assign(overlaid.begin(), overlaid.end());
    std::vector<std::uint32_t> all(solution.mesh.elements.size());
    std::iota(all.begin(), all.end(), 0u);
    weigh_exposed(device, scene, solution.mesh, triangles, *engine, solution.vertex_covered, all);
    average_by_parents(solution.mesh, solution.vertex_covered);
  }

  SolveState state(device, scene, solution.mesh, solution.bands, *engine, options, solution.vertex_covered,
                   solution.frame.metres(), glass.get(),
                   runs(effects, "textures") ? &solution.textured : nullptr);
  state.occlusion = occlusion;
  state.interreflection = runs(effects, "interreflection");
  state.through_glass = glass && scene_needs(effects, "transmission");
  std::optional<Clip> clip;
  if (options.visibility_exact && occlusion && !glass) clip.emplace(device, **tree);
  state.tree = occlusion ? &**tree : nullptr;
  state.clip = clip ? &*clip : nullptr;
  state.enclosure = state.through_glass ? opened_by_glass(scene) : find_enclosure(scene);
  decide_closing(state);
  solution.report.seconds.build = building.seconds();
  const WorkingTime shooting(device);
  Run run{state, solution, triangles, Clock::now()};
  if (runs(effects, "lights")) state.direct = std::make_unique<LitByLights>(state, solution.frame, planes);
  if (resumed) {
    resumed->read_state(run);
    light_resumed(state);
  } else {
    light_first(state);
  }
  resumed.reset();
  run.next_checkpoint = run.seconds() + options.checkpoint_every_s;
  // Without interreflection there is no linear system to gather through.
  const bool shoots = options.solver == Solver::progressive || !state.interreflection;
  const bool converged = shoots ? shoot_until_converged(run) : gather_until_converged(run);
  solution.stopped = !converged;
  if (!options.checkpoint.empty()) run.keep_checkpoint();
  deliver_pending(state);
  close_vertices(state);
  if (!state.interreflection) gather_direct(state);
  solution.ambient = ambient_irradiance(state);
  solution.vertex_irradiance = state.vertex_irradiance.download();
  solution.patch_irradiance = state.patch_irradiance.download();
  const std::vector<double> before_near_field = solution.vertex_irradiance;
  if (options.near_field) {
    gather_near_field(state, solution);
    solution.vertex_irradiance = state.vertex_irradiance.download();
  }
  SensorGather gathered;
  double gathering_s = 0;
  if (!options.sensors.empty()) {
    gathered.lamps = light_of_lamps(state, solution);
    const auto begin = Clock::now();
    solution.sensors = gather_at_sensors(device, solution, planes, *engine, options, gathered, glass.get(),
                                         state.direct ? &state.direct->lights : nullptr);
    gathering_s = since(begin);
  }
  solution.report.seconds.solve = shooting.seconds();

  Report& report = solution.report;
  report.effects = effects;
  report.shoots = state.shoots;
  report.reshoots = state.reshoots;
  const VisibilityCounts counts = run.counts();
  report.rays = counts.rays, report.pieces = counts.pieces, report.candidates = counts.candidates,
  report.exact_tests = counts.exact;
  report.device = device.info();
  write_down_options(device, options, solution.mesh, *engine, report);
  account_energy(state, solution);
  if (clip) report.options.emplace_back("visibility_exact", clip->account());
  if (options.visibility_exact && glass)
    report.warnings.emplace_back(
        "--visibility-exact: shooters are sampled all the same, since what glass lets pass depends on the "
        "way "
        "through it; --without transmission makes glass opaque");
  check_invariants(state, solution);
  judge_rows(state, solution);
  warn_of_specular(state, report);
  if (state.direct) warn_of_lights(*state.direct, report.warnings);
  if (has_textures(scene) && runs(effects, "textures"))
    report.error.parts.push_back({"texture within patches", texture_correlation(solution), false});
  bound_rounding(state, solution);
  note_left_out(report);
  report.sensor_rays = options.sensor_rays;
  if (!options.error) return solution;
  const std::vector<double> seen = estimate_error(state, solution, before_near_field, gathered);
  const double left = options.time_budget_s > 0 ? options.time_budget_s - run.seconds() : INFINITY;
  if (const std::uint32_t rays = rays_for_target(solution, options, gathered, gathering_s, left)) {
    SolveOptions with_more = options;
    report.sensor_rays = with_more.sensor_rays = rays;
    const std::uint64_t before = engine->counts().rays;
    solution.sensors = gather_again(device, solution, *engine, with_more, gathered, glass.get(),
                                    state.direct ? &state.direct->lights : nullptr);
    report.rays += engine->counts().rays - before;
    total_at_sensors(solution, seen);
  }
  return solution;
}

// The threshold by which elements are judged where subdivision is forced on and none was asked for.
constexpr double forced_tolerance = 0.05;

// The options by which the effects that have some run, or do not.
SolveOptions as_planned(SolveOptions options, const std::vector<Effect>& effects) {
  options.near_field = runs(effects, "near_field");
  double& tolerance = options.adaptive.tolerance;
  if (!runs(effects, "subdivision"))
    tolerance = 0;
  else if (!(tolerance > 0))
    tolerance = forced_tolerance;
  return options;
}

// The solve with these very options.
Solution solve_once(Device& device, const Scene& given, const SolveOptions& options) {
  const auto start = Clock::now();
  const WorkingTime building(device);
  const std::vector<Effect> effects = plan_effects(given, options);
  Scene scene = given;
  if (has_textures(scene) && !runs(effects, "textures")) scene = with_mean_colours(std::move(scene));
  if (runs(effects, "two_sided")) scene = with_backs(std::move(scene));
  const SolveOptions chosen = as_planned(options, effects);
  Solution solution;
  if (runs(effects, "colour") || scene.bands.size() == 1) {
    solution = solve_bands(device, scene, chosen, effects, building);
  } else if (const std::vector<double> factors = band_factors(scene); !factors.empty()) {
    solution = solve_bands(device, one_band(scene, factors), chosen, effects, building);
    spread_over_bands(solution, scene, factors);
  } else {
    solution = solve_bands(device, without_colour(scene), chosen, effects, building);
  }
  Report& report = solution.report;
  report.stages = device.profile();
  for (const Effect& effect : effects) charge(report.effects, effect.name, report.stages);
  report.device_peak_bytes = device.ledger()->peak;
  report.host_peak_bytes = host_peak_bytes();
  report.seconds.total = since(start);
  return solution;
}

}  // namespace

namespace {

void check_all(const Scene& scene, const SolveOptions& options) {
  check_options(options);
  require_range(scene);
  require_sensors_near(scene, options.sensors);
  // Not with the options: a command line has those before it has read the sensors.
  const bool of_sensors =
      options.target_of == TargetOf::sensors || options.target_of == TargetOf::worst_sensor;
  if (of_sensors && options.sensors.empty())
    throw UsageError("--target-of sensors or max, but there are no sensors");
}

}  // namespace

Solution solve(Device& device, const Scene& scene, const SolveOptions& options) {
  check_all(scene, options);
  if (options.target_error > 0 || options.time_budget_s > 0)
    return solve_to_target(device, scene, options,
                           [&](const SolveOptions& o) { return solve_once(device, scene, o); });
  return solve_once(device, scene, options);
}

TargetForecast forecast(Device& device, const Scene& scene, const SolveOptions& options) {
  check_all(scene, options);
  if (!(options.target_error > 0 || options.time_budget_s > 0))
    throw UsageError("a forecast needs --target-error or --time-budget");
  return foretell_target(device, scene, options,
                         [&](const SolveOptions& o) { return solve_once(device, scene, o); });
}

}  // namespace clrad
