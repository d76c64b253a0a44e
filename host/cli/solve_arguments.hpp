// What can be asked of a solve, for the verbs that solve or say what a solve would do.
#pragma once
#include "cli/cli.hpp"

namespace clrad::cli {

struct SolveArguments {
  DeviceArguments device;
  SolveOptions options;
  std::string sensors;  ///< file

  void add_to(CLI::App& verb);
  /// Fills in `options`, but for sensors and camera. Throws UsageError.
  void parse();

 private:
  std::string estimator = "exact", grid, solver = "progressive", closure = "auto", target_error,
              target_of = "auto", time_budget;
};

}  // namespace clrad::cli
