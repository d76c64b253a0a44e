#include "tradeoff/runner.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "clrad/solver.hpp"
#include "scene/extent.hpp"

namespace clrad {

Runner::Runner(const DeviceOptions& device, const Scene& scene, const TradeoffOptions& options)
    : device_options_(device), scene_(scene), options_(options), extent_m_(extent_m(scene)) {}

double Runner::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

Device& Runner::device_of(Precision precision) {
  auto& device = devices_[precision];
  if (!device) {
    DeviceOptions o = device_options_;
    o.precision = precision;
    device = std::make_unique<Device>(o);
  }
  return *device;
}

// False: the caller wants no more.
bool Runner::tell(const std::string& what, double pending_s, double unshot) {
  if (!options_.progress) return true;
  TradeoffProgress p{what, runs, seconds(), -1, unshot};
  if (pending_s >= 0) p.seconds_left = std::max(0.0, std::min(left(), pending_s));
  if (!options_.progress(p)) over_ = true;
  return !over_;
}

// Compiles the kernels that the setting takes by solving it on a mesh of a few patches.
void Runner::warm_up(const TradeoffSetting& setting) {
  const SolveOptions& o = setting.options;
  const std::string key =
      fmt::format("{} {} {} {} {} {} {}", int(setting.precision), o.engine, int(o.estimator),
                  o.visibility_exact, o.adaptive.tolerance > 0, o.near_field, o.sensors.empty());
  if (!warm_.insert(key).second) return;
  SolveOptions coarse = o;
  coarse.mesh = {extent_m_ / 2, extent_m_ / 8};
  coarse.adaptive.max_level = 1;
  coarse.sensors.resize(std::min<std::size_t>(o.sensors.size(), 2), Sensor{});
  coarse.light_samples = 64, coarse.sensor_rays = 256;
  coarse.target_error = 0;
  coarse.progress = [&](const Progress& p) {
    return tell("compiling kernels for " + setting.name, -1, p.unshot_relative);
  };
  solve(device_of(setting.precision), scene_, coarse);
}

std::optional<Solution> Runner::solved(const TradeoffSetting& setting, bool must, double pending_s) {
  warm_up(setting);
  if (over_) return {};
  SolveOptions o = setting.options;
  o.progress = [&](const Progress& p) {
    return tell(setting.name, pending_s, p.unshot_relative) && (must || left() > 0);
  };
  Device& device = device_of(setting.precision);
  device.reset_profile();
  device.ledger()->peak = device.ledger()->held;
  Solution s = solve(device, scene_, o);
  if (s.stopped && (over_ || (!must && left() <= 0))) return {};
  return s;
}

}  // namespace clrad
