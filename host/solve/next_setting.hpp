// Which setting a search for a target tries next: what finer ones would bring and cost, by what the last one was off by and took.
#pragma once
#include <cmath>
#include <cstdint>
#include <optional>

#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "mesh/build.hpp"

namespace clrad {

// A next solve takes at most this many times the last one's time: what the last one said of the error is too far off beyond.
inline constexpr double longest_step = 12;

struct SolveSetting {
  double patch_edge_m = 0;
  int level = 2;  // elements are patches / 2^level
  std::uint32_t samples = 4, light_samples = 256, sensor_rays = 1024;
  double converge = INFINITY;  // at most
  double element_edge_m() const { return std::ldexp(patch_edge_m, -level); }
};

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

/// Whether the target is of what sensors see, not of the scene.
bool aims_at_sensors(const SolveOptions& options);
/// The estimate that ends the search.
double enough(const SolveOptions& options);
/// The parts of what the target is of.
TargetErrors errors_of(const Solution& solution, const SolveOptions& options);
/// A few points say what a mesh is off by, and one of them can be most of it: what the last step foretold counts as much.
TargetErrors tempered(const TargetErrors& found, const TargetErrors& foretold);

/// What a solve took, of what mesh.
struct SolveCost {
  double shooting_s = 0, sensors_s = 0;
  double rays_s = 0;  // of shooting, what its samples took
  MeshSize mesh;
  MeshSize before;        // without backs and subdivision, as candidates are counted
  double uncovered = 1;   // of the vertices
  bool occlusion = true;  // something stands in the way of light
  std::uint64_t sensors = 0;
  double unshot_relative = 0;
  double total() const { return shooting_s + sensors_s; }
};

/// What of a device's time went into sensors, and into samples of what is visible.
struct StageSeconds {
  double sensors = 0, rays = 0;
};
StageSeconds stage_seconds(const std::vector<StageProfile>& stages);

/// `before`: what earlier solves of this device took, since its profile goes on; grows.
SolveCost cost_of(const Scene& scene, const Solution& solution, double seconds, StageSeconds& before);

struct NextSetting {
  SolveSetting setting;
  TargetErrors errors;  // these and the rest foretold
  double error, seconds;
};

/// The cheapest setting that should meet `target`, or, where none does, the one that helps most for its time; without a target (0) the
/// best that takes at most its share of the seconds left. It takes at most `longest` times the last one. None where nothing finer would
/// help or fit.
std::optional<NextSetting> next_setting(const Scene& scene, TargetErrors errors, SolveSetting at,
                                        const SolveCost& cost, double target, double seconds_left,
                                        double longest);
/// `longest` for the steps to a target.
double longest_of_target(bool at_sensors);
/// `longest` for the steps of a time budget.
double longest_of_budget(const SolveCost& cost, double seconds_left);

}  // namespace clrad
