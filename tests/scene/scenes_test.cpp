/// The scenes that come with clrad, and those that make_scene makes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <glm/geometric.hpp>
#include <numbers>
#include <sstream>

#include "scene/files.hpp"
#include "scene/planes.hpp"
#include "scene/topology.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;

const std::string kScenes = CLRAD_SCENES;

const Polygon& named(const Scene& scene, const std::string& name) {
  const auto found = std::find_if(scene.polygons.begin(), scene.polygons.end(),
                                  [&](const Polygon& p) { return p.name == name; });
  if (found == scene.polygons.end()) throw std::runtime_error("no polygon " + name);
  return *found;
}

TEST(SceneFiles, CornellBox) {
  const Scene scene = load_scene(kScenes + "/cornell.obj");
  EXPECT_TRUE(scene.diagnostics.empty());
  ASSERT_EQ(scene.polygons.size(), 20u);
  EXPECT_EQ(scene.polygons[0].name, "floor");
  EXPECT_EQ(scene.polygons[19].name, "tall_side3");
  EXPECT_EQ(named(scene, "floor").corner[2], glm::dvec3(0, 0, 0.5592));
  const Material& light = scene.materials[named(scene, "light").material];
  EXPECT_EQ(light.emitted_exitance, (std::vector{18.4, 15.6, 8.0}));
  EXPECT_EQ(light.reflectance, (std::vector{0.78, 0.78, 0.78}));
  EXPECT_EQ(scene.materials[named(scene, "left_red_b").material].reflectance,
            (std::vector{0.63, 0.065, 0.05}));
  EXPECT_EQ(named(scene, "floor").normal(), glm::dvec3(0, 1, 0));
  EXPECT_EQ(named(scene, "light").normal(), glm::dvec3(0, -1, 0));
  EXPECT_FALSE(is_watertight(scene)) << "the front is open";
  // Light and the four pieces of ceiling lie in one plane, the halves of the left wall in two.
  const auto ids = plane_ids(scene);
  for (int p = 2; p <= 5; ++p) EXPECT_EQ(ids[p], ids[1]);
  EXPECT_NE(ids[8], ids[9]);
}

TEST(SceneFiles, CornellBoxAsGltfIsTheSameRoom) {
  const Scene obj = load_scene(kScenes + "/cornell.obj"), gltf = load_scene(kScenes + "/cornell.gltf");
  EXPECT_TRUE(gltf.diagnostics.empty());
  EXPECT_EQ(gltf.quantity, Quantity::photometric);
  ASSERT_EQ(gltf.polygons.size(), obj.polygons.size());
  for (std::size_t p = 0; p < obj.polygons.size(); ++p) {
    const Polygon &a = obj.polygons[p], &b = gltf.polygons[p];
    EXPECT_EQ(a.name, b.name);
    ASSERT_EQ(a.corners, b.corners);
    for (std::uint32_t i = 0; i < a.corners; ++i) {
      // Whole tenths of a millimetre times 1e-4, rounded once more than the decimal number: an ulp below 1 m.
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(a.corner[i][k], b.corner[i][k], 0x1p-53) << a.name;
    }
    const Material &m = obj.materials[a.material], &n = gltf.materials[b.material];
    EXPECT_EQ(m.name, n.name);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(m.reflectance[k], n.reflectance[k]);
      EXPECT_DOUBLE_EQ(m.emitted_exitance[k], n.emitted_exitance[k]);
    }
  }
  ASSERT_EQ(gltf.cameras.size(), 1u);
  EXPECT_EQ(gltf.cameras[0].eye, glm::dvec3(0.278, 0.273, -0.8));
  const glm::dvec3 forward = gltf.cameras[0].target - gltf.cameras[0].eye;
  EXPECT_NEAR(glm::distance(forward, glm::dvec3(0, 0, 1)), 0, 1e-15);
  EXPECT_NEAR(gltf.cameras[0].vertical_field_of_view_rad * 180 / std::numbers::pi, 39.3, 0.05);
}

TEST(SceneFiles, MirrorRoom) {
  const Scene scene = load_scene(kScenes + "/mirror_room.obj");
  EXPECT_TRUE(scene.diagnostics.empty());
  ASSERT_EQ(scene.polygons.size(), 39u);
  const Material& light = scene.materials[named(scene, "light").material];
  for (int k = 0; k < 3; ++k) EXPECT_DOUBLE_EQ(light.emitted_exitance[k], (std::array{20.0, 18.0, 15.0}[k]));
  EXPECT_TRUE(scene.materials[named(scene, "mirror_front").material].is_mirror());
  EXPECT_TRUE(scene.materials[named(scene, "steel_top").material].is_mirror());
  const Material& glass = scene.materials[named(scene, "glass_front").material];
  EXPECT_TRUE(glass.is_glass());
  EXPECT_EQ(glass.ior, 1.5);
  // The glass block is a closed surface, so a solid; the room is open.
  const auto closed = closed_surfaces(scene);
  for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
    const bool room = p < 9;
    EXPECT_EQ(closed[p] == 0xffffffffu, room) << scene.polygons[p].name;
  }
}

TEST(SceneFiles, BlockRoom) {
  const Scene scene = load_scene(kScenes + "/block_room.obj");
  EXPECT_TRUE(scene.diagnostics.empty());
  ASSERT_EQ(scene.polygons.size(), 15u);
  const Material& light = scene.materials[named(scene, "light").material];
  EXPECT_EQ(light.reflectance, (std::vector{0.0, 0.0, 0.0}));
  EXPECT_EQ(light.emitted_exitance[0], 10.0);
  EXPECT_EQ(light.emitted_exitance[1], 9.0);
  EXPECT_DOUBLE_EQ(light.emitted_exitance[2], 7.0) << "no double times pi is 7";
  EXPECT_EQ(named(scene, "block_z_max").normal(), glm::dvec3(0, 0, 1));
  EXPECT_EQ(named(scene, "z_min").normal(), glm::dvec3(0, 0, 1));
  EXPECT_EQ(named(scene, "block_x_min").normal(), glm::dvec3(-1, 0, 0));
}

TEST(SceneFiles, KeldyshCube) {
  const Scene scene = load_scene(kScenes + "/keldysh.gltf");
  EXPECT_TRUE(scene.diagnostics.empty());
  EXPECT_EQ(scene.quantity, Quantity::photometric);
  EXPECT_EQ(scene.bands, std::vector<std::string>{"grey"});
  ASSERT_EQ(scene.polygons.size(), 6u);
  EXPECT_TRUE(is_watertight(scene));
  for (const Polygon& p : scene.polygons) {
    EXPECT_EQ(p.area_m2(), 100.0);
    EXPECT_GT(glm::dot(p.normal(), glm::dvec3(5) - p.corner[0]), 0) << p.name;
    EXPECT_EQ(scene.materials[p.material].reflectance, std::vector{2.0 / 3});
  }
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(scene.lights[0].kind, PunctualLight::Kind::point);
  EXPECT_EQ(scene.lights[0].position_m, glm::dvec3(5));
  EXPECT_EQ(scene.lights[0].intensity, std::vector{50000.0});
}

TEST(SceneFiles, CubesAreClosedAndFaceInward) {
  for (const char* name : {"/furnace.obj", "/goral.obj"}) {
    const Scene scene = load_scene(kScenes + name);
    EXPECT_TRUE(scene.diagnostics.empty());
    ASSERT_EQ(scene.polygons.size(), 6u);
    EXPECT_TRUE(is_watertight(scene));
    for (const Polygon& p : scene.polygons) {
      EXPECT_EQ(p.area_m2(), 1.0);
      EXPECT_GT(glm::dot(p.normal(), glm::dvec3(0.5) - p.corner[0]), 0) << p.name;
    }
  }
  const Scene furnace = load_scene(kScenes + "/furnace.obj");
  EXPECT_EQ(furnace.bands, std::vector<std::string>{"grey"});
  EXPECT_EQ(furnace.materials[0].emitted_exitance, std::vector{1.0});
  EXPECT_EQ(furnace.materials[0].reflectance, std::vector{0.5});
}

// Runs make_scene; its exit status.
int make(const std::string& arguments) {
  const std::string command =
      std::string("\"") + CLRAD_BINARY_DIR + "/scenes/make_scene\" " + arguments + " > /dev/null";
  return std::system(command.c_str());
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Loads a made scene: no errors or repairs, each object closed, sizes as said.
Scene expect_sound(const std::string& path) {
  const auto findings = check_scene(path);
  EXPECT_TRUE(findings.empty()) << testing::PrintToString(rules_of(findings));
  const Scene scene = load_scene(path);
  for (const Polygon& p : scene.polygons) {
    EXPECT_GT(p.area_m2(), 1e-6) << p.where.text();
    const double up = p.normal().z;
    EXPECT_TRUE(p.name != "floor" || up == 1) << p.where.text();
    EXPECT_TRUE(p.name != "ceiling" || up == -1) << p.where.text();
  }
  return scene;
}

std::size_t triangles_of(const Scene& scene) {
  std::size_t count = 0;
  for (const Polygon& p : scene.polygons) count += p.corners - 2;
  return count;
}

// The volume that closed objects enclose, minus the room's: negative, since the room faces inward.
double volume_of(const Scene& scene) {
  double six = 0;
  for (const Polygon& p : scene.polygons) {
    for (std::uint32_t i = 2; i < p.corners; ++i) {
      six += glm::dot(p.corner[0], glm::cross(p.corner[i - 1], p.corner[i]));
    }
  }
  return six / 6;
}

TEST(SceneMaker, OfficeHasItsDesks) {
  Folder folder;
  ASSERT_EQ(make("office --desks 4 -o " + folder.at("office.obj")), 0);
  const Scene scene = expect_sound(folder.at("office.obj"));
  EXPECT_EQ(triangles_of(scene), 12u + 4 * 524u);
  EXPECT_TRUE(is_watertight(scene));
  // A room of 5.4 x 5.8 x 3 m, furniture under 1 m^3 a desk.
  EXPECT_GT(volume_of(scene), -5.4 * 5.8 * 3);
  EXPECT_LT(volume_of(scene), -5.4 * 5.8 * 3 + 4);
}

TEST(SceneMaker, HallHasItsColumns) {
  Folder folder;
  ASSERT_EQ(make("hall --columns 3 --sides 16 -o " + folder.at("hall.obj")), 0);
  const Scene scene = expect_sound(folder.at("hall.obj"));
  EXPECT_EQ(triangles_of(scene), 12u + 3 * (18 * 16 + 24) + 2 * 12);
  EXPECT_TRUE(is_watertight(scene));
}

TEST(SceneMaker, BoxesOfAnyPolygonCount) {
  Folder folder;
  for (const int count : {12, 13, 17, 18, 100, 1003}) {
    ASSERT_EQ(make("boxes --polygons " + std::to_string(count) + " --seed 3 -o " + folder.at("boxes.obj")),
              0);
    const Scene scene = expect_sound(folder.at("boxes.obj"));
    EXPECT_EQ(scene.polygons.size(), std::size_t(count));
    EXPECT_TRUE(is_watertight(scene));
  }
}

TEST(SceneMaker, SameArgumentsSameFile) {
  Folder folder;
  ASSERT_EQ(make("boxes --polygons 60 --seed 1 -o " + folder.at("a.obj")), 0);
  const std::string first = text_of(folder.at("a.obj")), first_mtl = text_of(folder.at("a.mtl"));
  ASSERT_EQ(make("boxes --polygons 60 --seed 1 -o " + folder.at("a.obj")), 0);
  EXPECT_EQ(text_of(folder.at("a.obj")), first);
  EXPECT_EQ(text_of(folder.at("a.mtl")), first_mtl);
  ASSERT_EQ(make("boxes --polygons 60 --seed 2 -o " + folder.at("a.obj")), 0);
  EXPECT_NE(text_of(folder.at("a.obj")), first);
}

TEST(SceneMaker, RefusesWhatItCannotDo) {
  Folder folder;
  EXPECT_EQ(make("--help"), 0);
  EXPECT_NE(make("boxes --polygons 11 -o " + folder.at("a.obj") + " 2> /dev/null"), 0);
  EXPECT_NE(make("hall --sides 2 -o " + folder.at("a.obj") + " 2> /dev/null"), 0);
  EXPECT_NE(make("office -o " + folder.at("a.txt") + " 2> /dev/null"), 0);
  EXPECT_NE(make("office -o " + folder.at("none/a.obj") + " 2> /dev/null"), 0);
  EXPECT_NE(make("2> /dev/null"), 0);
}

}  // namespace
