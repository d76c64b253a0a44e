#include "clrad/view_factors.hpp"

#include <gtest/gtest.h>

#include "oracle/reference.hpp"

namespace clrad {
namespace {

using oracle::json;

Device& double_device() {
  static Device device({.precision = Precision::float64});
  return device;
}

Scene scene_of_polygons(const std::vector<json>& polygons) {
  Scene scene;
  scene.file = "reference";
  scene.bands = {"grey"};
  scene.materials.push_back({"black", {0.0}, {0.0}, {}});
  for (const json& p : polygons)
    scene.polygons.push_back(oracle::polygon(p, 0, fmt::format("p{}", scene.polygons.size())));
  return scene;
}

TEST(Probe, All) {
  const json areas = oracle::reference("a_area_factors.json"), hidden = oracle::reference("b_area_occluded.json");
  for (const double target : {1e-4, 1e-6}) {
    for (const auto& c : areas.at("cases")) {
      if (!c.contains("polygon_1")) continue;
      const auto f = view_factors(double_device(), scene_of_polygons({c.at("polygon_1"), c.at("polygon_2")}),
                                  {.target_error = target});
      const double want = c.at("value"), got = f.at(0, 1);
      fmt::print("{:14} {:.3e} want {:.10f} error {:9.2e} estimate {:9.2e} points {:7} recip {:.1e}/{:.1e} {:.2f} s{}\n",
                 c.at("id").get<std::string>(), target, want, got / want - 1, f.error_at(0, 1) / want, f.points,
                 f.reciprocity.worst, f.reciprocity.estimated, f.seconds,
                 std::abs(got / want - 1) > f.error_at(0, 1) / want || f.reciprocity.worst > f.reciprocity.estimated ? " BAD" : "");
    }
    for (const auto& c : hidden.at("cases")) {
      if (!c.contains("receiver")) continue;
      std::vector<json> all{c.at("receiver"), c.at("light")};
      for (const auto& o : c.at("occluders")) all.push_back(o);
      const auto f = view_factors(double_device(), scene_of_polygons(all), {.target_error = target});
      const double want = c.at("value"), got = f.at(0, 1);
      fmt::print("{:14} {:.3e} want {:.10f} error {:9.2e} estimate {:9.2e} points {:7} recip {:.1e}/{:.1e} {:.2f} s{}\n",
                 c.at("id").get<std::string>(), target, want, got / want - 1, f.error_at(0, 1) / want, f.points,
                 f.reciprocity.worst, f.reciprocity.estimated, f.seconds,
                 std::abs(got / want - 1) > f.error_at(0, 1) / want || f.reciprocity.worst > f.reciprocity.estimated ? " BAD" : "");
    }
  }
}

}  // namespace
}  // namespace clrad
