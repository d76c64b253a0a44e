// The measurement: a reference, a ladder of settings, then one thing at a time, within a budget.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "clrad/effects.hpp"
#include "clrad/error.hpp"
#include "clrad/tradeoff.hpp"
#include "effects/predict.hpp"
#include "effects/uniform.hpp"
#include "mesh/build.hpp"
#include "scene/extent.hpp"
#include "tradeoff/places.hpp"
#include "tradeoff/runner.hpp"
#include "tradeoff/settings.hpp"

namespace clrad {
namespace {

// Parts of the budget: how much of what the first references leave the ladder may take, and what is kept for refining the reference at the end. Settings
// come early, so that a measurement that is stopped has some.
constexpr double ladder_share = 0.45, last_reference_share = 0.25;
// A level of the reference takes about this much longer than the one before, and is about twice as good or better.
constexpr double reference_growth = 3.5;
// A solve this short is timed again, and the least counts: what else the machine does hardly does less than nothing.
constexpr double short_s = 0.5;
constexpr int short_repeats = 3;
// The reference's own error is to be this part of the smallest that is shown.
constexpr double reference_part = 0.1;
// The rung that is varied is at most this one, which is what a solve does by default.
constexpr std::size_t highest_middle = 5;

double square(double x) {
  return x * x;
}

struct Reference {
  std::vector<double> values;  // [point][band]
  double error_relative = NAN;
  int level = -1;     // of those solved; -1: none
  double last_s = 0;  // that took
};

class Measurement {
 public:
  Measurement(const DeviceOptions& device, const Scene& scene, const TradeoffOptions& options)
      : scene_(with_backs(scene)),
        options_(options),
        extent_(extent_m(scene)),
        precision_(device.precision),
        runner_(device, scene_, options) {
    base_.seed = options.seed;
    base_.sensors = options.sensors;
    result_.scene = scene.file, result_.quantity = scene.quantity;
    result_.bands = std::uint32_t(scene.bands.size());
    result_.extent_m = extent_, result_.budget_s = options.budget_s;
    result_.at_sensors = !options.sensors.empty();
    result_.device = runner_.device_of(precision_).info().name;
    result_.driver = runner_.device_of(precision_).info().driver;
  }

  Tradeoff run() {
    choose_points();
    first_reference();
    if (!runner_.over()) climb();
    if (!runner_.over()) vary();
    if (!runner_.over()) refine_reference();
    if (!runner_.over()) aim();
    for (const TradeoffSetting& rung : later_)
      if (!runner_.over()) measure(rung, false, predicted(rung), options_.budget_s);
    if (!runner_.over()) refine_reference();
    finish();
    return std::move(result_);
  }

 private:
  void choose_points() {
    if (result_.at_sensors) {
      result_.points = options_.sensors.size();
      return;
    }
    std::vector<Place> places;
    if (!is_uniform_enclosure(scene_)) {
      TradeoffSetting setting = points_setting(extent_, base_);
      setting.precision = precision_;
      try {
        if (const auto s = runner_.solved(setting, true, -1))
          places = varying_places(*s, options_.points, options_.seed);
      } catch (const MemoryError&) {  // it may be for settings that come
      }
    }
    // By area alone where there are none.
    if (places.empty()) places = stratified_places(scene_, options_.points, options_.seed);
    places_ = exposed_places(runner_.device_of(precision_), scene_, places);
    if (places_.empty()) throw UsageError("no surface of the scene is exposed: there is nothing to compare");
    for (const Place& p : places_) weights_.push_back(p.weight_m2);
    result_.points = places_.size();
  }

  std::vector<double> values_of(const Solution& s, bool of_reference) const {
    if (!result_.at_sensors && !of_reference) return irradiance_at(s, places_);
    std::vector<double> values;
    for (const SensorResult& r : s.sensors)
      values.insert(values.end(), r.irradiance.begin(), r.irradiance.end());
    return values;
  }

  double rms(const std::vector<double>& values, const std::vector<double>& reference) const {
    return rms_relative(values, reference, weights_, result_.bands);
  }

  // ---- the reference --------------------------------------------------------------------------------------------------
  void given_solution() {
    const Solution& s = *options_.reference;
    const auto differ = [&](const std::string& how) {
      return UsageError(fmt::format("--reference {}: {}", options_.reference_name, how));
    };
    if (s.scene.polygons.size() != scene_.polygons.size() || s.bands != result_.bands)
      throw differ(fmt::format("a solution of {} polygons and {} bands, but the scene has {} and {}",
                               s.scene.polygons.size(), s.bands, scene_.polygons.size(), result_.bands));
    for (std::size_t p = 0; p < scene_.polygons.size(); ++p)
      for (std::uint32_t k = 0; k < scene_.polygons[p].corners; ++k) {
        const glm::dvec3 d = glm::abs(scene_.polygons[p].corner[k] - s.scene.polygons[p].corner[k]);
        if (std::max({d.x, d.y, d.z}) > 1e-9 * extent_)
          throw differ(fmt::format("a solution of another scene: polygon {} is elsewhere", p + 1));
      }
    if (result_.at_sensors) {
      if (s.sensors.size() != options_.sensors.size())
        throw differ(fmt::format("has {} sensors, but --sensors has {}; solve it with the same file",
                                 s.sensors.size(), options_.sensors.size()));
      reference_.values = values_of(s, true);
    } else {
      reference_.values = irradiance_at(s, places_);
    }
    result_.reference.what =
        fmt::format("{}, a solution with {} elements", options_.reference_name, s.mesh.elements.size());
  }

  // One level more. False: it did not come to its end, or there is no memory for it.
  bool next_level(bool must) {
    TradeoffSetting setting = reference_setting(extent_, base_, reference_.level + 1);
    setting.precision = precision_;
    if (!result_.at_sensors) {
      setting.options.sensors.clear();
      for (const Place& p : places_) setting.options.sensors.push_back(p.sensor);
    }
    const double begin = runner_.seconds();
    std::optional<Solution> s;
    try {
      s = runner_.solved(setting, must, -1);
    } catch (const MemoryError&) {
      if (reference_.level < 0) throw;
    }
    if (!s) return false;
    std::vector<double> values = values_of(*s, true);
    // Twice as good as the one before, or better where it converges fast: half the difference is what is left.
    if (reference_.level >= 0) reference_.error_relative = rms(reference_.values, values) / 2;
    reference_.values = std::move(values);
    ++reference_.level;
    reference_.last_s = runner_.seconds() - begin;
    result_.reference.seconds += reference_.last_s;
    result_.reference.what = fmt::format(
        "a gather at the points with {} rays each from a solve of {} elements; its error is half of what the "
        "last step "
        "of refining it changed",
        setting.options.sensor_rays, s->mesh.elements.size());
    return true;
  }

  void first_reference() {
    if (!options_.known.empty()) {
      reference_.values = options_.known, reference_.error_relative = 0;
      result_.reference.what = fmt::format("irradiance from {}", options_.reference_name);
    } else if (options_.reference) {
      given_solution();
    } else if (is_uniform_enclosure(scene_)) {
      const Material& m = scene_.materials[scene_.polygons.front().material];
      for (std::size_t i = 0; i < result_.points; ++i)
        for (std::uint32_t b = 0; b < result_.bands; ++b)
          reference_.values.push_back(m.emitted_exitance[b] / (1 - m.reflectance[b]));
      reference_.error_relative = 0;
      result_.reference.what = "exact: in a closed room that is the same everywhere, H = E / (1 - rho)";
    } else {
      while (!runner_.over() && reference_.level < 1 && next_level(true)) {
      }
    }
  }

  double smallest_error() const {
    double least = INFINITY;
    for (const auto& v : values_) least = std::min(least, rms(v, reference_.values));
    return least;
  }

  void refine_reference() {
    while (reference_.level >= 0 && !runner_.over() &&
           reference_.error_relative > reference_part * smallest_error() &&
           reference_growth * reference_.last_s < runner_.left())
      if (!next_level(false)) break;
  }

  // ---- the settings ---------------------------------------------------------------------------------------------------
  double predicted(const TradeoffSetting& setting) {
    const SolveOptions& o = setting.options;
    // Another precision is of another device; opening one to ask is too much.
    Device& device = runner_.device_of(precision_);
    if (!(factor_s_ > 0)) factor_s_ = seconds_per_factor(device);
    const double s = predict(device, scene_, o, plan_effects(scene_, o), factor_s_).seconds;
    const double triangles = 2 * double(scene_.polygons.size());
    const double slower = o.engine == "serial"              ? std::max(1.5, triangles / 40)
                          : o.engine == "chop"              ? 5
                          : o.adaptive.tolerance > 0        ? 3
                          : setting.precision != precision_ ? 2
                                                            : 1;
    return s * slower * actual_by_predicted_;
  }

  // Settings of equal keys are equal to the solver.
  std::string key_of(const TradeoffSetting& setting) const {
    const SolveOptions& o = setting.options;
    const std::vector<Effect> effects = plan_effects(scene_, o);
    const MeshCounts mesh = count_mesh(scene_, o.mesh);
    const bool rays = runs(effects, "occlusion") || o.estimator != Estimator::exact;
    return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}", mesh.patches, mesh.elements,
                       rays ? o.samples : 0, rays ? o.light_samples : 0, o.converge, int(o.estimator),
                       runs(effects, "subdivision") ? o.adaptive.tolerance : 0, runs(effects, "near_field"),
                       rays ? o.engine : "", rays && o.visibility_exact && !runs(effects, "transmission"),
                       int(setting.precision), o.sensors.empty() || !rays ? 0 : o.sensor_rays);
  }

  void leave_out(const TradeoffSetting& setting, double predicted_s, std::string reason) {
    result_.left_out.push_back({setting, predicted_s, std::move(reason)});
  }

  // Index of the run; nothing when it was left out.
  std::optional<std::size_t> measure(const TradeoffSetting& setting, bool must, double predicted_s,
                                     double pending_s) {
    const double allowed = runner_.left();
    if (!must && predicted_s > allowed) {
      leave_out(
          setting, predicted_s,
          fmt::format("would take about {:.2g} s of the {:.2g} s left", predicted_s, std::max(0.0, allowed)));
      return {};
    }
    TradeoffRun run{setting, predicted_s, INFINITY};
    std::vector<double> values;
    try {
      for (int k = 0;
           k < short_repeats && (k == 0 || (run.seconds < short_s && runner_.left() > 2 * run.seconds));
           ++k) {
        const std::optional<Solution> s = runner_.solved(setting, must, pending_s);
        if (!s) {
          if (!runner_.over() && k == 0)
            leave_out(setting, predicted_s, "stopped: it took longer than the budget had left");
          if (k == 0 || runner_.over()) return {};
          break;
        }
        const Report& r = s->report;
        // To a target is more than one solve, and each estimates.
        run.seconds =
            std::min(run.seconds,
                     setting.options.target_error > 0 ? r.seconds.total : r.seconds.build + r.seconds.solve);
        if (k > 0) continue;
        run.estimate_relative = result_.at_sensors ? r.error.sensors_relative : r.error.total_relative;
        run.patches = s->mesh.patches.size(), run.elements = s->mesh.elements.size();
        run.vertices = s->vertex_count(), run.rays = r.rays, run.device_peak_bytes = r.device_peak_bytes;
        values = values_of(*s, false);
      }
    } catch (const Error& e) {
      leave_out(setting, predicted_s, e.what());
      return {};
    }
    result_.runs.push_back(std::move(run));
    runner_.runs = result_.runs.size();
    values_.push_back(std::move(values));
    return result_.runs.size() - 1;
  }

  // False: there is one like it.
  bool is_new(const TradeoffSetting& setting) {
    const auto [same, is_first] = seen_.emplace(key_of(setting), setting.name);
    if (!is_first) leave_out(setting, NAN, fmt::format("the same as \"{}\" in this scene", same->second));
    return is_first;
  }

  void climb() {
    std::vector<TradeoffSetting> rungs = ladder_settings(extent_, base_);
    const double until = runner_.seconds() + ladder_share * runner_.left();
    for (TradeoffSetting& rung : rungs) {
      if (runner_.over()) return;
      rung.precision = precision_;
      if (!is_new(rung)) continue;
      const bool must = result_.runs.empty();
      const double p = predicted(rung);
      if (!must && runner_.seconds() + p * wall_by_seconds_ > until) {
        later_.push_back(rung);
        continue;
      }
      const double begin = runner_.seconds();
      const auto run = measure(rung, must, p, options_.budget_s);
      if (!run) continue;
      const TradeoffRun& r = result_.runs[*run];
      wall_by_seconds_ = std::clamp((runner_.seconds() - begin) / r.seconds, 1.0, 4.0);
      // Short runs are mostly what does not grow with the work.
      if (r.seconds > 0.2)
        actual_by_predicted_ *= std::clamp(r.seconds / std::max(r.predicted_s, 1e-9), 0.2, 5.0);
      rung_runs_.push_back(*run);
    }
  }

  double together(const std::vector<TradeoffSetting>& settings) {
    double sum = 0;
    for (const TradeoffSetting& s : settings) sum += predicted(s);
    return sum;
  }

  void vary() {
    if (rung_runs_.empty()) return;
    const std::size_t highest = std::min(rung_runs_.size() - 1, highest_middle);
    const double kept = reference_.level < 0 ? 0 : last_reference_share * options_.budget_s;
    std::vector<TradeoffSetting> settings;
    for (std::size_t i = highest + 1; i-- > 0;) {
      result_.middle = rung_runs_[i];
      settings = variations_of(result_.runs[result_.middle].setting, extent_);
      if (i == 0 || together(settings) * wall_by_seconds_ < runner_.left() - kept) break;
    }
    std::vector<std::pair<double, TradeoffSetting>> by_time;
    for (TradeoffSetting& s : settings)
      if (is_new(s)) by_time.emplace_back(predicted(s), std::move(s));
    std::stable_sort(by_time.begin(), by_time.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    double pending = 0;
    for (const auto& [p, s] : by_time) pending += p * wall_by_seconds_;
    for (const auto& [p, s] : by_time) {
      if (runner_.over()) return;
      measure(s, false, p, pending);
      pending -= p * wall_by_seconds_;
    }
  }

  // What solves that aim at an error take, beside settings chosen by hand.
  void aim() {
    for (TradeoffSetting& s : target_settings(base_)) {
      if (runner_.over()) return;
      s.precision = precision_;
      // As long as the best by hand, and the coarser solves on the way.
      double cheapest = INFINITY;
      for (std::size_t i = 0; i < values_.size(); ++i)
        if (rms(values_[i], reference_.values) <= s.options.target_error)
          cheapest = std::min(cheapest, result_.runs[i].seconds);
      if (std::isinf(cheapest))
        leave_out(s, NAN, "no setting measured came that far");
      else
        measure(s, false, 3 * cheapest, options_.budget_s);
    }
  }

  void finish() {
    result_.mean_irradiance = mean_over(reference_.values, weights_, result_.bands);
    result_.reference.error_relative = reference_.error_relative;
    const double own = std::isnan(reference_.error_relative) ? 0 : reference_.error_relative;
    for (std::size_t i = 0; i < result_.runs.size() && !reference_.values.empty(); ++i) {
      const double apart = rms(values_[i], reference_.values);
      TradeoffRun& run = result_.runs[i];
      run.limited_by_reference = square(apart) < 2 * square(own);
      run.rms_relative = run.limited_by_reference ? apart : std::sqrt(square(apart) - square(own));
    }
    result_.front = pareto_front(result_.runs);
    for (const std::size_t i : result_.front) result_.runs[i].on_front = true;
    for (const double target : {0.05, 0.01, 0.001})
      result_.advice.push_back(cheapest_within(result_.runs, target));
    result_.seconds = runner_.seconds();
    result_.stopped = runner_.over();
  }

  Scene scene_;
  const TradeoffOptions& options_;
  double extent_;
  SolveOptions base_;
  Precision precision_;
  Runner runner_;
  std::map<std::string, std::string> seen_;  // key -> name
  std::vector<Place> places_;
  std::vector<double> weights_;
  Reference reference_;
  std::vector<std::vector<double>> values_;  // of each run
  std::vector<std::size_t> rung_runs_;       // indices of the ladder's runs
  std::vector<TradeoffSetting> later_;       // rungs that come after the variations
  double actual_by_predicted_ = 1;
  double factor_s_ = 0;
  double wall_by_seconds_ =
      1.5;  // of measuring a setting: repeats, invariants and comparing are not the solve
  Tradeoff result_;
};

}  // namespace

Tradeoff measure_tradeoff(const DeviceOptions& device, const Scene& scene, const TradeoffOptions& options) {
  if (!(options.budget_s > 0) || !std::isfinite(options.budget_s))
    throw UsageError(fmt::format("--budget {} is not a time in seconds", options.budget_s));
  if (options.points == 0 || options.points > 1'000'000)
    throw UsageError(fmt::format("--points {} is not between 1 and 1000000", options.points));
  const std::size_t wanted = options.sensors.size() * scene.bands.size();
  if (!options.known.empty() && options.known.size() != wanted)
    throw UsageError(fmt::format("{} values of known irradiance for {} sensors of {} bands",
                                 options.known.size(), options.sensors.size(), scene.bands.size()));
  return Measurement(device, scene, options).run();
}

}  // namespace clrad
