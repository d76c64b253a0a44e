// What the verbs that have a solution write: pictures, models, the solution itself and the report.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "cli/cli.hpp"
#include "cli/progress.hpp"

namespace clrad::cli {

struct OutputArguments {
  std::string folder, image, gltf, vtu, solution, json;
  std::string camera, size = "640x640", unit = "m";
  ImageOptions picture;

  /// -o, --image, --gltf, --vtu, and how the picture is taken: --camera, --size, --exposure, --ambient. `in_folder`: what
  /// -o writes, for the help.
  void add_views_to(CLI::App& verb, const std::string& in_folder);
  /// --json and --solution, of verbs that solve: with them -o means report.json and solution.clrad, too.
  void add_results_to(CLI::App& verb);

  /// Reads --size and --unit, so that bad ones are said before any work. Throws UsageError.
  void parse();
  /// After parse(). Throws UsageError.
  Camera chosen_camera(const Scene& scene) const;
  /// About what write() will take [s], for a solution that takes a few seconds.
  double seconds() const;
  /// Whether anything is to be written.
  bool any() const;

  /// Writes all that was asked for by name, and everything when there is a folder; returns the paths. `device` is called
  /// when there is a picture to draw; time and stages of that are added to the solution's report.
  std::vector<std::string> write(const std::function<Device&()>& device, Solution& solved,
                                 ProgressLine& line) const;

 private:
  bool results_ = false;
  double unit_m_ = 1;
};

}  // namespace clrad::cli
