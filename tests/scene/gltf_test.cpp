#include "scene/gltf_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "scene/files.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;
using Json = nlohmann::json;
using Severity = Diagnostic::Severity;
using Shorts = std::vector<std::uint16_t>;

const Json kLamp = {
    {"name", "lamp"},
    {"pbrMetallicRoughness",
     {{"baseColorFactor", {0.8, 0.6, 0.4, 1}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.1}}},
    {"emissiveFactor", {1, 0.5, 0.25}},
    {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}};

// A unit square in z = 0 facing +z, as two triangles with a lamp's material, under one node.
Gltf square(const Json& node = Json::object()) {
  Gltf g;
  const int p = g.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const int i = g.indices(Shorts{0, 1, 2, 0, 2, 3});
  g.material(kLamp);
  g.mesh({{{"attributes", {{"POSITION", p}}}, {"indices", i}, {"material", 0}}});
  Json n = node;
  n["mesh"] = 0;
  if (!n.contains("name")) n["name"] = "square";
  g.node(n);
  return g;
}

Scene load(const Gltf& g) {
  Folder folder;
  return load_scene(folder.write("a.gltf", g.text()));
}

TEST(SceneGltf, SquareIsOneQuadWithItsMaterial) {
  const Scene scene = load(square());
  ASSERT_EQ(scene.polygons.size(), 1u);
  const Polygon& p = scene.polygons[0];
  EXPECT_EQ(p.corners, 4u);
  EXPECT_EQ(p.name, "square");
  EXPECT_EQ(p.where.item, "node \"square\", primitive 0");
  EXPECT_EQ(p.normal(), glm::dvec3(0, 0, 1));
  const Material& m = scene.materials[p.material];
  EXPECT_EQ(m.reflectance, (std::vector{0.8 * 0.75, 0.6 * 0.75, 0.4 * 0.75}));
  EXPECT_EQ(m.specular, (std::vector{0.8 * 0.25, 0.6 * 0.25, 0.4 * 0.25}));
  EXPECT_TRUE(m.transmission.empty());
  EXPECT_EQ(m.emitted_exitance,
            (std::vector{8 * std::numbers::pi, 4 * std::numbers::pi, 2 * std::numbers::pi}));
  EXPECT_EQ(scene.quantity, Quantity::photometric);
  EXPECT_TRUE(scene.diagnostics.empty());
}

TEST(SceneGltf, WithoutEmissionItIsRadiometric) {
  Gltf g = square();
  g.json["materials"][0].erase("emissiveFactor");
  const Scene scene = load(g);
  EXPECT_EQ(scene.quantity, Quantity::radiometric);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"no-emitter"});
}

TEST(SceneGltf, BinaryReadsTheSame) {
  Folder folder;
  const Scene text = load(square()), binary = load_scene(folder.write("a.GLB", square().binary()));
  ASSERT_EQ(binary.polygons.size(), 1u);
  EXPECT_EQ(binary.polygons[0].corner, text.polygons[0].corner);
  EXPECT_EQ(binary.materials[0].emitted_exitance, text.materials[0].emitted_exitance);
}

TEST(SceneGltf, TransformsAreAppliedInDouble) {
  // 0.1 and 1e6 + 0.1 are no floats.
  const Scene scene = load(square({{"translation", {1e6 + 0.1, 0.1, 0}}, {"scale", {0.001, 2, 1}}}));
  EXPECT_EQ(scene.polygons[0].corner[0], glm::dvec3(1e6 + 0.1, 0.1, 0));
  EXPECT_EQ(scene.polygons[0].corner[1], glm::dvec3(1e6 + 0.1 + 0.001, 0.1, 0));
  EXPECT_EQ(scene.polygons[0].corner[2], glm::dvec3(1e6 + 0.1 + 0.001, 2.1, 0));
}

TEST(SceneGltf, HierarchyAppliesParentsLast) {
  Gltf g = square({{"translation", {1, 0, 0}}});
  const double h = std::sqrt(0.5);
  g.node({{"name", "turned"}, {"rotation", {0, 0, h, h}}, {"children", {0}}});  // 90 degrees about z
  g.node({{"name", "moved"},
          {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1}},
          {"children", {1}}});
  g.json["scenes"] = {{{"nodes", {2}}}};
  const Scene scene = load(g);
  ASSERT_EQ(scene.polygons.size(), 1u);
  // (0,0) -> (1,0) -> turned (0,1) -> (10, 22, 30); (1,1) -> (2,1) -> (-1,2) -> (8, 24, 30)
  EXPECT_NEAR(glm::distance(scene.polygons[0].corner[0], {10, 22, 30}), 0, 1e-14);
  EXPECT_NEAR(glm::distance(scene.polygons[0].corner[2], {8, 24, 30}), 0, 1e-14);
}

TEST(SceneGltf, MirroringKeepsFronts) {
  const Scene scene = load(square({{"scale", {-1, 1, 1}}}));
  ASSERT_EQ(scene.polygons.size(), 1u);
  EXPECT_EQ(scene.polygons[0].normal(), glm::dvec3(0, 0, 1));
  EXPECT_EQ(load(square({{"scale", {1, 1, -1}}})).polygons[0].normal(), glm::dvec3(0, 0, -1));
  EXPECT_EQ(load(square({{"scale", {-1, -1, 1}}})).polygons[0].normal(), glm::dvec3(0, 0, 1));
}

TEST(SceneGltf, StripsFansAndTrianglesWithoutIndices) {
  const auto faces = [](int mode, const std::vector<std::array<float, 3>>& p) {
    Gltf g;
    const int accessor = g.positions(p);
    g.material(kLamp);
    g.mesh({{{"attributes", {{"POSITION", accessor}}}, {"mode", mode}, {"material", 0}}});
    g.node({{"mesh", 0}});
    const Scene scene = load(g);
    double area = 0;
    for (const Polygon& polygon : scene.polygons) {
      EXPECT_EQ(polygon.normal(), glm::dvec3(0, 0, 1));
      EXPECT_EQ(polygon.where.item, "node 0, primitive 0");
      area += polygon.area_m2();
    }
    return std::pair(scene.polygons.size(), area);
  };
  using Result = std::pair<std::size_t, double>;
  EXPECT_EQ(faces(4, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), Result(1, 0.5));
  EXPECT_EQ(faces(5, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}, {1, 2, 0}}), Result(2, 2.0));
  EXPECT_EQ(faces(6, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}), Result(1, 1.0));
}

TEST(SceneGltf, IndicesOfEachSize) {
  for (const int size : {1, 2, 4}) {
    Gltf g;
    const int p = g.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int i = size == 1   ? g.indices(std::vector<std::uint8_t>{0, 1, 2})
                  : size == 2 ? g.indices(Shorts{0, 1, 2})
                              : g.indices(std::vector<std::uint32_t>{0, 1, 2});
    g.material(kLamp);
    g.mesh({{{"attributes", {{"POSITION", p}}}, {"indices", i}, {"material", 0}}});
    g.node({{"mesh", 0}});
    EXPECT_EQ(load(g).polygons.at(0).corner[2], glm::dvec3(0, 1, 0));
  }
}

TEST(SceneGltf, CameraLooksAlongItsMinusZ) {
  Gltf g = square();
  g.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}}}});
  g.add("cameras",
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 1}}}});
  g.node(
      {{"name", "view"}, {"camera", 0}, {"translation", {0.278, 0.273, -0.8}}, {"rotation", {0, 1, 0, 0}}});
  g.node({{"name", "plan"}, {"camera", 1}});
  const Scene scene = load(g);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "view");
  EXPECT_EQ(scene.cameras[0].eye, glm::dvec3(0.278, 0.273, -0.8));
  EXPECT_NEAR(glm::distance(scene.cameras[0].target, {0.278, 0.273, 0.2}), 0, 1e-15);
  EXPECT_NEAR(glm::distance(scene.cameras[0].up, {0, 1, 0}), 0, 1e-15);
  EXPECT_EQ(scene.cameras[0].vertical_field_of_view_rad, 0.6);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"camera-ignored"});
}

TEST(SceneGltf, OnlyTheDefaultScene) {
  Gltf g = square();
  g.node({{"mesh", 0}, {"name", "other"}, {"translation", {5, 0, 0}}});
  g.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  EXPECT_EQ(load(g).polygons.at(0).name, "square");
  g.json["scene"] = 1;
  const Scene scene = load(g);
  ASSERT_EQ(scene.polygons.size(), 1u);
  EXPECT_EQ(scene.polygons[0].name, "other");
  g.json.erase("scene");
  g.json.erase("scenes");
  EXPECT_EQ(load(g).polygons.size(), 2u) << "no scene: all root nodes";
}

TEST(SceneGltf, Warnings) {
  Gltf g = square();
  Json& material = g.json["materials"][0];
  material["doubleSided"] = true;
  material["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.1;
  material["alphaMode"] = "BLEND";
  material["emissiveTexture"] = {{"index", 0}};
  g.json["textures"] = {{{"source", 0}}};
  g.json["images"] = {{{"uri", "data:image/png;base64,AAAA"}}};
  g.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
  g.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"indices", 1}});
  const Scene scene = load(g);
  for (const char* rule :
       {"double-sided", "transparency-ignored", "texture-ignored", "primitive-ignored", "no-material"}) {
    const auto found = of_rule(scene.diagnostics, rule);
    ASSERT_EQ(found.size(), 1u) << rule;
    EXPECT_EQ(found[0].severity, Severity::warning);
    EXPECT_FALSE(found[0].where.item.empty());
  }
  ASSERT_EQ(scene.polygons.size(), 2u);
  EXPECT_EQ(scene.materials[scene.polygons[1].material].reflectance[0], 0.5);
}

TEST(SceneGltf, RoughMetalsAreDiffuseAndSaySo) {
  Gltf g = square();
  Json& pbr = g.json["materials"][0]["pbrMetallicRoughness"];
  pbr["roughnessFactor"] = 0.5;
  pbr["baseColorFactor"] = {0.8, 0.6, 1, 1};
  const Scene scene = load(g);
  const Material& m = scene.materials[0];
  EXPECT_DOUBLE_EQ(m.reflectance[0], 0.8);
  EXPECT_DOUBLE_EQ(m.reflectance[1], 0.6);
  EXPECT_EQ(m.reflectance[2], 0.99) << "a metal's, so it is not an error that it is 1 in the file";
  EXPECT_FALSE(m.is_mirror());
  ASSERT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"rough-metal"});
  EXPECT_EQ(scene.diagnostics[0].where.item, "material \"lamp\"");
}

TEST(SceneGltf, TransmissionIsGlassOfItsIndex) {
  Gltf g = square();
  Json& material = g.json["materials"][0];
  material["pbrMetallicRoughness"]["metallicFactor"] = 0;
  material["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", 0.75}};
  Scene scene = load(g);
  EXPECT_TRUE(scene.materials[0].is_glass());
  EXPECT_EQ(scene.materials[0].transmission, (std::vector{0.8 * 0.75, 0.6 * 0.75, 0.4 * 0.75}));
  EXPECT_EQ(scene.materials[0].reflectance, (std::vector{0.8 * 0.25, 0.6 * 0.25, 0.4 * 0.25}));
  EXPECT_EQ(scene.materials[0].ior, 1.5);
  EXPECT_TRUE(scene.diagnostics.empty());
  material["extensions"]["KHR_materials_ior"] = {{"ior", 1.33}};
  material["pbrMetallicRoughness"]["roughnessFactor"] = 0.6;
  scene = load(g);
  EXPECT_EQ(scene.materials[0].ior, 1.33);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"rough-glass"});
  material["pbrMetallicRoughness"]["roughnessFactor"] = 0;
  material["extensions"]["KHR_materials_ior"] = {{"ior", 0}};  // the extension's word for infinite
  scene = load(g);
  EXPECT_EQ(scene.materials[0].ior, 1.5);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"ior"});
  // A metal does not transmit.
  material["pbrMetallicRoughness"]["metallicFactor"] = 1;
  scene = load(g);
  EXPECT_TRUE(scene.materials[0].is_mirror());
  material["pbrMetallicRoughness"]["metallicFactor"] = 0;
  material["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", -0.1}};
  Folder folder;
  EXPECT_NE(load_error(folder.write("a.gltf", g.text())).find("transmits -0.08"), std::string::npos);
}

struct BadGltf {
  const char* what;
  void (*spoil)(Gltf&);
  const char *item, *rule;
};

class SceneGltfError : public testing::TestWithParam<BadGltf> {};

TEST_P(SceneGltfError, NamesNodeAndPrimitive) {
  Folder folder;
  Gltf g = square();
  GetParam().spoil(g);
  const std::string path = folder.write("a.gltf", g.text());
  const std::string message = load_error(path);
  EXPECT_TRUE(message.starts_with(path + ": " + GetParam().item)) << message;
  EXPECT_GE(of_rule(check_scene(path), GetParam().rule).size(), 1u)
      << testing::PrintToString(rules_of(check_scene(path)));
}

INSTANTIATE_TEST_SUITE_P(
    All, SceneGltfError,
    testing::Values(
        BadGltf{"IndexTooHigh",
                [](Gltf& g) {
                  g.json["meshes"][0]["primitives"][0]["indices"] = g.indices(Shorts{0, 1, 4});
                },
                "node \"square\", primitive 0: ", "index"},
        BadGltf{"NotTriangles",
                [](Gltf& g) {
                  g.json["meshes"][0]["primitives"][0]["indices"] = g.indices(Shorts{0, 1});
                },
                "node \"square\", primitive 0: ", "index"},
        BadGltf{"BufferTooShort", [](Gltf& g) { g.json["accessors"][0]["count"] = 1000; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"CountOverflows", [](Gltf& g) { g.json["accessors"][0]["count"] = 0xffffffffffffull; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"OffsetPastTheEnd", [](Gltf& g) { g.json["accessors"][1]["byteOffset"] = 1 << 20; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"NoPosition",
                [](Gltf& g) {
                  g.json["meshes"][0]["primitives"][0]["attributes"] = {{"NORMAL", 0}};
                },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"PositionNotVectors",
                [](Gltf& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 1; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"IndicesNotIntegers", [](Gltf& g) { g.json["meshes"][0]["primitives"][0]["indices"] = 0; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"NoSuchAccessor",
                [](Gltf& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 17; },
                "node \"square\", primitive 0: ", "accessor"},
        BadGltf{"NoSuchMaterial", [](Gltf& g) { g.json["meshes"][0]["primitives"][0]["material"] = 3; },
                "node \"square\", primitive 0: ", "reference"},
        BadGltf{"NoSuchMesh", [](Gltf& g) { g.json["nodes"][0]["mesh"] = 3; },
                "node \"square\": ", "reference"},
        BadGltf{"NoSuchNode", [](Gltf& g) { g.json["nodes"][0]["children"] = {9}; },
                "node \"square\": ", "reference"},
        BadGltf{"Cycle",
                [](Gltf& g) {
                  g.json["nodes"][0]["children"] = {0};
                  g.json["scenes"] = {{{"nodes", {0}}}};
                },
                "node \"square\": ", "node-cycle"},
        BadGltf{"ReflectanceOne",
                [](Gltf& g) {
                  g.json["materials"][0]["pbrMetallicRoughness"] = {{"metallicFactor", 0}};
                },
                "material \"lamp\": ", "reflectance"},
        BadGltf{"EmissionNegative",
                [](Gltf& g) {
                  g.json["materials"][0]["emissiveFactor"] = {-1, 0, 0};
                },
                "material \"lamp\": ", "emission"},
        BadGltf{"Extension", [](Gltf& g) { g.json["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
                "", "extension"},
        BadGltf{"NanPosition",
                [](Gltf& g) {
                  g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
                      g.positions({{0, 0, 0}, {1, 0, 0}, {NAN, 1, 0}, {0, 1, 0}});
                },
                "node \"square\", primitive 0: ", "coordinate"},
        BadGltf{"InfiniteTransform",
                [](Gltf& g) {
                  g.json["nodes"][0]["translation"] = {1e300, 0, 0};
                },
                "node \"square\", primitive 0: ", "coordinate"},
        BadGltf{"NoNodes", [](Gltf& g) { g.json.erase("nodes"); }, "", "no-polygons"}),
    [](const auto& each) { return std::string(each.param.what); });

TEST(SceneGltf, FilesThatCannotBeReadAtAll) {
  Folder folder;
  const std::string text = square().text(), binary = square().binary();
  const auto expect_refused = [&](const std::string& name, const std::string& content) {
    const std::string path = folder.write(name, content);
    const std::string message = load_error(path);
    EXPECT_TRUE(message.starts_with(path + ": ")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_EQ(check_scene(path).at(0).severity, Severity::error);
  };
  expect_refused("empty.gltf", "");
  expect_refused("empty.glb", "");
  expect_refused("words.gltf", "o cube\n");
  expect_refused("words.glb", "o cube and more than the twenty bytes of a header\n");
  expect_refused("array.gltf", "[]");
  expect_refused("wrong.gltf", R"({"asset": {"version": "2.0"}, "nodes": 3, "meshes": [{"primitives": 4}]})");
  for (std::size_t part = 1; part < 8; ++part) {
    expect_refused("cut.gltf", text.substr(0, text.size() * part / 8));
    expect_refused("cut.glb", binary.substr(0, binary.size() * part / 8));
  }
}

}  // namespace
