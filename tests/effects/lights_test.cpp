// The effect "lights": only where there are any, and leaving it out or forcing it does what the plan says.
#include <gtest/gtest.h>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

constexpr const char* stage_of_lights = "light from point, spot and directional lights";

const Effect& lights_effect(const std::vector<Effect>& effects) {
  return *std::find_if(effects.begin(), effects.end(), [](const Effect& e) { return e.name == "lights"; });
}

bool has_stage_of_lights(const Report& report) {
  return std::any_of(report.stages.begin(), report.stages.end(),
                     [](const StageProfile& s) { return s.name == stage_of_lights; });
}

// Each solve on a device of its own stages: the profile is that of the device.
Solution solved(const Scene& scene, const SolveOptions& options) {
  Device& device = test::device();
  device.reset_profile();
  return solve(device, scene, options);
}

PunctualLight lamp(double intensity) {
  PunctualLight light;
  light.name = "lamp";
  light.position_m = {1, 1, 1.2};
  light.intensity.assign(3, intensity);
  return light;
}

TEST(PlanLights, PairOfScenes) {
  const Scene without = oracle::block_room();
  Scene with = without;
  with.lights = {lamp(5)};
  SolveOptions options;
  options.mesh = {1, 0.5};

  const Solution plain = solved(without, options), lit = solved(with, options);
  EXPECT_FALSE(lights_effect(plain.report.effects).needed);
  EXPECT_FALSE(lights_effect(plain.report.effects).runs);
  EXPECT_EQ(lights_effect(plain.report.effects).skip_error_relative, 0);
  EXPECT_FALSE(has_stage_of_lights(plain.report)) << "launches and allocates nothing";
  EXPECT_TRUE(lights_effect(lit.report.effects).needed);
  EXPECT_TRUE(has_stage_of_lights(lit.report));
  EXPECT_NE(lit.vertex_irradiance, plain.vertex_irradiance);

  for (const char* forced_name : {"lights", "all"}) {
    SolveOptions forced = options;
    forced.force_effects = {forced_name};
    const Solution same = solved(without, forced);
    EXPECT_TRUE(has_stage_of_lights(same.report));
    EXPECT_EQ(same.vertex_irradiance, plain.vertex_irradiance);
    EXPECT_EQ(same.patch_irradiance, plain.patch_irradiance);
    EXPECT_EQ(same.unshot_relative, plain.unshot_relative);
  }
  SolveOptions left_out = options;
  left_out.without = {"lights"};
  const Solution dark = solved(with, left_out);
  EXPECT_FALSE(has_stage_of_lights(dark.report));
  EXPECT_EQ(dark.vertex_irradiance, plain.vertex_irradiance);
}

TEST(PlanLights, SaysWhatLeavingThemOutCosts) {
  Scene scene = oracle::block_room();
  const auto planned = [&] { return lights_effect(plan_effects(scene, {})); };
  EXPECT_EQ(planned().skip_error_relative, 0);
  scene.lights = {lamp(0)};
  EXPECT_EQ(planned().skip_error_relative, 0) << "of no intensity";
  scene.lights.push_back(lamp(1));
  EXPECT_LT(planned().skip_error_relative, 0) << "not known beside the lamp's light";
  for (Material& m : scene.materials) m.emitted_exitance.assign(3, 0);
  EXPECT_EQ(planned().skip_error_relative, 1) << "all light there is";
  EXPECT_NE(planned().reason.find("2 point lights"), std::string::npos) << planned().reason;
}

}  // namespace
}  // namespace clrad
