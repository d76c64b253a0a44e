// Structs of the public interface to JSON values and back: one function a struct names its fields for both ways.
#pragma once
#include <concepts>
#include <cstdint>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "clrad/solution.hpp"

namespace clrad {

/// M is T or const T.
template <class M, class T>
concept OneOf = std::same_as<std::remove_const_t<M>, T>;

// Each function takes its struct apart as a whole: a field that is added to a struct does not compile until it is named
// here, and then archive_format goes up.

template <class Visit, OneOf<SourceLocation> M>
void visit_fields(Visit& visit, M& location) {
  auto& [file, line, item] = location;
  visit("file", file), visit("line", line), visit("item", item);
}

template <class Visit, OneOf<Material> M>
void visit_fields(Visit& visit, M& material) {
  auto& [name, reflectance, emitted_exitance, where, specular, transmission, ior, two_sided, texture] =
      material;
  visit("name", name);
  visit("reflectance", reflectance), visit("emitted_exitance", emitted_exitance);
  visit("specular", specular), visit("transmission", transmission), visit("ior", ior);
  visit("two_sided", two_sided), visit("texture", texture);
  visit("where", where);
}

/// Without its texels, which are an array of their own.
template <class Visit, OneOf<Texture> M>
void visit_fields(Visit& visit, M& texture) {
  auto& [name, width, height, wrap, texels] = texture;
  visit("name", name), visit("width", width), visit("height", height);
  visit("wrap_u", wrap[0]), visit("wrap_v", wrap[1]);
}

template <class Visit, OneOf<Camera> M>
void visit_fields(Visit& visit, M& camera) {
  auto& [name, eye, target, up, vertical_field_of_view_rad] = camera;
  visit("name", name), visit("eye_m", eye), visit("target_m", target), visit("up", up);
  visit("vertical_field_of_view_rad", vertical_field_of_view_rad);
}

template <class Visit, OneOf<PunctualLight> M>
void visit_fields(Visit& visit, M& light) {
  auto& [name, kind, position_m, direction, intensity, inner_cone_rad, outer_cone_rad, where] = light;
  visit("name", name), visit("kind", kind);
  visit("position_m", position_m), visit("direction", direction), visit("intensity", intensity);
  visit("inner_cone_rad", inner_cone_rad), visit("outer_cone_rad", outer_cone_rad), visit("where", where);
}

template <class Visit, OneOf<Diagnostic> M>
void visit_fields(Visit& visit, M& diagnostic) {
  auto& [severity, rule, where, message] = diagnostic;
  visit("severity", severity), visit("rule", rule), visit("where", where), visit("message", message);
}

template <class Visit, OneOf<Frame> M>
void visit_fields(Visit& visit, M& frame) {
  auto& [centre, exponent] = frame;
  visit("centre_m", centre), visit("exponent", exponent);
}

template <class Visit, OneOf<SensorResult> M>
void visit_fields(Visit& visit, M& sensor) {
  auto& [position_m, normal, irradiance, irradiance_error] = sensor;
  visit("position_m", position_m), visit("normal", normal);
  visit("irradiance", irradiance), visit("irradiance_error", irradiance_error);
}

template <class Visit, OneOf<Effect> M>
void visit_fields(Visit& visit, M& effect) {
  auto& [name, needed, runs, reason, skip_error_relative, stages, launches, seconds, bytes] = effect;
  visit("name", name), visit("needed", needed), visit("runs", runs), visit("reason", reason);
  visit("skip_error_relative", skip_error_relative), visit("stages", stages);
  visit("launches", launches), visit("seconds", seconds), visit("allocated_bytes", bytes);
}

template <class Visit, OneOf<Comparison> M>
void visit_fields(Visit& visit, M& comparison) {
  auto& [file, rms_relative, worst_relative, by_vertices, points] = comparison;
  visit("file", file), visit("rms_relative", rms_relative), visit("worst_relative", worst_relative);
  visit("by_vertices", by_vertices), visit("points", points);
}

template <class Visit, OneOf<Invariant> M>
void visit_fields(Visit& visit, M& invariant) {
  auto& [name, worst, allowed, holds] = invariant;
  visit("name", name), visit("worst", worst), visit("allowed", allowed), visit("holds", holds);
}

template <class Visit, OneOf<ErrorPart> M>
void visit_fields(Visit& visit, M& part) {
  auto& [name, relative, bound] = part;
  visit("name", name), visit("relative", relative), visit("bound", bound);
}

template <class Visit, OneOf<TargetStep> M>
void visit_fields(Visit& visit, M& step) {
  auto& [patch_edge, element_edge, samples, light_samples, sensor_rays, converge, error, seconds,
         predicted_error, predicted_seconds] = step;
  visit("patch_edge_m", patch_edge), visit("element_edge_m", element_edge), visit("samples", samples);
  visit("light_samples", light_samples), visit("sensor_rays", sensor_rays), visit("converge", converge);
  visit("error_relative", error), visit("seconds", seconds),
      visit("predicted_error_relative", predicted_error);
  visit("predicted_seconds", predicted_seconds);
}

template <class Visit, OneOf<decltype(Report::predicted)> M>
void visit_fields(Visit& visit, M& predicted) {
  auto& [seconds, device_bytes] = predicted;
  visit("seconds", seconds), visit("device_bytes", device_bytes);
}

template <class Visit, OneOf<decltype(Report::target)> M>
void visit_fields(Visit& visit, M& target) {
  auto& [error, budget, at_sensors, met, steps] = target;
  visit("error_relative", error), visit("time_budget_s", budget), visit("at_sensors", at_sensors);
  visit("met", met), visit("steps", steps);
}

template <class Visit, OneOf<StageProfile> M>
void visit_fields(Visit& visit, M& stage) {
  auto& [name, launches, seconds, bytes] = stage;
  visit("name", name), visit("launches", launches), visit("seconds", seconds), visit("bytes", bytes);
}

template <class Visit, OneOf<DeviceInfo> M>
void visit_fields(Visit& visit, M& info) {
  auto& [index, name, platform, driver, supports, gpu, fp64, units, memory_bytes, largest_buffer_bytes] =
      info;
  visit("index", index), visit("name", name), visit("platform", platform), visit("driver", driver);
  visit("version", supports), visit("gpu", gpu), visit("fp64", fp64), visit("compute_units", units);
  visit("memory_bytes", memory_bytes), visit("largest_buffer_bytes", largest_buffer_bytes);
}

template <class Visit, OneOf<decltype(Report::seconds)> M>
void visit_fields(Visit& visit, M& seconds) {
  auto& [import, build, solve, render, total] = seconds;
  visit("import", import), visit("build", build), visit("solve", solve), visit("render", render);
  visit("total", total);
}

template <class Visit, OneOf<decltype(Report::energy)> M>
void visit_fields(Visit& visit, M& energy) {
  auto& [closed, emitted, absorbed, unshot, unaccounted, unaccounted_relative] = energy;
  visit("closed", closed), visit("emitted", emitted), visit("absorbed", absorbed), visit("unshot", unshot);
  visit("unaccounted", unaccounted), visit("unaccounted_relative", unaccounted_relative);
}

template <class Visit, OneOf<decltype(Report::error)> M>
void visit_fields(Visit& visit, M& error) {
  auto& [total_relative, sensors_relative, parts, sensor_parts] = error;
  visit("total_relative", total_relative), visit("sensors_relative", sensors_relative);
  visit("parts", parts), visit("sensor_parts", sensor_parts);
}

template <class Visit, OneOf<decltype(Report::refinement)> M>
void visit_fields(Visit& visit, M& refinement) {
  auto& [refinements, elements_split, vertices_added, rays, by_max_level, by_min_area, by_min_projected_area,
         by_memory, as_few] = refinement;
  visit("refinements", refinements), visit("elements_split", elements_split);
  visit("vertices_added", vertices_added), visit("rays", rays);
  visit("stopped_by_max_level", by_max_level), visit("stopped_by_min_area", by_min_area);
  visit("stopped_by_min_projected_area", by_min_projected_area), visit("stopped_by_memory", by_memory);
  visit("left_as_few", as_few);
}

template <class Visit, OneOf<decltype(Report::closure)> M>
void visit_fields(Visit& visit, M& closure) {
  auto& [proven, reason, applied, before, worst_before, after, worst_after, amplification, amplified,
         converges] = closure;
  visit("proven", proven), visit("reason", reason), visit("applied", applied);
  visit("defect_before", before), visit("worst_defect_before", worst_before);
  visit("defect_after", after), visit("worst_defect_after", worst_after);
  visit("amplification", amplification), visit("amplified_defect", amplified), visit("converges", converges);
}

template <class Visit, OneOf<Report> M>
void visit_fields(Visit& visit, M& report) {
  auto& [effects, stages, shoots, reshoots, rays, pieces, candidates, exact_tests, seconds, energy, error,
         refinement, closure, comparison, predicted, target, sensor_rays, invariants, warnings,
         device_peak_bytes, host_peak_bytes, device, options] = report;
  visit("effects", effects), visit("stages", stages), visit("shoots", shoots), visit("reshoots", reshoots);
  visit("rays", rays), visit("pieces", pieces), visit("candidates", candidates);
  visit("exact_tests", exact_tests), visit("seconds", seconds), visit("energy", energy);
  visit("error", error), visit("refinement", refinement), visit("closure", closure);
  visit("comparison", comparison), visit("predicted", predicted), visit("target", target);
  visit("invariants", invariants);
  visit("warnings", warnings), visit("device_peak_bytes", device_peak_bytes);
  visit("host_peak_bytes", host_peak_bytes), visit("device", device), visit("options", options);
}

struct PutFields;
struct GetFields;

/// The JSON value of a number, a text, an enumerator, a vector or pair of such, or a struct of the above.
template <class T>
nlohmann::json put(const T& value);
template <class T>
nlohmann::json put(const std::vector<T>& values);
template <class A, class B>
nlohmann::json put(const std::pair<A, B>& values);
inline nlohmann::json put(const glm::dvec3& v) {
  return nlohmann::json::array({v.x, v.y, v.z});
}

/// What put() made, back. Throws nlohmann::json::exception where it cannot be that.
template <class T>
void get(const nlohmann::json& json, T& value);
template <class T>
void get(const nlohmann::json& json, std::vector<T>& values);
template <class A, class B>
void get(const nlohmann::json& json, std::pair<A, B>& values);
inline void get(const nlohmann::json& json, glm::dvec3& v) {
  for (int c = 0; c < 3; ++c) v[c] = json.at(std::size_t(c)).get<double>();
}

struct PutFields {
  nlohmann::json json = nlohmann::json::object();
  template <class T>
  void operator()(const char* name, const T& value) {
    json[name] = put(value);
  }
};

struct GetFields {
  const nlohmann::json& json;
  template <class T>
  void operator()(const char* name, T& value) {
    get(json.at(name), value);
  }
};

template <class T>
nlohmann::json put(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return nlohmann::json(int(value));
  } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    return nlohmann::json(value);
  } else {
    PutFields visit;
    visit_fields(visit, value);
    return std::move(visit.json);
  }
}
template <class T>
nlohmann::json put(const std::vector<T>& values) {
  nlohmann::json array = nlohmann::json::array();
  for (const T& value : values) array.push_back(put(value));
  return array;
}
template <class A, class B>
nlohmann::json put(const std::pair<A, B>& values) {
  return nlohmann::json::array({put(values.first), put(values.second)});
}

/// A whole number that T holds; the library converts whatever number is there.
template <class T>
T whole_number(const nlohmann::json& json) {
  const bool fits = json.is_number_unsigned()  ? std::in_range<T>(json.get<std::uint64_t>())
                    : json.is_number_integer() ? std::in_range<T>(json.get<std::int64_t>())
                                               : false;
  if (!fits) throw nlohmann::json::other_error::create(501, "a whole number is missing or too large", &json);
  return json.get<T>();
}

template <class T>
void get(const nlohmann::json& json, T& value) {
  if constexpr (std::is_enum_v<T>) {
    value = T(whole_number<std::uint8_t>(json));
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    value = whole_number<T>(json);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    value = json.get<T>();
  } else {
    GetFields visit{json};
    visit_fields(visit, value);
  }
}
template <class T>
void get(const nlohmann::json& json, std::vector<T>& values) {
  values.clear();
  for (std::size_t i = 0; i < json.size(); ++i) get(json.at(i), values.emplace_back());
}
template <class A, class B>
void get(const nlohmann::json& json, std::pair<A, B>& values) {
  get(json.at(0), values.first);
  get(json.at(1), values.second);
}

}  // namespace clrad
