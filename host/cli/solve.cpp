#include <fmt/format.h>

#include <chrono>
#include <memory>

#include "cli/cli.hpp"
#include "cli/outputs.hpp"
#include "cli/progress.hpp"
#include "scene/range.hpp"
#include "solve/check_options.hpp"

namespace clrad::cli {
namespace {

struct SolveArguments {
  std::string scene, sensors, estimator = "exact", grid, solver = "progressive", closure = "auto";
  OutputArguments outputs;
  DeviceArguments device;
  SidesArguments sides;
  SolveOptions solve;
  bool quiet = false;
};

void add_arguments(CLI::App& verb, SolveArguments& a) {
  verb.add_option("scene", a.scene, "OBJ, glTF or GLB file")->required();
  a.outputs.add_views_to(verb, "picture.png, scene.glb, scene.vtu, solution.clrad and report.json");
  a.outputs.add_results_to(verb);
  verb.add_option("--sensors", a.sensors, "irradiance at points: a file of `x y z nx ny nz` lines");
  a.sides.add_to(verb);
  a.device.add_to(verb);
  verb.add_option("--seed", a.solve.seed, "of the samples' places")->capture_default_str();
  verb.add_flag("--quiet", a.quiet, "no progress, no summary");
  verb.add_flag("--strict", a.solve.strict, "a violated invariant is an error");

  const char* accuracy = "Accuracy";
  verb.add_option("--engine", a.solve.engine,
                  "visibility: auto, serial, chop or shaft; all give the same bits")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--grid", a.grid,
                  "voxels of the engine chop, such as 8x8x8 (default: by cost; one voxel in a small scene)")
      ->group(accuracy);
  verb.add_option("--batch", a.solve.rays_per_batch,
                  "rays that the engine chop handles at a time (default: its own choice)")
      ->group(accuracy);
  verb.add_option("--form-factor", a.estimator,
                  "exact (contour formula), subdisk (Wallace), disk (as the 1992 paper prints it)")
      ->check(CLI::IsMember({"exact", "subdisk", "disk"}))
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--samples", a.solve.samples, "rays from a receiver to a shooter")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--light-samples", a.solve.light_samples,
                  "shooters get more rays until one carries no more than 1/N of the light")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--sensor-rays", a.solve.sensor_rays, "rays from a sensor")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--converge", a.solve.converge, "stop when unshot / emitted power is below")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--patch-edge", a.solve.mesh.patch_edge_m,
                  "longest edge of a patch, which shoots [m] (default: extent / 8)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);
  verb.add_option("--element-edge", a.solve.mesh.element_edge_m,
                  "longest edge of an element, which receives [m] (default: extent / 64)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);

  verb.add_flag("!--no-near-field", a.solve.near_field,
                "light vertices by the average of a patch however near it is")
      ->group(accuracy);

  const char* solving = "Solving";
  verb.add_option(
          "--solver", a.solver,
          "progressive (shoots), gathering or gauss-seidel (trace every column first): the same answer")
      ->check(CLI::IsMember({"progressive", "gathering", "gauss-seidel"}))
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--shooters", a.solve.shooters,
                  "of the progressive solver: choose the K brightest patches at a time")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(solving);

  verb.add_option("--closure", a.closure,
                  "make rows of form factors sum to 1: auto (where the scene is proven closed), on (it is "
                  "closed), off")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--checkpoint", a.solve.checkpoint,
                  "keep the state of the solve in this file while it runs")
      ->group(solving);
  verb.add_option("--checkpoint-every", a.solve.checkpoint_every_s,
                  "least seconds between two; they never take more than 5 % of the time")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--resume", a.solve.resume,
                  "go on from a checkpoint of the same scene: the same bits as without a break")
      ->check(CLI::ExistingFile)
      ->group(solving);

  const char* adaptive = "Adaptive subdivision";
  verb.add_option(
          "--adaptive", a.solve.adaptive.tolerance,
          "split elements across which radiosity differs by more than this x the scene's mean, such as 0.05 "
          "(default: never)")
      ->check(CLI::PositiveNumber)
      ->group(adaptive);
  verb.add_option("--max-level", a.solve.adaptive.max_level, "splits of an element of the first mesh")
      ->capture_default_str()
      ->group(adaptive);
  verb.add_option("--min-area", a.solve.adaptive.min_area_m2, "no smaller elements [m2]")
      ->check(CLI::NonNegativeNumber)
      ->group(adaptive);
  verb.add_option("--min-projected-area", a.solve.adaptive.min_projected_area_px,
                  "no smaller elements in the picture [pixels]; what it does not show is not split")
      ->check(CLI::NonNegativeNumber)
      ->group(adaptive);
  verb.add_option("--refine-every", a.solve.adaptive.every, "shoots between refinements")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(adaptive);
  verb.add_flag("--interpolate-new", a.solve.adaptive.interpolate_new,
                "give new vertices the mean of their neighbours instead of shooting to them: shows the error "
                "that makes")
      ->group(adaptive);
}

void print_summary(const Solution& s) {
  const Report& r = s.report;
  const char* unit = s.scene.quantity == Quantity::photometric ? "lm" : "W";
  double emitted = 0, absorbed = 0, unshot = 0;
  for (std::uint32_t b = 0; b < s.bands; ++b)
    emitted += r.energy.emitted[b], absorbed += r.energy.absorbed[b], unshot += r.energy.unshot[b];
  fmt::print("{}: {} polygons, {} patches, {} elements, {} vertices\n", s.scene.file, s.scene.polygons.size(),
             s.mesh.patches.size(), s.mesh.elements.size(), s.vertex_count());
  fmt::print("{} shoots and {} re-shoots, {} rays on {}\n", r.shoots, r.reshoots, r.rays, r.device.name);
  if (const auto& f = r.refinement; f.refinements > 0 || f.stopped_by_memory > 0) {
    fmt::print("{} refinements split {} elements and added {} vertices, {} rays to these\n", f.refinements,
               f.elements_split, f.vertices_added, f.rays);
    fmt::print(
        "still over the tolerance: {} at the maximum level, {} at the minimum area, {} at the minimum "
        "projected "
        "area, {} for want of memory, {} as the last few\n",
        f.stopped_by_max_level, f.stopped_by_min_area, f.stopped_by_min_projected_area, f.stopped_by_memory,
        f.left_as_few);
  }
  fmt::print("\n");
  fmt::print("{:<52} {:>9} {:>9}\n", "where the time went", "launches", "seconds");
  for (const auto& stage : r.stages)
    fmt::print("  {:<50} {:>9} {:>9.3f}\n", stage.name, stage.launches, stage.seconds);
  fmt::print("  {:<50} {:>9} {:>9.3f}\n", "all, by the clock", "", r.seconds.total);
  fmt::print("\nwhere the light went   emitted {:.4g} {}, absorbed {:.2f} %, unshot {:.3g} %, {} {:.2f} %\n",
             emitted, unit, 100 * absorbed / emitted, 100 * unshot / emitted,
             r.energy.closed ? "unaccounted for" : "left the scene or unaccounted for",
             100 * r.energy.unaccounted_relative);
}

int run_solve(SolveArguments& a) {
  a.outputs.parse();
  a.solve.estimator = a.estimator == "exact"     ? Estimator::exact
                      : a.estimator == "subdisk" ? Estimator::subdisk
                                                 : Estimator::disk;
  if (!a.grid.empty()) a.solve.grid = parse_grid(a.grid);
  a.solve.closure = a.closure == "on" ? Closure::on : a.closure == "off" ? Closure::off : Closure::automatic;
  a.solve.solver = a.solver == "gathering"      ? Solver::gathering
                   : a.solver == "gauss-seidel" ? Solver::gauss_seidel
                                                : Solver::progressive;
  const double unit_m = parse_unit(a.outputs.unit);
  check_options(a.solve);
  check_place("--checkpoint", a.solve.checkpoint);
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = load_scene(a.scene, {.unit_m = unit_m, .sides = a.sides.resolved()});
  if (!a.quiet) print_diagnostics(scene.diagnostics, stderr);
  if (!a.sensors.empty()) a.solve.sensors = load_sensors(a.sensors, unit_m);
  require_range(scene);
  require_sensors_near(scene, a.solve.sensors, a.sensors);
  // A wrong name is said now, not after the solve.
  a.solve.adaptive.camera = a.outputs.chosen_camera(scene);
  a.solve.adaptive.width = a.outputs.picture.width, a.solve.adaptive.height = a.outputs.picture.height;
  const double import = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  Device device(a.device.resolved());
  watch_for_interrupt();
  ProgressLine line(a.quiet, a.solve.converge);
  a.solve.progress = [&](const Progress& p) {
    line.show(p);
    return !interrupted();
  };
  Solution solution = solve(device, scene, a.solve);
  solution.report.seconds.import = import;
  solution.report.seconds.total += import;
  const auto written = a.outputs.write([&]() -> Device& { return device; }, solution, line);
  line.clear();

  for (const auto& warning : solution.report.warnings) fmt::print(stderr, "warning: {}\n", warning);
  if (!a.quiet) {
    print_summary(solution);
    for (const auto& s : solution.sensors)
      if (a.outputs.json.empty() && a.outputs.folder.empty())
        fmt::print("sensor {} {} {}: {:.6g}\n", s.position_m.x, s.position_m.y, s.position_m.z,
                   fmt::join(s.irradiance, " "));
    for (const auto& path : written) fmt::print("wrote {}\n", path);
  }
  if (!solution.stopped) return done;
  fmt::print(stderr,
             "stopped with {:.3g} % of the light unshot; what was written is valid, but darker than the full "
             "solution\n",
             100 * solution.unshot_relative);
  return stopped;
}

}  // namespace

void add_solve(CLI::App& app, Action& action) {
  CLI::App* verb =
      app.add_subcommand("solve", "mesh, solve and draw a scene; with -o, everything into a folder");
  const auto a = std::make_shared<SolveArguments>();
  add_arguments(*verb, *a);
  verb->callback([a, &action] { action = [a] { return run_solve(*a); }; });
}

}  // namespace clrad::cli
