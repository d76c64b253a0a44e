#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/cli.hpp"
#include "cli/solve_arguments.hpp"
#include "clrad/solver.hpp"
#include "effects/predict.hpp"
#include "output/file.hpp"
#include "scene/range.hpp"

namespace clrad::cli {
namespace {

struct PlanArguments {
  std::string scene, unit = "m", json;
  SidesArguments sides;
  SolveArguments solve;
};

std::string bytes_text(double bytes) {
  if (std::isnan(bytes)) return "?";
  if (bytes < 1024) return fmt::format("{:.0f} B", bytes);
  if (bytes < 0x1p20) return fmt::format("{:.0f} KiB", bytes / 0x1p10);
  return bytes < 0x1p30 ? fmt::format("{:.0f} MiB", bytes / 0x1p20)
                        : fmt::format("{:.1f} GiB", bytes / 0x1p30);
}

std::string seconds_text(double seconds) {
  if (std::isnan(seconds)) return "?";
  return seconds < 10 ? fmt::format("{:.2f}", seconds) : fmt::format("{:.0f}", seconds);
}

std::string error_text(const Effect& effect) {
  if (effect.skip_error_relative < 0) return "unknown";
  return effect.skip_error_relative == 0 ? "none" : fmt::format("{:.2g}", effect.skip_error_relative);
}

// Lines of at most `width` characters, the ones after the first indented.
std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
  std::string result;
  std::size_t column = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    if (column > 0 && column + 1 + (end - at) > width) {
      result += "\n" + std::string(indent, ' ');
      column = 0;
    } else if (column > 0) {
      result += ' ', ++column;
    }
    result += text.substr(at, end - at), column += end - at;
    at = end + 1;
  }
  return result;
}

void print_plan(const Scene& scene, const std::vector<Effect>& effects, const Prediction& p) {
  fmt::print(
      "{}: {} polygons; about {:.0f} patches, {:.0f} elements, {:.0f} vertices, {:.0f} shoots, {:.2g} "
      "rays\n\n",
      scene.file, scene.polygons.size(), p.patches, p.elements, p.vertices, p.shoots, p.rays);
  constexpr const char* row = "{:<22} {:<7} {:>8} {:>9} {:>9}  {}\n";
  fmt::print(row, "effect", "runs", "seconds", "memory", "if not", "why");
  fmt::print(row, p.parts[0].name, "always", seconds_text(p.parts[0].seconds),
             bytes_text(p.parts[0].device_bytes), "", "");
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const Effect& e = effects[i];
    const char* verdict = e.runs ? (e.needed ? "yes" : "forced") : e.needed ? "left out" : "no";
    fmt::print(row, e.name, verdict, e.runs ? seconds_text(p.parts[i + 1].seconds) : "",
               e.runs ? bytes_text(p.parts[i + 1].device_bytes) : "", error_text(e),
               wrapped(e.reason, 60, 61));
  }
  fmt::print(row, "all", "", seconds_text(p.seconds), bytes_text(p.device_bytes), "", "");
  fmt::print(
      "\n\"if not\": the error of not running it, relative to all light. Seconds are predicted from a probe "
      "of the "
      "device, without pictures, files and loading kernels.\n");
}

void print_forecast(const SolveOptions& asked, const TargetForecast& f) {
  const SolveOptions& o = f.options;
  fmt::print("\nfor {}: patches of {:.3g} m, elements of {:.3g} m, {} samples, {} of lamps{}\n",
             asked.target_error > 0 ? fmt::format("--target-error {:.3g}%", 100 * asked.target_error)
                                    : fmt::format("--time-budget {:.3g}s", asked.time_budget_s),
             o.mesh.patch_edge_m, o.mesh.element_edge_m, o.samples, o.light_samples,
             o.sensors.empty() ? "" : fmt::format(", {} rays a sensor", o.sensor_rays));
  fmt::print(
      "an error of {:.2g} % after {} s{}; foretold by coarse solves of {} s. The table above is of that last "
      "solve alone.\n",
      100 * f.error_relative, seconds_text(f.seconds),
      f.meets ? "" : ", which is more than the target: nothing finer is within reach",
      seconds_text(f.probing_seconds));
}

std::string plan_json(const Scene& scene, const std::vector<Effect>& effects, const Prediction& p,
                      const TargetForecast* forecast) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["schema"] = "clrad-plan-1";
  json["scene"] = {{"file", scene.file}, {"polygons", scene.polygons.size()}, {"bands", scene.bands}};
  json["predicted"] = {
      {"patches", p.patches}, {"elements", p.elements}, {"vertices", p.vertices},        {"shoots", p.shoots},
      {"rays", p.rays},       {"seconds", p.seconds},   {"device_bytes", p.device_bytes}};
  if (forecast) {
    const SolveOptions& o = forecast->options;
    json["target"] = {{"patch_edge_m", o.mesh.patch_edge_m},
                      {"element_edge_m", o.mesh.element_edge_m},
                      {"samples", o.samples},
                      {"light_samples", o.light_samples},
                      {"sensor_rays", o.sensor_rays},
                      {"error_relative", forecast->error_relative},
                      {"meets", forecast->meets},
                      {"seconds", forecast->seconds},
                      {"probing_seconds", forecast->probing_seconds}};
  }
  json["effects"] = Json::array();
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const Effect& e = effects[i];
    json["effects"].push_back(
        {{"name", e.name},
         {"needed", e.needed},
         {"runs", e.runs},
         {"reason", e.reason},
         {"skip_error_relative", e.skip_error_relative < 0 ? Json(nullptr) : Json(e.skip_error_relative)},
         {"predicted_seconds", p.parts[i + 1].seconds},
         {"predicted_device_bytes", p.parts[i + 1].device_bytes}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

int run_plan(PlanArguments& a) {
  a.solve.options.adaptive.width = a.solve.options.adaptive.height = 640;
  a.solve.parse();
  check_place("--json", a.json);
  const double unit_m = parse_unit(a.unit);
  const Scene scene = load_scene(a.scene, {.unit_m = unit_m, .sides = a.sides.resolved()});
  print_diagnostics(scene.diagnostics, stderr);
  SolveOptions& options = a.solve.options;
  if (!a.solve.sensors.empty()) options.sensors = load_sensors(a.solve.sensors, unit_m);
  require_range(scene);
  Device device(a.solve.device.resolved());
  std::optional<TargetForecast> target;
  if (options.target_error > 0 || options.time_budget_s > 0) target = forecast(device, scene, options);
  const SolveOptions& chosen = target ? target->options : options;
  const std::vector<Effect> effects = plan_effects(scene, chosen);
  const Prediction prediction = predict(device, scene, chosen, effects);
  print_plan(scene, effects, prediction);
  if (target) print_forecast(options, *target);
  if (!a.json.empty()) {
    write_file(a.json, plan_json(scene, effects, prediction, target ? &*target : nullptr));
    fmt::print("wrote {}\n", a.json);
  }
  return done;
}

}  // namespace

void add_plan(CLI::App& app, Action& action) {
  CLI::App* verb =
      app.add_subcommand("plan",
                         "say which effects a scene calls for and why, and what a solve would take; nothing "
                         "is solved but for a coarse try or two with --target-error or --time-budget");
  const auto a = std::make_shared<PlanArguments>();
  verb->add_option("scene", a->scene, "OBJ, glTF or GLB file")->required();
  verb->add_option("--json", a->json, "write the plan here");
  verb->add_option("--unit", a->unit, "length of one unit of the file: mm, cm, m, in, ft or metres")
      ->capture_default_str();
  a->sides.add_to(*verb);
  a->solve.add_to(*verb);
  verb->callback([a, &action] { action = [a] { return run_plan(*a); }; });
}

}  // namespace clrad::cli
