#include "tradeoff/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

// At most four digits, never less than `length`: what is printed is what was measured, and no more pieces than meant.
double short_length(double length) {
  if (!(length > 0)) return length;
  const double digit = std::pow(10.0, std::floor(std::log10(length)) - 3);
  const double rounded = std::ceil(length / digit * (1 - 1e-9)) * digit;
  return std::stod(fmt::format("{:.4g}", rounded));
}

void set_mesh(SolveOptions& o, double extent_m, double patches, double elements) {
  o.mesh.patch_edge_m = short_length(extent_m / patches);
  o.mesh.element_edge_m = short_length(extent_m / elements);
}

std::string length_text(double metres) {
  return fmt::format("{:.4g}", metres);
}

}  // namespace

std::vector<TradeoffSetting> ladder_settings(double extent_m, const SolveOptions& base) {
  struct Rung {
    double patches, elements;  // along the extent
    std::uint32_t samples, light_samples, sensor_rays;
    double converge;
  };
  constexpr Rung rungs[] = {{2, 4, 1, 16, 256, 3e-2},        {2, 8, 1, 32, 512, 1e-2},
                            {4, 16, 1, 64, 1024, 1e-2},      {4, 32, 1, 128, 2048, 1e-2},
                            {4, 32, 4, 256, 4096, 3e-3},     {8, 64, 4, 256, 8192, 1e-3},
                            {8, 128, 4, 512, 16384, 1e-3},   {16, 128, 4, 1024, 32768, 1e-3},
                            {16, 256, 4, 1024, 65536, 1e-3}, {16, 256, 16, 4096, 131072, 1e-4}};
  std::vector<TradeoffSetting> settings;
  for (const Rung& r : rungs) {
    TradeoffSetting s{
        "ladder",
        fmt::format("extent/{:g} and /{:g}, {} + {}", r.patches, r.elements, r.samples, r.light_samples),
        base};
    set_mesh(s.options, extent_m, r.patches, r.elements);
    s.options.samples = r.samples, s.options.light_samples = r.light_samples;
    s.options.sensor_rays = r.sensor_rays, s.options.converge = r.converge;
    settings.push_back(std::move(s));
  }
  return settings;
}

std::vector<TradeoffSetting> variations_of(const TradeoffSetting& middle, double extent_m) {
  std::vector<TradeoffSetting> all;
  const auto add = [&](const char* kind, std::string name) -> SolveOptions& {
    all.push_back({kind, std::move(name), middle.options, middle.precision});
    return all.back().options;
  };
  const SolveOptions& m = middle.options;
  // Cheap ones first within a kind; kinds take turns, so that a short budget has something of each.
  for (const std::uint32_t n : {1u, 4u, 16u, 64u})
    if (n != m.samples) add("samples", fmt::format("samples {}", n)).samples = n;
  for (const std::uint32_t n : {m.light_samples / 4, m.light_samples * 4, m.light_samples * 16})
    if (n > 0) add("light samples", fmt::format("light samples {}", n)).light_samples = n;
  if (!m.visibility_exact) add("visibility", "visibility exact").visibility_exact = true;
  for (const double factor : {4.0, 2.0, 0.5}) {
    const double edge = short_length(m.mesh.element_edge_m * factor);
    if (edge > m.mesh.patch_edge_m) continue;
    add("elements", fmt::format("elements of {} m", length_text(edge))).mesh.element_edge_m = edge;
  }
  for (const double factor : {4.0, 2.0, 0.5}) {
    const double edge = short_length(m.mesh.patch_edge_m * factor);
    if (edge > extent_m || edge < m.mesh.element_edge_m) continue;
    add("patches", fmt::format("patches of {} m", length_text(edge))).mesh.patch_edge_m = edge;
  }
  // Elements four times as large, split up to where the middle's are, and one level further.
  for (const double tolerance : {0.2, 0.05, 0.02, 0.01}) {
    const double edge = std::min(short_length(m.mesh.element_edge_m * 4), m.mesh.patch_edge_m);
    SolveOptions& o = add("adaptive", fmt::format("adaptive {:g} from {} m", tolerance, length_text(edge)));
    o.mesh.element_edge_m = edge, o.adaptive.tolerance = tolerance, o.adaptive.max_level = 3;
  }
  for (const double eps : {1e-1, 1e-2, 1e-3, 1e-4, 1e-6})
    if (eps != m.converge) add("convergence", fmt::format("converge {:g}", eps)).converge = eps;
  for (const std::uint32_t n : {m.samples, 4 * m.samples, 16 * m.samples}) {
    SolveOptions& o = add("estimator", fmt::format("disk, samples {}", n));
    o.estimator = Estimator::disk, o.samples = n, o.visibility_exact = false;
    SolveOptions& w = add("estimator", fmt::format("subdisk, samples {}", n));
    w.estimator = Estimator::subdisk, w.samples = n, w.visibility_exact = false;
  }
  add("near field", "no near field").near_field = false;
  const bool in_double = middle.precision == Precision::float64;
  add("precision", in_double ? "float" : "double");
  all.back().precision = in_double ? Precision::float32 : Precision::float64;
  add("engine", "engine serial").engine = "serial";
  add("engine", "engine chop").engine = "chop";
  if (!m.sensors.empty())
    for (const std::uint32_t n : {m.sensor_rays / 4, m.sensor_rays * 4, m.sensor_rays * 16})
      add("sensor rays", fmt::format("sensor rays {}", n)).sensor_rays = n;
  return all;
}

std::vector<TradeoffSetting> target_settings(const SolveOptions& base) {
  std::vector<TradeoffSetting> all;
  for (const double target : {0.05, 0.01, 0.003}) {
    all.push_back({"target", fmt::format("target error {:g} %", 100 * target), base});
    all.back().options.target_error = target;
  }
  return all;
}

TradeoffSetting points_setting(double extent_m, const SolveOptions& base) {
  TradeoffSetting s{"points", "the places to compare at", base};
  set_mesh(s.options, extent_m, 4, 32);
  s.options.samples = 1, s.options.converge = 1e-2;
  s.options.error = false;
  return s;
}

TradeoffSetting reference_setting(double extent_m, const SolveOptions& base, int level) {
  TradeoffSetting s{"reference", fmt::format("reference {}", level + 1), base};
  SolveOptions& o = s.options;
  const double finer = std::ldexp(1.0, level);
  set_mesh(o, extent_m, std::min(4 * finer, 32.0), 16 * finer);
  // Another seed each: what samples leave in one reference is not what they leave in another, or in a setting.
  o.seed = base.seed + 1000 + std::uint64_t(level);
  o.samples = 4, o.light_samples = std::uint32_t(256 * std::min(finer, 64.0));
  // So many that they are not what is wrong: the mesh errs by 0.2 % at the second level in a room, the rays by 0.17 %.
  o.sensor_rays = std::uint32_t((base.sensors.empty() ? 1024 : 8192) * std::min(finer * finer, 256.0));
  o.converge = 1e-5;
  o.error = false;
  return s;
}

std::string solve_arguments(const TradeoffSetting& setting, bool with_sensors) {
  const SolveOptions& o = setting.options;
  if (o.target_error > 0)
    return fmt::format("--target-error {:g}{}", o.target_error,
                       setting.precision == Precision::float64 ? " --precision double" : "");
  std::string text =
      fmt::format("--patch-edge {:.4g} --element-edge {:.4g} --samples {} --light-samples {} --converge {:g}",
                  o.mesh.patch_edge_m, o.mesh.element_edge_m, o.samples, o.light_samples, o.converge);
  if (with_sensors) text += fmt::format(" --sensor-rays {}", o.sensor_rays);
  if (o.visibility_exact) text += " --visibility-exact";
  if (o.estimator != Estimator::exact)
    text += fmt::format(" --form-factor {}", o.estimator == Estimator::disk ? "disk" : "subdisk");
  if (o.adaptive.tolerance > 0)
    text += fmt::format(" --adaptive {:g} --max-level {}", o.adaptive.tolerance, o.adaptive.max_level);
  if (!o.near_field) text += " --no-near-field";
  if (o.engine != "auto") text += " --engine " + o.engine;
  if (setting.precision == Precision::float64) text += " --precision double";
  return text;
}

}  // namespace clrad
