#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>

#include "cli/cli.hpp"
#include "cli/progress.hpp"
#include "clrad/tradeoff.hpp"
#include "scene/range.hpp"

namespace clrad::cli {
namespace {

constexpr const char* tradeoff_description =
    "what accuracy costs in time for this scene: measure many settings, plot error against seconds, "
    "recommend some";

constexpr const char* tradeoff_help =
    "Example:\n"
    "  clrad tradeoff room.glb -o out/tradeoff --budget 300\n"
    "solves the scene with some forty settings: a ladder of meshes and samples from coarse to fine, then, "
    "around a rung in "
    "the middle, one thing at a time (samples, element and patch size, adaptive subdivision, convergence, "
    "form factors, "
    "engine, precision). Each is a row: seconds to build and solve, kernels compiled before, and its true "
    "error, the RMS "
    "over points of the surfaces of irradiance as pictures show it, relative to its mean (with --sensors: "
    "over the "
    "sensors). The settings that no other beats in both are the front; those to use for 5 %, 1 % and 0.1 % "
    "are printed as "
    "options of clrad solve.\n"
    "True is against a reference: --reference, else the exact answer where the scene has one, else "
    "irradiance gathered at "
    "the points from a finer solve with many rays, refined while the budget lasts until its own error is a "
    "tenth of the "
    "smallest that is shown; what it is, is printed.\n"
    "Files in DIR: tradeoff.csv, tradeoff.json, tradeoff.md (tables), tradeoff.dat and tradeoff.gnuplot, and "
    "where "
    "gnuplot is there tradeoff.png and tradeoff.svg. Ctrl-C writes what there is (exit code 4).";

struct TradeoffArguments {
  std::string scene, folder, sensors, reference, unit = "m";
  SidesArguments sides;
  DeviceArguments device;
  TradeoffOptions options;
  bool quiet = false;
};

// Numbers, one line a sensor.
std::vector<double> load_known(const std::string& path, std::size_t sensors, std::size_t bands) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("{}: cannot be read; is the name right?", path));
  std::vector<double> values;
  std::size_t number = 0, rows = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    std::istringstream words(line);
    std::vector<double> row;
    std::string word;
    while (words >> word && !(row.empty() && word[0] == '#')) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));
      if (*end != '\0' || !std::isfinite(row.back()))
        throw InputError(fmt::format("{}:{}: \"{}\" is not a number", path, number, word));
    }
    if (row.empty()) continue;
    if (row.size() != bands)
      throw InputError(fmt::format(
          "{}:{}: {} values, but the scene has {} bands; write the irradiance of one sensor a line", path,
          number, row.size(), bands));
    values.insert(values.end(), row.begin(), row.end()), ++rows;
  }
  if (rows != sensors)
    throw InputError(fmt::format("{}: irradiance of {} sensors, but --sensors has {}", path, rows, sensors));
  return values;
}

// What is measured now, on a terminal in one line that is redrawn, else a line a setting.
class TradeoffLine {
 public:
  explicit TradeoffLine(bool quiet) : on_(!quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
  void show(const TradeoffProgress& p) {
    using namespace std::chrono_literals;
    if (!on_) return;
    const bool next = p.what != last_what_;
    const auto now = std::chrono::steady_clock::now();
    if (terminal_ ? now - last_ < 100ms && !next : !next) return;
    last_ = now, last_what_ = p.what;
    const std::string left =
        p.seconds_left < 0 ? "" : fmt::format(", about {:.0f} s left", std::ceil(p.seconds_left));
    fmt::print(stderr, "{}[{:.0f} s{}] {} settings measured; now {}{}", terminal_ ? "\r\033[K" : "",
               p.seconds, left, p.run, p.what,
               terminal_ ? fmt::format(" ({:.3g} % unshot)", 100 * p.unshot_relative) : "\n");
    std::fflush(stderr);
    drawn_ = terminal_;
  }
  void clear() {
    if (drawn_) fmt::print(stderr, "\r\033[K");
    drawn_ = false;
  }

 private:
  bool on_, terminal_, drawn_ = false;
  std::string last_what_;
  std::chrono::steady_clock::time_point last_{};
};

std::string percent_text(double relative) {
  return std::isnan(relative) ? "-" : fmt::format("{:.3g} %", 100 * relative);
}

std::string time_text(double s) {
  return fmt::format("{:.{}f} s", s, s < 1 ? 3 : s < 10 ? 2 : 1);
}

// The command that solves with these settings.
std::string command_of(const TradeoffArguments& a, const TradeoffRun& run) {
  std::string text = "clrad solve " + a.scene;
  if (a.unit != "m") text += " --unit " + a.unit;
  if (a.sides.two) text += " --two-sided";
  if (a.sides.one) text += " --one-sided";
  if (!a.sensors.empty()) text += " --sensors " + a.sensors;
  return text + " " + solve_arguments(run.setting, !a.sensors.empty());
}

void print_tradeoff(const TradeoffArguments& a, const Tradeoff& t) {
  fmt::print("{}: {} settings measured in {:.0f} s on {}\n", t.scene, t.runs.size(), t.seconds, t.device);
  fmt::print("error: RMS of irradiance at {} {}, relative to its mean of {:.4g} {}\n", t.points,
             t.at_sensors ? "sensors" : "points of the surfaces", t.mean_irradiance,
             t.quantity == Quantity::photometric ? "lm/m2" : "W/m2");
  fmt::print("reference: {}{}\n\n", t.reference.what,
             t.reference.error_relative > 0           ? ", about " + percent_text(t.reference.error_relative)
             : std::isnan(t.reference.error_relative) ? "; its own error is not known"
                                                      : "");
  fmt::print("the front: no other setting is both faster and better\n");
  fmt::print("  {:>10} {:>10} {:>12}   {}\n", "seconds", "error", "own estimate", "setting");
  double shown = INFINITY;
  for (const std::size_t i : t.front) {
    const TradeoffRun& r = t.runs[i];
    if (r.rms_relative > 0.99 * shown) continue;  // nobody waits longer for that; the files have it
    shown = r.rms_relative;
    fmt::print(
        "  {:>10.3f} {:>10} {:>12}   {}{}\n", r.seconds, percent_text(r.rms_relative),
        percent_text(r.estimate_relative),
        r.setting.kind == "ladder" ? r.setting.name : fmt::format("{}: {}", r.setting.kind, r.setting.name),
        r.limited_by_reference ? " (no worse than this: the reference is no better)" : "");
  }
  fmt::print("\n");
  for (const TradeoffAdvice& advice : t.advice) {
    if (advice.run == SIZE_MAX)
      fmt::print("{:g} %: not reached; a larger --budget measures finer settings\n",
                 100 * advice.target_relative);
    else
      fmt::print("{:g} % costs {}:\n  {}\n", 100 * advice.target_relative,
                 time_text(t.runs[advice.run].seconds), command_of(a, t.runs[advice.run]));
  }
  if (!t.left_out.empty()) {
    fmt::print("\nleft out:\n");
    for (const TradeoffLeftOut& l : t.left_out) fmt::print("  {}: {}\n", l.setting.name, l.reason);
  }
}

// Where a tenth was not reached.
void warn_of_reference(const Tradeoff& t) {
  double least = INFINITY;
  for (const TradeoffRun& r : t.runs) least = std::min(least, r.rms_relative);
  if (t.reference.error_relative > 0.1 * least && std::isfinite(least))
    fmt::print(
        stderr,
        "warning: the reference's own error, about {}, is more than a tenth of the smallest shown, {}; it is "
        "subtracted in quadrature, but errors below {} are uncertain. A larger --budget refines the "
        "reference\n",
        percent_text(t.reference.error_relative), percent_text(least),
        percent_text(3 * t.reference.error_relative));
}

int run_tradeoff(TradeoffArguments& a) {
  const double unit_m = parse_unit(a.unit);
  std::error_code ignored;
  if (std::filesystem::exists(a.folder, ignored) && !std::filesystem::is_directory(a.folder, ignored))
    throw UsageError(fmt::format("-o {}: is a file; name a folder", a.folder));
  const Scene scene = load_scene(a.scene, {.unit_m = unit_m, .sides = a.sides.resolved()});
  if (!a.quiet) print_diagnostics(scene.diagnostics, stderr);
  TradeoffOptions& o = a.options;
  if (!a.sensors.empty()) o.sensors = load_sensors(a.sensors, unit_m);
  require_range(scene);
  require_sensors_near(scene, o.sensors, a.sensors);
  std::optional<Solution> reference;
  o.reference_name = a.reference;
  if (a.reference.ends_with(".clrad")) {
    reference = load_solution(a.reference);
    o.reference = &*reference;
  } else if (!a.reference.empty()) {
    if (o.sensors.empty())
      throw UsageError(fmt::format(
          "--reference {}: is not a solution (.clrad); known irradiance goes with --sensors", a.reference));
    o.known = load_known(a.reference, o.sensors.size(), scene.bands.size());
  }
  watch_for_interrupt();
  TradeoffLine line(a.quiet);
  o.progress = [&](const TradeoffProgress& p) {
    line.show(p);
    return !interrupted();
  };
  const Tradeoff t = measure_tradeoff(a.device.resolved(), scene, o);
  line.clear();
  if (t.runs.empty()) {
    fmt::print(stderr, "stopped before a setting was measured; nothing was written\n");
    return stopped;
  }
  const std::vector<std::string> written = write_tradeoff(a.folder, t);
  warn_of_reference(t);
  if (!a.quiet) {
    print_tradeoff(a, t);
    fmt::print("\n");
    for (const std::string& path : written) fmt::print("wrote {}\n", path);
    if (!written.back().ends_with(".svg"))
      fmt::print(
          "gnuplot is not there or failed; `gnuplot tradeoff.gnuplot` in that folder draws the plot\n");
  }
  if (!t.stopped) return done;
  fmt::print(stderr, "stopped; what was measured until then was written\n");
  return stopped;
}

}  // namespace

void add_tradeoff(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("tradeoff", tradeoff_description);
  verb->footer(tradeoff_help);
  const auto a = std::make_shared<TradeoffArguments>();
  verb->add_option("scene", a->scene, "OBJ, glTF or GLB file")->required();
  verb->add_option("-o,--output", a->folder, "folder for tables and plot (made when missing)")->required();
  verb->add_option("--budget", a->options.budget_s,
                   "seconds for all of it; settings that are predicted not to fit are left out, and named")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--sensors", a->sensors, "errors at these points: a file of `x y z nx ny nz` lines");
  verb->add_option(
      "--reference", a->reference,
      "what is true: a finished solution (.clrad), or with --sensors a file of known irradiance, a line a "
      "sensor with a value a band (default: it is found)");
  verb->add_option("--points", a->options.points, "of the surfaces at which irradiance is compared")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  verb->add_option("--seed", a->options.seed, "of the points' and the samples' places")
      ->capture_default_str();
  verb->add_option("--unit", a->unit, "length of one unit of the files: mm, cm, m, in, ft or metres")
      ->capture_default_str();
  a->sides.add_to(*verb);
  a->device.add_to(*verb);
  verb->add_flag("--quiet", a->quiet, "print warnings and errors only");
  verb->callback([a, &action] { action = [a] { return run_tradeoff(*a); }; });
}

}  // namespace clrad::cli
