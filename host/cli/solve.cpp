#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/cli.hpp"
#include "cli/outputs.hpp"
#include "cli/progress.hpp"
#include "cli/solve_arguments.hpp"
#include "effects/predict.hpp"
#include "scene/range.hpp"

namespace clrad::cli {
namespace {

struct Arguments {
  std::string scene;
  OutputArguments outputs;
  SidesArguments sides;
  SolveArguments solve;
  std::string compare;
  bool quiet = false, predicts = true;
};

void print_summary(const Solution& s, double loading_seconds) {
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
  fmt::print("  {:<50} {:>9} {:>9.3f}\n", "compile and load kernels", "", loading_seconds);
  fmt::print("  {:<50} {:>9} {:>9.3f}\n", "all, by the clock", "", r.seconds.total);
  fmt::print("\nwhere the light went   emitted {:.4g} {}, absorbed {:.2f} %, unshot {:.3g} %, {} {:.2f} %\n",
             emitted, unit, 100 * absorbed / emitted, 100 * unshot / emitted,
             r.energy.closed ? "unaccounted for" : "left the scene or unaccounted for",
             100 * r.energy.unaccounted_relative);
}

// The error and, of its parts, those that matter.
void print_error(const Report& r) {
  const auto parts = [](const std::vector<ErrorPart>& all, double total) {
    std::string text;
    for (const ErrorPart& p : all)
      if (!p.bound && p.relative > 0.1 * total)
        text += fmt::format("{}{} {:.2g} %", text.empty() ? "" : ", ", p.name, 100 * p.relative);
    return text.empty() ? text : " (" + text + ")";
  };
  if (std::isfinite(r.error.total_relative))
    fmt::print("estimated error   {:.2g} % of the mean irradiance, RMS over the surfaces{}\n",
               100 * r.error.total_relative, parts(r.error.parts, r.error.total_relative));
  if (std::isfinite(r.error.sensors_relative))
    fmt::print("                  {:.2g} % at the sensors{}\n", 100 * r.error.sensors_relative,
               parts(r.error.sensor_parts, r.error.sensors_relative));
  for (std::size_t i = 0; i < r.target.steps.size(); ++i) {
    const TargetStep& s = r.target.steps[i];
    const bool shot_on = i > 0 && s.converge < r.target.steps[i - 1].converge;
    fmt::print(
        "  step {}: patches of {:.3g} m, elements of {:.3g} m, {} samples{}{}: {:.2g} % in {:.2f} s{}\n",
        i + 1, s.patch_edge_m, s.element_edge_m, s.samples,
        r.target.at_sensors ? fmt::format(", {} rays from a sensor", s.sensor_rays) : "",
        shot_on ? fmt::format(", {:.2g} % left unshot", 100 * s.converge) : "", 100 * s.error_relative,
        s.seconds,
        std::isfinite(s.predicted_seconds)
            ? fmt::format(" (predicted {:.2g} % in {:.2f} s)", 100 * s.predicted_error_relative,
                          s.predicted_seconds)
            : "");
  }
}

void print_predicted(const Report& r) {
  if (!std::isfinite(r.predicted.seconds)) return;
  fmt::print(
      "predicted {:.2g} s and {:.0f} MiB{}, took {:.2g} s and {:.0f} MiB without pictures, files and loading "
      "kernels\n",
      r.predicted.seconds, r.predicted.device_bytes / 0x1p20,
      r.refinement.refinements > 0 ? " for the first mesh" : "", r.seconds.build + r.seconds.solve,
      double(r.device_peak_bytes) / 0x1p20);
}

void print_comparison(const Comparison& c) {
  if (c.file.empty()) return;
  fmt::print("compared with {} at {} {}: RMS {:.3g} %, worst {:.3g} % of its mean irradiance\n", c.file,
             c.points, c.by_vertices ? "vertices" : "polygons", 100 * c.rms_relative, 100 * c.worst_relative);
}

void print_effects(const Report& report) {
  std::vector<std::string> skipped, forced, left_out;
  for (const Effect& e : report.effects) {
    if (!e.needed && !e.runs) skipped.push_back(e.name);
    if (!e.needed && e.runs) forced.push_back(e.name);
    if (e.needed && !e.runs) left_out.push_back(e.name);
  }
  fmt::print("not called for: {}", skipped.empty() ? "nothing" : fmt::format("{}", fmt::join(skipped, ", ")));
  if (!forced.empty()) fmt::print("; forced: {}", fmt::join(forced, ", "));
  if (!left_out.empty()) fmt::print("; left out: {}", fmt::join(left_out, ", "));
  fmt::print(" (clrad plan says why)\n");
}

int run_solve(Arguments& a) {
  a.outputs.parse();
  a.solve.options.adaptive.width = a.outputs.picture.width;
  a.solve.options.adaptive.height = a.outputs.picture.height;
  a.solve.parse();
  const double unit_m = parse_unit(a.outputs.unit);
  SolveOptions& options = a.solve.options;
  check_place("--checkpoint", options.checkpoint);
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = load_scene(a.scene, {.unit_m = unit_m, .sides = a.sides.resolved()});
  if (!a.quiet) print_diagnostics(scene.diagnostics, stderr);
  if (!a.solve.sensors.empty()) options.sensors = load_sensors(a.solve.sensors, unit_m);
  require_range(scene);
  require_sensors_near(scene, options.sensors, a.solve.sensors);
  // A wrong name is said now, not after the solve.
  options.adaptive.camera = a.outputs.chosen_camera(scene);
  std::optional<Solution> other;
  if (!a.compare.empty()) other = load_solution(a.compare);
  const double import = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  Device device(a.solve.device.resolved());
  watch_for_interrupt();
  ProgressLine line(a.quiet, options.converge);
  options.progress = [&](const Progress& p) {
    line.show(p);
    return !interrupted();
  };
  const double time_budget_s = options.time_budget_s;
  if (time_budget_s > 0) {
    constexpr double ending = 0.25;  // closing the device, and the summary
    const double spent = seconds_since_start() + a.outputs.seconds() + ending;
    if (spent > 0.9 * time_budget_s)
      throw UsageError(
          fmt::format("--time-budget {:.3g} s: reading the scene and drawing take {:.2g} s of that; give it "
                      "more time, or a smaller picture (--size)",
                      time_budget_s, spent));
    options.time_budget_s = time_budget_s - spent;
  }
  // Of a solve to a target the last settings are known only at its end, and of one that goes on what is done already is not counted.
  const bool predictable =
      a.predicts && !(options.target_error > 0 || options.time_budget_s > 0) && options.resume.empty();
  const Prediction foreseen =
      predictable ? predict(device, scene, options, plan_effects(scene, options)) : Prediction{};
  Solution solution = solve(device, scene, options);
  if (predictable) solution.report.predicted = {foreseen.seconds, foreseen.device_bytes};
  solution.report.target.time_budget_s = time_budget_s;
  solution.report.seconds.import = import;
  solution.report.seconds.total += import;
  if (other) {
    solution.report.comparison = compare(solution, *other);
    solution.report.comparison.file = a.compare;
  }
  const auto written = a.outputs.write([&]() -> Device& { return device; }, solution, line);
  line.clear();

  for (const auto& warning : solution.report.warnings) fmt::print(stderr, "warning: {}\n", warning);
  if (!a.quiet) {
    print_summary(solution, device.loading_seconds());
    print_effects(solution.report);
    print_error(solution.report);
    print_predicted(solution.report);
    print_comparison(solution.report.comparison);
    for (const auto& s : solution.sensors)
      if (a.outputs.json.empty() && a.outputs.folder.empty())
        fmt::print("sensor {} {} {}: {:.6g}\n", s.position_m.x, s.position_m.y, s.position_m.z,
                   fmt::join(s.irradiance, " "));
    for (const auto& path : written) fmt::print("wrote {}\n", path);
  }
  if (!solution.stopped) return solution.report.target.met ? done : stopped;
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
  const auto a = std::make_shared<Arguments>();
  verb->add_option("scene", a->scene, "OBJ, glTF or GLB file")->required();
  a->outputs.add_views_to(*verb, "picture.png, scene.glb, scene.vtu, solution.clrad and report.json");
  a->outputs.add_results_to(*verb);
  a->sides.add_to(*verb);
  a->solve.add_to(*verb);
  verb->add_option(
      "--compare", a->compare,
      "a solution of the same scene (solution.clrad): the report says how far this one is from it");
  verb->add_flag("!--no-predict", a->predicts,
                 "do not predict time and memory first, which takes some tens of milliseconds");
  verb->add_flag("--quiet", a->quiet, "no progress, no summary");
  verb->callback([a, &action] { action = [a] { return run_solve(*a); }; });
}

}  // namespace clrad::cli
