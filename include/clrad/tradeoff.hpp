/// What accuracy costs in time, for one scene: many settings, each with its seconds and its true error.
#pragma once
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/scene.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Where a measurement stands; given to TradeoffOptions::progress.
struct TradeoffProgress {
  std::string what;     ///< "reference 2", or the setting's name
  std::size_t run = 0;  ///< settings measured so far
  double seconds = 0;   ///< since it began
  double seconds_left =
      -1;  ///< until the settings still wanted are done, or the budget is; negative: not known yet
  double unshot_relative = 1;  ///< of the solve that runs
};

struct TradeoffOptions {
  double budget_s = 120;        ///< of everything; settings that would not fit into it are left out
  std::uint32_t points = 1000;  ///< of the surfaces at which irradiance is compared
  std::vector<Sensor> sensors;  ///< where there are any, errors are of the irradiance at these instead
  std::uint64_t seed = 1;       ///< of the points' places and of the samples
  /// Known irradiance at the sensors, [sensor][band] [W/m^2 or lm/m^2]; empty: it is found.
  std::vector<double> known;
  /// A finished solution of the same scene to compare with; null: a reference is found. Where there are sensors, it has the
  /// same ones.
  const Solution* reference = nullptr;
  std::string reference_name;  ///< of the one or the other, for what is written
  /// Called between settings and after every shoot; returning false ends the measurement with what there is.
  std::function<bool(const TradeoffProgress&)> progress;
};

/// One setting: what is asked of a solve.
struct TradeoffSetting {
  std::string kind;  ///< "ladder": mesh and samples together; else what alone differs from the middle setting
  std::string name;  ///< short, for tables: "samples 16"
  SolveOptions options;
  Precision precision = Precision::float32;
};

/// What one setting took and gave.
struct TradeoffRun {
  TradeoffSetting setting;
  double predicted_s = 0;  ///< before it ran
  double seconds = 0;  ///< of building and solving, kernels compiled; the least of several where it is short
  double rms_relative = NAN;       ///< true error: RMS over points and bands, relative to the mean irradiance
  double estimate_relative = NAN;  ///< what the solve itself says it is; NaN: it says nothing
  /// The true error is so close to the reference's own that the difference to it is given instead: no less than the truth.
  bool limited_by_reference = false;
  bool on_front = false;  ///< no other setting is both faster and better
  std::uint64_t patches = 0, elements = 0, vertices = 0, rays = 0, device_peak_bytes = 0;
};

struct TradeoffLeftOut {
  TradeoffSetting setting;
  double predicted_s = NAN;
  std::string reason;
};

/// The cheapest measured setting within an error.
struct TradeoffAdvice {
  double target_relative = 0;
  std::size_t run = SIZE_MAX;  ///< index into Tradeoff::runs; SIZE_MAX: none is within it
};

struct Tradeoff {
  std::string scene, device, driver;
  Quantity quantity = Quantity::radiometric;
  std::uint32_t bands = 1;
  double extent_m = 0;  ///< longest side of the scene's box
  bool at_sensors = false;
  std::size_t points = 0;      ///< at which irradiance was compared, covered places left out
  double mean_irradiance = 0;  ///< of the reference, over points and bands [W/m^2 or lm/m^2]
  double budget_s = 0, seconds = 0;
  struct {
    std::string what;             ///< in a sentence
    double error_relative = NAN;  ///< its own RMS error; NaN: unknown
    double seconds = 0;
  } reference;
  std::vector<TradeoffRun> runs;       ///< in the order in which they ran
  std::vector<std::size_t> front;      ///< indices into runs, fastest first: each better than all faster ones
  std::vector<TradeoffAdvice> advice;  ///< for 5 %, 1 % and 0.1 %
  std::vector<TradeoffLeftOut> left_out;
  std::size_t middle = SIZE_MAX;  ///< the setting that all but the ladder vary; SIZE_MAX: none ran
  bool stopped = false;           ///< by the caller
};

/// Runs a designed set of settings within options.budget_s: a ladder from coarse to fine, then one thing at a time around
/// the rung in the middle that the budget allows. Throws UsageError, InputError or DeviceError.
Tradeoff measure_tradeoff(const DeviceOptions& device, const Scene& scene,
                          const TradeoffOptions& options = {});

/// Indices of the settings that no other beats in both, fastest first: seconds go up, errors go strictly down. NaN errors are
/// never among them.
std::vector<std::size_t> pareto_front(const std::vector<TradeoffRun>& runs);
/// The cheapest of `runs` whose true error is at most `target_relative`.
TradeoffAdvice cheapest_within(const std::vector<TradeoffRun>& runs, double target_relative);

/// The setting as options of `clrad solve`.
std::string solve_arguments(const TradeoffSetting& setting, bool with_sensors);

std::string tradeoff_csv(const Tradeoff& tradeoff);
/// Schema clrad-tradeoff-1 (README).
std::string tradeoff_json(const Tradeoff& tradeoff);
/// Tables for a page in Markdown.
std::string tradeoff_markdown(const Tradeoff& tradeoff);
/// tradeoff.csv, .json, .md, .dat and .gnuplot in `folder` (made when missing), and, where gnuplot can be run, .png and .svg.
/// Returns their paths. Throws DeviceError.
std::vector<std::string> write_tradeoff(const std::string& folder, const Tradeoff& tradeoff);

}  // namespace clrad
