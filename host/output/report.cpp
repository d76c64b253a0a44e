#include <cmath>
#include <nlohmann/json.hpp>

#include "clrad/output.hpp"
#include "version.hpp"

namespace clrad {
namespace {

using Json = nlohmann::ordered_json;

Json vector3(const glm::dvec3& v) {
  return Json::array({v.x, v.y, v.z});
}

// Keys of physical quantities end in their unit.
struct Units {
  std::string power, flux_density;
  explicit Units(Quantity quantity)
      : power(quantity == Quantity::photometric ? "_lm" : "_W"), flux_density(power + "_m2") {}
};

Json scene_json(const Solution& solution) {
  const Scene& scene = solution.scene;
  return {{"file", scene.file},
          {"quantity", scene.quantity == Quantity::photometric ? "photometric" : "radiometric"},
          {"polygons", scene.polygons.size()},
          {"patches", solution.mesh.patches.size()},
          {"elements", solution.mesh.elements.size()},
          {"vertices", solution.vertex_count()},
          {"bands", scene.bands}};
}

Json device_json(const DeviceInfo& device) {
  return {{"index", device.index},
          {"name", device.name},
          {"platform", device.platform},
          {"driver", device.driver},
          {"version", device.version},
          {"gpu", device.gpu},
          {"fp64", device.fp64},
          {"compute_units", device.compute_units},
          {"memory_bytes", device.memory_bytes},
          {"largest_buffer_bytes", device.largest_buffer_bytes}};
}

Json effects_json(const Report& report) {
  Json all = Json::array();
  for (const Effect& effect : report.effects) {
    const bool known = effect.skip_error_relative >= 0;
    all.push_back({{"name", effect.name},
                   {"needed", effect.needed},
                   {"runs", effect.runs},
                   {"reason", effect.reason},
                   {"skip_error_relative", known ? Json(effect.skip_error_relative) : Json(nullptr)},
                   {"launches", effect.launches},
                   {"seconds", effect.seconds},
                   {"allocated_bytes", effect.allocated_bytes}});
  }
  return all;
}

Json error_json(const Report& report) {
  const auto list = [](const std::vector<ErrorPart>& parts) {
    Json all = Json::array();
    for (const ErrorPart& part : parts)
      all.push_back(
          {{"name", part.name}, {"relative", part.relative}, {"kind", part.bound ? "bound" : "estimate"}});
    return all;
  };
  return {{"total_relative", report.error.total_relative},
          {"sensors_relative", report.error.sensors_relative},
          {"parts", list(report.error.parts)},
          {"sensor_parts", list(report.error.sensor_parts)}};
}

Json target_json(const Report& report) {
  Json steps = Json::array();
  for (const TargetStep& s : report.target.steps)
    steps.push_back({{"patch_edge_m", s.patch_edge_m},
                     {"element_edge_m", s.element_edge_m},
                     {"samples", s.samples},
                     {"light_samples", s.light_samples},
                     {"sensor_rays", s.sensor_rays},
                     {"converge", s.converge},
                     {"error_relative", s.error_relative},
                     {"seconds", s.seconds},
                     {"predicted_error_relative", s.predicted_error_relative},
                     {"predicted_seconds", s.predicted_seconds}});
  const auto asked = [](double value) { return value > 0 ? Json(value) : Json(nullptr); };
  return {{"error_relative", asked(report.target.error_relative)},
          {"time_budget_s", asked(report.target.time_budget_s)},
          {"of", report.target.at_sensors ? "sensors" : "scene"},
          {"met", report.target.met},
          {"steps", steps}};
}

Json polygons_json(const Solution& solution, const Units& units) {
  Json all = Json::array();
  const auto means = polygon_means(solution);
  for (std::size_t p = 0; p < means.size(); ++p)
    all.push_back({{"name", solution.scene.polygons[p].name},
                   {"area_m2", means[p].area_m2},
                   {"radiosity" + units.flux_density, means[p].radiosity},
                   {"irradiance" + units.flux_density, means[p].irradiance}});
  return all;
}

Json sensors_json(const Solution& solution, const Units& units) {
  Json all = Json::array();
  for (const SensorResult& sensor : solution.sensors)
    all.push_back({{"position_m", vector3(sensor.position_m)},
                   {"normal", vector3(sensor.normal)},
                   {"irradiance" + units.flux_density, sensor.irradiance},
                   {"irradiance_error" + units.flux_density, sensor.irradiance_error}});
  return all;
}

}  // namespace

std::string report_json(const Solution& solution) {
  const Report& report = solution.report;
  const Units units(solution.scene.quantity);
  Json json;
  json["schema"] = "clrad-report-1";
  json["program"] = {{"version", version}, {"commit", commit}};
  json["scene"] = scene_json(solution);
  json["device"] = device_json(report.device);
  json["options"] = Json::object();
  for (const auto& [name, value] : report.options) json["options"][name] = value;
  json["converged"] = !solution.stopped && report.closure.converges;
  json["stopped"] = solution.stopped;
  json["unshot_relative"] = solution.unshot_relative;
  json["effects"] = effects_json(report);
  json["stages"] = Json::array();
  for (const StageProfile& stage : report.stages)
    json["stages"].push_back({{"name", stage.name},
                              {"launches", stage.launches},
                              {"seconds", stage.seconds},
                              {"allocated_bytes", stage.bytes}});
  json["shoots"] = report.shoots;
  json["reshoots"] = report.reshoots;
  json["rays"] = report.rays;
  json["pieces"] = report.pieces;
  json["candidates"] = report.candidates;
  json["exact_tests"] = report.exact_tests;
  const auto& refinement = report.refinement;
  json["refinement"] = {{"refinements", refinement.refinements},
                        {"elements_split", refinement.elements_split},
                        {"vertices_added", refinement.vertices_added},
                        {"rays", refinement.rays},
                        {"stopped_by",
                         {{"max_level", refinement.stopped_by_max_level},
                          {"min_area", refinement.stopped_by_min_area},
                          {"min_projected_area", refinement.stopped_by_min_projected_area},
                          {"memory", refinement.stopped_by_memory},
                          {"few_left", refinement.left_as_few}}}};
  json["seconds"] = {{"import", report.seconds.import},
                     {"build", report.seconds.build},
                     {"solve", report.seconds.solve},
                     {"render", report.seconds.render},
                     {"total", report.seconds.total}};
  json["energy"] = {{"closed", report.energy.closed},
                    {"emitted" + units.power, report.energy.emitted},
                    {"absorbed" + units.power, report.energy.absorbed},
                    {"unshot" + units.power, report.energy.unshot},
                    {"unaccounted" + units.power, report.energy.unaccounted},
                    {"unaccounted_relative", report.energy.unaccounted_relative}};
  const auto& closure = report.closure;
  json["closure"] = {{"proven", closure.proven},
                     {"reason", closure.reason},
                     {"applied", closure.applied},
                     {"defect_before", closure.defect_before},
                     {"worst_defect_before", closure.worst_defect_before},
                     {"defect_after", closure.defect_after},
                     {"worst_defect_after", closure.worst_defect_after},
                     {"amplification", closure.amplification},
                     {"amplified_defect", closure.amplified_defect}};
  json["error"] = error_json(report);
  if (std::isfinite(report.predicted.seconds))
    json["predicted"] = {{"seconds", report.predicted.seconds},
                         {"actual_seconds", report.seconds.build + report.seconds.solve},
                         {"device_bytes", report.predicted.device_bytes},
                         {"actual_device_bytes", report.device_peak_bytes}};
  if (!report.target.steps.empty()) json["target"] = target_json(report);
  const Comparison& other = report.comparison;
  if (!other.file.empty())
    json["comparison"] = {{"file", other.file},
                          {"rms_relative", other.rms_relative},
                          {"worst_relative", other.worst_relative},
                          {"points", other.points},
                          {"at", other.by_vertices ? "vertices" : "polygons"}};
  json["invariants"] = Json::array();
  for (const Invariant& invariant : report.invariants)
    json["invariants"].push_back({{"name", invariant.name},
                                  {"worst", invariant.worst},
                                  {"allowed", invariant.allowed},
                                  {"holds", invariant.holds}});
  json["memory"] = {{"device_peak_bytes", report.device_peak_bytes},
                    {"host_peak_bytes", report.host_peak_bytes}};
  json["warnings"] = report.warnings;
  json["polygons"] = polygons_json(solution, units);
  json["sensors"] = sensors_json(solution, units);
  // A NaN or infinity is written as null; names that are not UTF-8 get replacement characters.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_report(const std::string& path, const Solution& solution) {
  write_file(path, report_json(solution));
}

}  // namespace clrad
