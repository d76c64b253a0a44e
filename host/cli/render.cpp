#include <fmt/format.h>

#include <memory>
#include <optional>

#include "cli/cli.hpp"
#include "cli/outputs.hpp"
#include "cli/progress.hpp"

namespace clrad::cli {
namespace {

struct Arguments {
  std::string solution;
  OutputArguments outputs;
  DeviceArguments device;
  bool quiet = false;
};

int run(Arguments& a) {
  a.outputs.parse();
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
  const auto a = std::make_shared<Arguments>();
  verb->add_option("solution", a->solution, "solution.clrad of a solve")->required();
  a->outputs.add_views_to(*verb, "picture.png, scene.glb and scene.vtu");
  a->device.add_to(*verb);
  verb->add_flag("--quiet", a->quiet, "no progress, no summary");
  verb->callback([a, &action] { action = [a] { return run(*a); }; });
}

}  // namespace clrad::cli
