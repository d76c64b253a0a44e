// A solve from scene to solution: mesh, what is covered, one of the solvers, then what is gathered from its result.
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <numeric>

#include "clrad/effects.hpp"
#include "clrad/solver.hpp"
#include "mesh/average.hpp"
#include "mesh/build.hpp"
#include "mesh/texture.hpp"
#include "scene/enclosure.hpp"
#include "scene/planes.hpp"
#include "scene/range.hpp"
#include "scene/texture.hpp"
#include "solve/balance.hpp"
#include "solve/check_options.hpp"
#include "solve/checkpoint.hpp"
#include "solve/covered.hpp"
#include "solve/invariants.hpp"
#include "solve/near_field.hpp"
#include "solve/refine.hpp"
#include "solve/rounding.hpp"
#include "solve/run.hpp"
#include "solve/sensor.hpp"
#include "solve/shoot.hpp"
#include "visibility/chop.hpp"

namespace clrad {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::unique_ptr<VisibilityEngine> engine_for(Device& device, const std::string& name,
                                             const std::vector<OccluderTriangle>& triangles,
                                             const SolveOptions& options) {
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
  std::string why = o.engine == "auto" ? "auto: the fastest on every scene measured" : "asked for";
  if (const std::string own = engine.account(); !own.empty()) why += "; " + own;
  return why;
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

}  // namespace

Solution solve(Device& device, const Scene& given, const SolveOptions& options) {
  check_options(options);
  require_range(given);
  require_sensors_near(given, options.sensors);
  const auto start = Clock::now();
  const std::vector<Effect> effects = plan_effects(given, options);
  Solution solution;
  solution.scene = given;
  const Scene& scene = solution.scene;
  if (has_textures(scene) && !runs(effects, "textures"))
    solution.scene = with_mean_colours(std::move(solution.scene));
  if (runs(effects, "two_sided")) solution.scene = with_backs(std::move(solution.scene));
  solution.bands = std::uint32_t(scene.bands.size());
  solution.frame = frame_with_sensors(scene, options.sensors);
  const std::vector<std::uint32_t> planes = plane_ids(scene);
  std::unique_ptr<Checkpoint> resumed;
  if (!options.resume.empty()) resumed = std::make_unique<Checkpoint>(options.resume, device, scene, options);
  if (!resumed) solution.mesh = build_mesh(scene, solution.frame, planes, options.mesh);
  const auto triangles = occluder_triangles(scene, solution.frame, planes);

  const auto engine =
      engine_for(device, options.engine == "auto" ? "shaft" : options.engine, triangles, options);
  if (resumed) {
    resumed->read_mesh(solution);
  } else {
    solution.vertex_covered = covered_vertices(device, scene, solution.mesh, triangles, *engine,
                                               overlaid_vertices(scene, solution.mesh));
    std::vector<std::uint32_t> all(solution.mesh.elements.size());
    std::iota(all.begin(), all.end(), 0u);
    weigh_exposed(device, scene, solution.mesh, triangles, *engine, solution.vertex_covered, all);
    average_by_parents(solution.mesh, solution.vertex_covered);
  }

  SolveState state(device, scene, solution.mesh, solution.bands, *engine, options, solution.vertex_covered,
                   solution.frame.metres(), runs(effects, "textures") ? &solution.textured : nullptr);
  state.enclosure = find_enclosure(scene);
  decide_closing(state);
  solution.report.seconds.build = since(start);
  const auto shooting = Clock::now();
  Run run{state, solution, triangles, shooting};
  if (resumed) resumed->read_state(run);
  resumed.reset();
  run.next_checkpoint = run.seconds() + options.checkpoint_every_s;
  const bool converged =
      options.solver == Solver::progressive ? shoot_until_converged(run) : gather_until_converged(run);
  solution.stopped = !converged;
  if (!options.checkpoint.empty()) run.keep_checkpoint();
  deliver_pending(state);
  close_vertices(state);
  solution.ambient = ambient_irradiance(state);
  solution.vertex_irradiance = state.vertex_irradiance.download();
  solution.patch_irradiance = state.patch_irradiance.download();
  if (options.near_field) {
    gather_near_field(state, solution);
    solution.vertex_irradiance = state.vertex_irradiance.download();
  }
  solution.sensors = gather_at_sensors(device, solution, planes, *engine, options);
  solution.report.seconds.solve = since(shooting);

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
  check_invariants(state, solution);
  judge_rows(state, solution);
  if (has_specular(scene))
    report.warnings.emplace_back(
        "diffuse light that arrives by way of mirrors or through glass is not solved: to the solve they "
        "are opaque, and only their diffuse part reflects; pictures follow them");
  report.error.parts.push_back({"convergence", solution.unshot_relative, false});
  if (has_textures(scene) && runs(effects, "textures"))
    report.error.parts.push_back({"texture within patches", texture_correlation(solution), false});
  bound_rounding(state, solution);
  report.error.total_relative = NAN;  // the other parts are not estimated yet
  report.stages = device.profile();
  report.device_peak_bytes = device.ledger()->peak;
  report.host_peak_bytes = host_peak_bytes();
  report.seconds.total = since(start);
  return solution;
}

}  // namespace clrad
