// KHR_lights_punctual as it is read.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <numbers>

#include "scene/files.hpp"
#include "scene/gltf_text.hpp"
#include "scene/range.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;
using Json = nlohmann::json;

// A grey unit square and a node with the light.
Gltf lit_square(const Json& light, Json node = Json::object()) {
  Gltf g;
  const int p = g.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const int i = g.indices(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  g.material({{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 0}}}});
  g.mesh({{{"attributes", {{"POSITION", p}}}, {"indices", i}, {"material", 0}}});
  g.node({{"mesh", 0}});
  g.json["extensionsUsed"] = g.json["extensionsRequired"] = {"KHR_lights_punctual"};
  g.json["extensions"]["KHR_lights_punctual"]["lights"] = {light};
  if (!node.contains("extensions")) node["extensions"]["KHR_lights_punctual"]["light"] = 0;
  if (!node.contains("name")) node["name"] = "lamp";
  g.node(node);
  return g;
}

Scene loaded(const Gltf& g, double unit_m = 1) {
  const Folder folder;
  return load_scene(folder.write("a.gltf", g.text()), {unit_m});
}

std::string refused(const Json& light, const Json& node = Json::object()) {
  const Folder folder;
  return load_error(folder.write("a.gltf", lit_square(light, node).text()));
}

TEST(GltfLights, PointLight) {
  const Scene scene = loaded(
      lit_square({{"type", "point"}, {"intensity", 5e9}}, {{"translation", {1, 2, 3}}, {"scale", {7, 7, 7}}}),
      0.01);
  EXPECT_TRUE(scene.diagnostics.empty()) << scene.diagnostics[0].message;
  ASSERT_EQ(scene.lights.size(), 1u);
  const PunctualLight& light = scene.lights[0];
  EXPECT_EQ(light.kind, PunctualLight::Kind::point);
  EXPECT_EQ(light.name, "lamp");
  EXPECT_EQ(light.where.item, "node \"lamp\"");
  EXPECT_EQ(light.position_m, glm::dvec3(1 * 0.01, 2 * 0.01, 3 * 0.01));
  EXPECT_EQ(scene.bands, std::vector<std::string>{"grey"});
  EXPECT_EQ(light.intensity, std::vector{5e9})
      << "candela do not follow the unit of length or a node's scale";
  EXPECT_EQ(scene.quantity, Quantity::photometric) << "candela";
}

// Turned a quarter about x under a parent that moves and stretches it: from -z to -y... by its parent's quarter about z to +x.
TEST(GltfLights, SpotLightUnderItsNodes) {
  const double h = std::sqrt(0.5);
  Gltf g = lit_square({{"type", "spot"},
                       {"color", {1, 0.5, 0.25}},
                       {"intensity", 8},
                       {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
                      {{"rotation", {-h, 0, 0, h}}, {"translation", {0, 1, 0}}});
  g.node({{"name", "stand"},
          {"children", {1}},
          {"rotation", {0, 0, h, h}},
          {"translation", {10, 0, 0}},
          {"scale", {2, 2, 2}}});
  g.json["scenes"] = {{{"nodes", {0, 2}}}};
  const Scene scene = loaded(g);
  ASSERT_EQ(scene.lights.size(), 1u);
  const PunctualLight& light = scene.lights[0];
  EXPECT_EQ(light.kind, PunctualLight::Kind::spot);
  EXPECT_NEAR(glm::distance(light.position_m, {8, 0, 0}), 0, 1e-14);
  EXPECT_NEAR(glm::distance(light.direction, {1, 0, 0}), 0, 1e-14);
  EXPECT_EQ(light.intensity, (std::vector{8.0, 4.0, 2.0}));
  EXPECT_EQ(scene.bands.size(), 3u) << "its colour counts";
  EXPECT_EQ(light.inner_cone_rad, 0.25);
  EXPECT_EQ(light.outer_cone_rad, 0.5);
}

TEST(GltfLights, DirectionalLightAndDefaults) {
  const Scene scene = loaded(lit_square({{"type", "directional"}}));
  EXPECT_EQ(scene.lights[0].kind, PunctualLight::Kind::directional);
  EXPECT_EQ(scene.lights[0].direction, glm::dvec3(0, 0, -1));
  EXPECT_EQ(scene.lights[0].intensity, std::vector{1.0});
  const Scene spot = loaded(lit_square({{"type", "spot"}, {"spot", Json::object()}}));
  EXPECT_EQ(spot.lights[0].inner_cone_rad, 0);
  EXPECT_NEAR(spot.lights[0].outer_cone_rad, std::numbers::pi / 4, 1e-9);
}

// One light at two nodes is two lights; one that no node of the scene has is none.
TEST(GltfLights, OneLightAtManyNodes) {
  Gltf g = lit_square({{"type", "point"}});
  Json again = {{"translation", {0, 0, 5}}};
  again["extensions"]["KHR_lights_punctual"]["light"] = 0;
  g.node(again), g.node(again);
  g.json["scenes"] = {{{"nodes", {0, 1, 2}}}};
  EXPECT_EQ(loaded(g).lights.size(), 2u);
}

TEST(GltfLights, RangeIsSaidToBeIgnored) {
  const Scene scene = loaded(lit_square({{"type", "point"}, {"range", 5}}));
  ASSERT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"light-range"});
  EXPECT_EQ(scene.diagnostics[0].where.item, "node \"lamp\"");
}

TEST(GltfLights, EqualConesAreSharp) {
  const Scene scene =
      loaded(lit_square({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.5}}}}));
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"light-cone"});
}

TEST(GltfLights, OnlyDarkLightsLeaveTheSceneBlack) {
  EXPECT_EQ(rules_of(loaded(lit_square({{"type", "point"}, {"intensity", 0}})).diagnostics),
            std::vector<std::string>{"no-emitter"});
}

TEST(GltfLights, BadOnesAreRefusedWithTheirNode) {
  const Json spot = {{"type", "spot"}};
  const auto cone = [&](double inner, double outer) {
    Json light = spot;
    light["spot"] = {{"innerConeAngle", inner}, {"outerConeAngle", outer}};
    return light;
  };
  const std::pair<Json, std::string> bad[] = {
      {{{"type", "point"}, {"intensity", -1}}, "not negative"},
      {{{"type", "point"}, {"intensity", "bright"}}, "\"intensity\""},
      {{{"type", "point"}, {"color", {1, 2}}}, "\"color\""},
      {{{"type", "point"}, {"color", {1, -2, 1}}}, "not negative"},
      {{{"type", "area"}}, "\"area\""},
      {cone(0.5, 0.4), "cone"},
      {cone(-0.1, 0.4), "cone"},
      {cone(0, 1.6), "cone"},
      {cone(0, 0), "cone"},
  };
  for (const auto& [light, words] : bad) {
    const std::string message = refused(light);
    EXPECT_NE(message.find(words), std::string::npos) << light << ": " << message;
    EXPECT_NE(message.find("a.gltf: node \"lamp\""), std::string::npos) << message;
  }
  Json missing;
  missing["extensions"]["KHR_lights_punctual"]["light"] = 4;
  EXPECT_NE(refused({{"type", "point"}}, missing).find("light 4 does not exist"), std::string::npos);
  EXPECT_NE(refused({{"type", "directional"}}, {{"scale", {0, 0, 0}}}).find("no direction"),
            std::string::npos);
}

TEST(GltfLights, RangeOfIntensitiesAndPlaces) {
  const auto rules = [](const Json& light, const Json& node) {
    const Scene scene = loaded(lit_square(light, node));
    std::vector<Diagnostic> findings;
    check_range(scene, findings);
    return rules_of(findings);
  };
  using Rules = std::vector<std::string>;
  const Json node = {{"translation", {0, 0, 1}}};
  EXPECT_EQ(rules({{"type", "point"}, {"intensity", 1}}, node), Rules());
  EXPECT_EQ(rules({{"type", "point"}, {"intensity", 0}}, node), Rules());
  EXPECT_EQ(rules({{"type", "point"}, {"intensity", 1e20}}, node), Rules{"light-intensity"});
  EXPECT_EQ(rules({{"type", "directional"}, {"intensity", 1e-20}}, node), Rules{"light-intensity"});
  EXPECT_EQ(rules({{"type", "point"}}, {{"translation", {0, 2e6, 0}}}), Rules{"light-position"});
  EXPECT_EQ(rules({{"type", "directional"}}, {{"translation", {0, 2e6, 0}}}), Rules());
}

}  // namespace
