#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "clrad/output.hpp"
#include "output/support.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using nlohmann::json;
using test::polygon;

Solution reported() {
  Solution s = test::solution(
      test::scene(
          {polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}), polygon({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}})},
          3),
      0.5, [](std::uint32_t p, std::uint32_t band, auto&) { return 1.0 / 3 + p + band; });
  s.scene.file = "room \"1\".obj";
  s.unshot_relative = 0.1 + 0.2;
  s.sensors = {{{1, 2, 3}, {0, 0, 1}, {0.1, 0.2, 0.3}, {0.01, 0.02, 0.03}}};
  Report& r = s.report;
  r.effects = {{"occlusion", true, true, "a block stands in it", -1, {}, 12, 0.25, 64},
               {"bands", false, false, "all equal", 0, {}}};
  r.stages = {{"chop rays into voxels", 12, 0.25, 64}, {"deliver", 3, 1, 32}};
  r.shoots = 5, r.reshoots = 6, r.rays = 1ull << 40, r.pieces = 8, r.candidates = 9, r.exact_tests = 10;
  r.seconds = {1, 2, 3, 4, 10};
  r.energy.closed = true;
  r.energy.emitted = {1, 2, 3}, r.energy.absorbed = {1, 1, 1}, r.energy.unshot = {0, 0, 0},
  r.energy.unaccounted = {0, 1, 2};
  r.energy.unaccounted_relative = std::numeric_limits<double>::quiet_NaN();
  r.error.total_relative = 0.02;
  r.error.parts = {{"visibility", 0.01, false}, {"rounding", 1e-6, true}};
  r.predicted = {2.5, 150};
  r.target.error_relative = 0.01, r.target.met = false;
  r.target.steps = {{0.5, 0.25, 4, 256, 1024, 0.001, 0.03, 1.5}};
  r.invariants = {{"row sums", 0.001, 0.01, true}};
  r.warnings = {"no light"};
  r.device_peak_bytes = 100, r.host_peak_bytes = 200;
  r.device.name = "a device";
  r.options = {{"samples", "16"}, {"engine", "chop"}};
  return s;
}

std::set<std::string> keys(const json& object) {
  std::set<std::string> all;
  for (const auto& [key, value] : object.items()) all.insert(key);
  return all;
}
using Keys = std::set<std::string>;

TEST(ReportJson, HasTheKeysOfItsSchema) {
  const json r = json::parse(report_json(reported()));
  EXPECT_EQ(r["schema"], "clrad-report-1");
  EXPECT_EQ(
      keys(r),
      (Keys{"schema",          "program",     "scene",      "device",  "options",  "converged", "stopped",
            "unshot_relative", "effects",     "stages",     "shoots",  "reshoots", "rays",      "pieces",
            "candidates",      "exact_tests", "refinement", "closure", "seconds",  "energy",    "error",
            "predicted",       "target",      "invariants", "memory",  "warnings", "polygons",  "sensors"}));
  EXPECT_EQ(keys(r["program"]), (Keys{"version", "commit"}));
  EXPECT_EQ(keys(r["scene"]),
            (Keys{"file", "quantity", "polygons", "patches", "elements", "vertices", "bands"}));
  EXPECT_EQ(keys(r["effects"][0]), (Keys{"name", "needed", "runs", "reason", "skip_error_relative",
                                         "launches", "seconds", "allocated_bytes"}));
  EXPECT_EQ(keys(r["stages"][0]), (Keys{"name", "launches", "seconds", "allocated_bytes"}));
  EXPECT_EQ(keys(r["seconds"]), (Keys{"import", "build", "solve", "render", "total"}));
  EXPECT_EQ(keys(r["energy"]),
            (Keys{"closed", "emitted_W", "absorbed_W", "unshot_W", "unaccounted_W", "unaccounted_relative"}));
  EXPECT_EQ(keys(r["error"]), (Keys{"total_relative", "sensors_relative", "parts", "sensor_parts"}));
  EXPECT_EQ(r["predicted"]["seconds"], 2.5);
  EXPECT_EQ(r["predicted"]["actual_seconds"], 2.0 + 3.0);
  EXPECT_EQ(r["predicted"]["actual_device_bytes"], 100);
  EXPECT_EQ(r["target"]["error_relative"], 0.01);
  EXPECT_TRUE(r["target"]["time_budget_s"].is_null());
  EXPECT_FALSE(r["target"]["met"]);
  EXPECT_EQ(keys(r["target"]["steps"][0]),
            (Keys{"patch_edge_m", "element_edge_m", "samples", "light_samples", "sensor_rays", "converge",
                  "error_relative", "seconds", "predicted_error_relative", "predicted_seconds"}));
  EXPECT_EQ(keys(r["error"]["parts"][0]), (Keys{"name", "relative", "kind"}));
  EXPECT_EQ(keys(r["invariants"][0]), (Keys{"name", "worst", "allowed", "holds"}));
  EXPECT_EQ(keys(r["memory"]), (Keys{"device_peak_bytes", "host_peak_bytes"}));
  EXPECT_EQ(keys(r["polygons"][0]), (Keys{"name", "area_m2", "radiosity_W_m2", "irradiance_W_m2"}));
  EXPECT_EQ(keys(r["sensors"][0]),
            (Keys{"position_m", "normal", "irradiance_W_m2", "irradiance_error_W_m2"}));
}

TEST(ReportJson, HasTheValuesToTheLastBit) {
  const Solution s = reported();
  const json r = json::parse(report_json(s));
  EXPECT_EQ(r["scene"]["file"], s.scene.file);
  EXPECT_EQ(r["scene"]["quantity"], "radiometric");
  EXPECT_EQ(r["scene"]["polygons"], 2);
  EXPECT_EQ(r["scene"]["patches"], s.mesh.patches.size());
  EXPECT_EQ(r["scene"]["elements"], s.mesh.elements.size());
  EXPECT_EQ(r["scene"]["vertices"], s.vertex_count());
  EXPECT_EQ(r["scene"]["bands"], s.scene.bands);
  EXPECT_EQ(r["unshot_relative"].get<double>(), 0.1 + 0.2);
  EXPECT_EQ(r["rays"].get<std::uint64_t>(), 1ull << 40);
  EXPECT_TRUE(r["effects"][0]["skip_error_relative"].is_null());
  EXPECT_EQ(r["effects"][1]["skip_error_relative"], 0.0);
  EXPECT_EQ(r["effects"][0]["launches"], 12);
  EXPECT_EQ(r["effects"][0]["seconds"], 0.25);
  EXPECT_EQ(r["effects"][0]["allocated_bytes"], 64);
  EXPECT_EQ(r["effects"][1]["launches"], 0);
  EXPECT_TRUE(r["energy"]["unaccounted_relative"].is_null());  // NaN
  EXPECT_EQ(r["energy"]["unaccounted_W"], json({0.0, 1.0, 2.0}));
  EXPECT_EQ(r["error"]["parts"][0]["kind"], "estimate");
  EXPECT_EQ(r["error"]["parts"][1]["kind"], "bound");
  EXPECT_EQ(r["options"], json({{"samples", "16"}, {"engine", "chop"}}));
  EXPECT_EQ(r["device"]["name"], "a device");
  EXPECT_EQ(r["sensors"][0]["position_m"], json({1.0, 2.0, 3.0}));
  const auto means = polygon_means(s);
  for (int p : {0, 1})
    for (int band : {0, 1, 2})
      EXPECT_EQ(r["polygons"][p]["irradiance_W_m2"][band].get<double>(), means[p].irradiance[band]);
  EXPECT_EQ(r["converged"], true);
  EXPECT_EQ(r["stopped"], false);
}

TEST(ReportJson, PhotometricScenesCountLumens) {
  Solution s = reported();
  s.scene.quantity = Quantity::photometric;
  s.stopped = true;
  const json r = json::parse(report_json(s));
  EXPECT_EQ(r["scene"]["quantity"], "photometric");
  EXPECT_EQ(keys(r["energy"]), (Keys{"closed", "emitted_lm", "absorbed_lm", "unshot_lm", "unaccounted_lm",
                                     "unaccounted_relative"}));
  EXPECT_EQ(keys(r["polygons"][0]), (Keys{"name", "area_m2", "radiosity_lm_m2", "irradiance_lm_m2"}));
  EXPECT_EQ(keys(r["sensors"][0]),
            (Keys{"position_m", "normal", "irradiance_lm_m2", "irradiance_error_lm_m2"}));
  EXPECT_EQ(r["converged"], false);
  EXPECT_EQ(r["stopped"], true);
}

TEST(ReportJson, NamesThatAreNotUtf8DoNotBreakIt) {
  Solution s = reported();
  s.scene.polygons[0].name = "caf\xe9";
  EXPECT_NO_THROW(EXPECT_EQ(json::parse(report_json(s))["polygons"][0]["name"], "caf\xef\xbf\xbd"));
}

class ReportFile : public test::FileTest {};

TEST_F(ReportFile, IsTheJson) {
  write_report(in_folder("r.json"), reported());
  EXPECT_EQ(bytes(in_folder("r.json")), report_json(reported()));
}

}  // namespace
}  // namespace clrad
