#include <fmt/format.h>

#include <memory>
#include <optional>

#include "cli/cli.hpp"
#include "cli/outputs.hpp"
#include "cli/progress.hpp"

namespace clrad::cli {
namespace {

struct RenderArguments {
  std::string solution;
  OutputArguments outputs;
  DeviceArguments device;
  SidesArguments sides;
  bool quiet = false;
};

// A picture straight from a scene.
int run_whitted(RenderArguments& a) {
  if (a.outputs.image.empty()) throw UsageError("--whitted draws a picture: name it with --image");
  const Scene scene =
      load_scene(a.solution, {.unit_m = parse_unit(a.outputs.unit), .sides = a.sides.resolved()});
  if (!a.quiet) print_diagnostics(scene.diagnostics, stderr);
  const Camera camera = a.outputs.chosen_camera(scene);
  Device device(a.device.resolved());
  ProgressLine line(a.quiet, 1);
  line.say("draw the picture");
  write_image(a.outputs.image, render_whitted(device, scene, camera, a.outputs.picture), a.outputs.picture);
  line.clear();
  if (!a.quiet) fmt::print("wrote {}\n", a.outputs.image);
  return done;
}

int run_render(RenderArguments& a) {
  a.outputs.parse();
  if (a.outputs.picture.whitted) return run_whitted(a);
  if (a.sides.two || a.sides.one)
    throw UsageError(
        "--two-sided and --one-sided are of scenes; which polygons have two sides was decided when this was "
        "solved");
  if (!a.outputs.any()) throw UsageError("nothing to write; name --image, --gltf, --vtu or a folder with -o");
  Solution solution = load_solution(a.solution);
  a.outputs.chosen_camera(solution.scene);  // a wrong name is said before anything is written

  // Only a picture needs a device.
  std::optional<Device> device;
  ProgressLine line(a.quiet, 1);
  const auto written = a.outputs.write(
      [&]() -> Device& { return device ? *device : device.emplace(a.device.resolved()); }, solution, line);
  line.clear();
  if (a.quiet) return done;
  if (solution.stopped)
    fmt::print(stderr, "warning: this solution was stopped with {:.3g} % of its light unshot{}\n",
               100 * solution.unshot_relative,
               a.outputs.picture.ambient ? "" : "; --ambient adds an estimate of it to the picture");
  for (const auto& path : written) fmt::print("wrote {}\n", path);
  return done;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("render", "draw other views of a finished solution, without solving");
  const auto a = std::make_shared<RenderArguments>();
  verb->add_option("solution", a->solution, "solution.clrad of a solve; with --whitted, a scene")->required();
  verb->add_flag(
      "--whitted", a->outputs.picture.whitted,
      "ray tracing without radiosity: light straight from the lamps, mirrors and glass (Whitted 1980)");
  verb->add_option("--light-samples", a->outputs.picture.light_samples, "of --whitted: rays to each lamp")
      ->capture_default_str();
  a->outputs.add_views_to(*verb, "picture.png, scene.glb and scene.vtu");
  a->sides.add_to(*verb);
  a->device.add_to(*verb);
  verb->add_flag("--quiet", a->quiet, "no progress, no summary");
  verb->callback([a, &action] { action = [a] { return run_render(*a); }; });
}

}  // namespace clrad::cli
