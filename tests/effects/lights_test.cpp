// The effect "lights": only where there are any, and leaving it out or forcing it does what the plan says.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

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

  SolveOptions forced = options;
  forced.force_effects = {"lights"};
  const Solution same = solved(without, forced);
  EXPECT_TRUE(has_stage_of_lights(same.report));
  EXPECT_EQ(same.vertex_irradiance, plain.vertex_irradiance);
  EXPECT_EQ(same.patch_irradiance, plain.patch_irradiance);
  EXPECT_EQ(same.unshot_relative, plain.unshot_relative);
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

// What other effects are skipped for has to hold of the lights, too.
TEST(PlanLights, OtherEffectsKnowOfThem) {
  const auto runs_of = [](const Scene& scene, const char* name, const SolveOptions& options = {}) {
    return runs(plan_effects(scene, options), name);
  };
  Scene room = oracle::box_scene({1, 1, 1}, {0.5, 0.5, 0.5}, {0, 0, 0});
  PunctualLight light = lamp(1);
  light.position_m = {0.5, 0.5, 0.5};
  room.lights = {light};
  EXPECT_FALSE(runs_of(room, "occlusion")) << "a light in a convex room";
  EXPECT_FALSE(runs_of(room, "colour"));
  room.lights[0].position_m.x = 1.5;
  EXPECT_TRUE(runs_of(room, "occlusion")) << "and outside of it";
  room.lights[0].kind = PunctualLight::Kind::directional;
  EXPECT_TRUE(runs_of(room, "occlusion")) << "comes in through a wall's back";
  room.polygons.resize(5);  // without the ceiling, which is at z = 1
  room.lights[0].direction = {0, 0, -1};
  EXPECT_FALSE(runs_of(room, "occlusion")) << "along the walls and onto the floor";
  room.lights[0].direction = glm::normalize(glm::dvec3(0.1, 0, -1));
  EXPECT_TRUE(runs_of(room, "occlusion"));

  room.lights[0].intensity = {1, 0.5, 0.25};
  EXPECT_FALSE(runs_of(room, "colour")) << "one colour of light, solved once";
  light.intensity = {1, 1, 1};
  room.lights.push_back(light);
  EXPECT_TRUE(runs_of(room, "colour"));

  Scene furnace = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  SolveOptions adaptive;
  adaptive.adaptive.tolerance = 0.1;
  EXPECT_FALSE(runs_of(furnace, "subdivision", adaptive));
  furnace.lights = {lamp(1)};
  furnace.lights[0].intensity = {1};
  EXPECT_TRUE(runs_of(furnace, "subdivision", adaptive)) << "not equally bright any more";
}

// One band solved and scaled is what three are; a light of no mirror in a convex room needs no rays.
TEST(PlanLights, SkippedEffectsChangeNothing) {
  Scene room = oracle::box_scene({1, 1, 1}, {0.5, 0.5, 0.5}, {0, 0, 0});
  room.lights = {lamp(1)};
  room.lights[0].position_m = {0.3, 0.4, 0.5};
  room.lights[0].intensity = {1, 0.5, 0.25};  // powers of two: scaling is exact
  SolveOptions options;
  options.mesh = {0.5, 0.125};
  options.without = {};
  const Solution planned = solved(room, options);
  options.force_effects = {"colour", "occlusion"};
  const Solution forced = solved(room, options);
  ASSERT_EQ(planned.vertex_irradiance.size(), forced.vertex_irradiance.size());
  // The solve stops by what all bands have unshot, so shots may differ: twice converge of the brightest.
  const double most = *std::max_element(forced.vertex_irradiance.begin(), forced.vertex_irradiance.end());
  for (std::size_t i = 0; i < forced.vertex_irradiance.size(); ++i)
    ASSERT_NEAR(planned.vertex_irradiance[i], forced.vertex_irradiance[i], 2e-3 * most);
}

// Direct light only: what is reflected goes no further, and lights' is direct.
TEST(PlanLights, WithoutInterreflection) {
  Scene room = oracle::box_scene({1, 1, 1}, {0.5}, {0});
  room.lights = {lamp(1)};
  room.lights[0].position_m = {0.3, 0.4, 0.5};
  room.lights[0].intensity = {1};
  SolveOptions options;
  options.mesh = {0.5, 0.125};
  options.without = {"interreflection"};
  const Solution direct = solved(room, options);
  room.materials[0].reflectance = {0};
  options.without = {};
  EXPECT_EQ(direct.vertex_irradiance, solved(room, options).vertex_irradiance);
  EXPECT_LT(std::abs(direct.report.energy.unaccounted_relative), 0.01);  // of the mesh
}

}  // namespace
}  // namespace clrad
