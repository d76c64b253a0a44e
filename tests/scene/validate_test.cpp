/// Each rule of scene/validate.hpp: a file that triggers it, and a neighbour that does not.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "scene/faces.hpp"
#include "scene/files.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;
using Severity = Diagnostic::Severity;
using Corners = std::vector<glm::dvec3>;

// A file of one face; fmt keeps all digits of the corners.
std::string obj_of(const Corners& corners) {
  std::string text, face = "f";
  char line[128];
  for (std::size_t i = 0; i < corners.size(); ++i) {
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", corners[i].x, corners[i].y, corners[i].z);
    text += line;
    face += " " + std::to_string(i + 1);
  }
  return text + face + "\n";
}

Scene load_face(const Corners& corners) {
  Folder folder;
  return load_scene(write_obj(folder, obj_of(corners)));
}

double total_area(const Scene& scene) {
  double sum = 0;
  for (const Polygon& p : scene.polygons) sum += p.area_m2();
  return sum;
}

TEST(SceneRules, PlanarConvexQuadsAndTrianglesStay) {
  const Scene quad = load_face({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  ASSERT_EQ(quad.polygons.size(), 1u);
  EXPECT_EQ(quad.polygons[0].corners, 4u);
  EXPECT_EQ(quad.polygons[0].area_m2(), 1.0);
  EXPECT_EQ(quad.polygons[0].normal(), glm::dvec3(0, 0, 1));
  EXPECT_TRUE(quad.diagnostics.empty());
  const Scene triangle = load_face({{0, 0, 0}, {0, 3, 0}, {0, 0, 4}});
  EXPECT_EQ(triangle.polygons[0].corners, 3u);
  EXPECT_EQ(triangle.polygons[0].area_m2(), 6.0);
  EXPECT_EQ(triangle.polygons[0].normal(), glm::dvec3(1, 0, 0));
}

TEST(SceneRules, DegenerateFacesAreDropped) {
  // 0.1, 0.2, 0.3 along (1, 3, 7) are on a line up to rounding: exact arithmetic on the doubles says
  // otherwise.
  for (const Corners& face :
       {Corners{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, Corners{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}},
        Corners{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}},
        Corners{{0.1, 0.3, 0.7}, {0.2, 0.6, 1.4}, {0.3, 0.9, 2.1}},
        Corners{{0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {3, 3, 0}, {5, 5, 0}}}) {
    Folder folder;
    const auto found =
        check_scene(write_obj(folder, obj_of(face) + "v 9 0 0\nv 9 1 0\nv 9 0 1\nf -3 -2 -1\n"));
    EXPECT_EQ(of_rule(found, "degenerate-face").size(), 1u);
    EXPECT_EQ(of_rule(found, "degenerate-face").at(0).severity, Severity::repair);
    EXPECT_EQ(load_scene(folder.at("a.obj")).polygons.size(), 1u);
  }
}

TEST(SceneRules, SliversAndTinyFacesStay) {
  // Height 1e-12 at coordinates of 1 is 1125 times the rounding rule's 4 ulp.
  for (const Corners& face :
       {Corners{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-12, 0}}, Corners{{0, 0, 0}, {1e-60, 0, 0}, {0, 1e-60, 0}},
        Corners{{1e6, 1e6, 1e6}, {1e6 + 1, 1e6, 1e6}, {1e6, 1e6 + 1, 1e6}},
        Corners{{0, 0, 0}, {1e90, 0, 0}, {0, 1e90, 0}}}) {
    const Scene scene = load_face(face);
    ASSERT_EQ(scene.polygons.size(), 1u);
    EXPECT_TRUE(scene.diagnostics.empty());
    EXPECT_GT(scene.polygons[0].area_m2(), 0);
    EXPECT_EQ(scene.polygons[0].normal(), glm::dvec3(0, 0, 1));
  }
}

TEST(SceneRules, RepeatedCornerIsLeftOut) {
  const Scene scene = load_face({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  ASSERT_EQ(scene.polygons.size(), 1u);
  EXPECT_EQ(scene.polygons[0].corners, 3u);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"repeated-corner"});
}

TEST(SceneRules, NonPlanarQuadIsCutAlongZeroTwo) {
  // Diagonals of a unit square pass at half of a lifted corner's height; the longer one is sqrt 2 or a little
  // more.
  const auto lifted = [](double h) { return Corners{{0, 0, 0}, {1, 0, 0}, {1, 1, h}, {0, 1, 0}}; };
  const Scene flat = load_face(lifted(2.8e-6));  // 0.99e-6
  ASSERT_EQ(flat.polygons.size(), 1u);
  EXPECT_TRUE(flat.diagnostics.empty());
  const Scene bent = load_face(lifted(2.9e-6));  // 1.025e-6
  ASSERT_EQ(bent.polygons.size(), 2u);
  EXPECT_EQ(rules_of(bent.diagnostics), std::vector<std::string>{"non-planar"});
  EXPECT_EQ(bent.diagnostics[0].severity, Severity::repair);
  EXPECT_EQ(bent.polygons[0].corner[0], glm::dvec3(0, 0, 0));
  EXPECT_EQ(bent.polygons[0].corner[2], glm::dvec3(1, 1, 2.9e-6));
  EXPECT_EQ(bent.polygons[1].corner[1], glm::dvec3(1, 1, 2.9e-6));
}

TEST(SceneRules, ConcaveQuadIsCutFromItsReflexCorner) {
  for (int shift = 0; shift < 4; ++shift) {
    const Corners dart = {{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.5, 1, 0}};
    Corners face(4);
    for (int i = 0; i < 4; ++i) face[(i + shift) % 4] = dart[i];
    const Scene scene = load_face(face);
    EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"concave"});
    ASSERT_EQ(scene.polygons.size(), 2u);
    EXPECT_EQ(total_area(scene), 1.5);
    for (const Polygon& p : scene.polygons) EXPECT_EQ(p.normal(), glm::dvec3(0, 0, 1));
  }
}

TEST(SceneRules, StraightCornerIsCutFromThere) {
  for (int shift = 0; shift < 4; ++shift) {
    const Corners shape = {{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    Corners face(4);
    for (int i = 0; i < 4; ++i) face[(i + shift) % 4] = shape[i];
    const Scene scene = load_face(face);
    EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"straight-corner"});
    ASSERT_EQ(scene.polygons.size(), 2u);
    for (const Polygon& p : scene.polygons) EXPECT_EQ(p.area_m2(), 0.25);
  }
}

TEST(SceneRules, ManyCornersBecomeTriangles) {
  const Scene hexagon =
      load_face({{1, 0, 0}, {0.5, 1, 0}, {-0.5, 1, 0}, {-1, 0, 0}, {-0.5, -1, 0}, {0.5, -1, 0}});
  EXPECT_EQ(hexagon.polygons.size(), 4u);
  EXPECT_EQ(total_area(hexagon), 3.0);
  EXPECT_EQ(rules_of(hexagon.diagnostics), std::vector<std::string>{"many-corners"});
  const Corners comb = {{0, 0, 0}, {5, 0, 0}, {5, 3, 0}, {4, 3, 0}, {4, 1, 0}, {3, 1, 0},
                        {3, 3, 0}, {2, 3, 0}, {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  const Scene teeth = load_face(comb);
  EXPECT_EQ(teeth.polygons.size(), comb.size() - 2);
  EXPECT_DOUBLE_EQ(total_area(teeth), 11.0);
  for (const Polygon& p : teeth.polygons) EXPECT_EQ(p.normal(), glm::dvec3(0, 0, 1));
  // A triangle with corners along its sides: each piece has area, none is lost.
  const Scene straight = load_face({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 1, 0}});
  EXPECT_EQ(straight.polygons.size(), 4u);
  EXPECT_DOUBLE_EQ(total_area(straight), 4.5);
  for (const Polygon& p : straight.polygons) EXPECT_GT(p.area_m2(), 0.1);
}

TEST(SceneRules, CrossingSidesAreAnError) {
  for (const Corners& face :
       {Corners{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},
        Corners{{0, 0, 0}, {2, 1, 0}, {2, 0, 0}, {0, 3, 0}},
        Corners{{0, 1, 0}, {0.6, -0.8, 0}, {-0.95, 0.3, 0}, {0.95, 0.3, 0}, {-0.6, -0.8, 0}}}) {
    Folder folder;
    const std::string path = write_obj(folder, obj_of(face));
    EXPECT_EQ(of_rule(check_scene(path), "self-intersecting").size(), 1u);
    EXPECT_NE(load_error(path).find("cross each other"), std::string::npos);
  }
}

TEST(SceneRules, DuplicatesFacingTheSameWay) {
  Folder folder;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
  const auto found = check_scene(write_obj(folder, vertices + "f 1 2 3\nf 2 3 1\n"));
  ASSERT_EQ(of_rule(found, "duplicate-face").size(), 1u);
  EXPECT_EQ(of_rule(found, "duplicate-face")[0].where.line, 8u);
  EXPECT_NE(of_rule(found, "duplicate-face")[0].message.find("a.obj:7"), std::string::npos);
  // Back to back is how one writes a sheet with two sides.
  EXPECT_TRUE(
      of_rule(check_scene(write_obj(folder, vertices + "f 1 2 3\nf 1 3 2\n")), "duplicate-face").empty());
  EXPECT_TRUE(
      of_rule(check_scene(write_obj(folder, vertices + "f 1 2 3\nf 1 2 4\n")), "duplicate-face").empty());
}

TEST(SceneRules, EmittersAndPolygons) {
  Folder folder;
  folder.write("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nnewmtl unused\nKe 1 1 1\n");
  const std::string path =
      folder.write("a.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(rules_of(load_scene(path).diagnostics), std::vector<std::string>{"no-emitter"});
  EXPECT_NE(load_error(folder.write("b.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")).find("no polygon"),
            std::string::npos);
}

// The reference's list of invalid polygons: each alone is an error, or, without area, a documented drop that
// leaves nothing to light, which is one too.
TEST(SceneRules, EachInvalidPolygonOfTheReferenceIsRefused) {
  std::ifstream in(std::string(CLRAD_TEST_DATA) + "/scene/invalid_polygons.json");
  const auto cases = nlohmann::json::parse(in).at("polygons");
  ASSERT_EQ(cases.size(), 11u);
  for (const auto& polygon : cases) {
    std::string text, face = "f";
    int count = 0;
    for (const auto& vertex : polygon.at("vertices")) {
      text += "v";
      for (const auto& x : vertex) text += " " + (x.is_string() ? x.get<std::string>() : x.dump());
      text += "\n";
      face += " " + std::to_string(++count);
    }
    Folder folder;
    const std::string path = write_obj(folder, text + face + "\n");
    const std::string message = load_error(path);
    EXPECT_TRUE(message.starts_with(path)) << polygon.at("what") << ": " << message;
    const auto findings = check_scene(path);
    EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const Diagnostic& d) {
      return d.severity == Severity::error && !d.message.empty();
    })) << polygon.at("what");
    // With a sound face beside it: dropped where it has no area, refused otherwise.
    const std::string with_other =
        write_obj(folder, text + face + "\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n");
    const std::string what = polygon.at("what");
    const bool without_area =
        what.starts_with("zero area") || what.starts_with("repeated") || what.starts_with("all");
    EXPECT_EQ(load_error(with_other).empty(), without_area) << what;
  }
}

TEST(SceneRules, CutFaceKeepsAreaAndWindingOfStarShapes) {
  // Star-shaped loops about the origin in a tilted plane, from a fixed linear congruential sequence.
  std::uint64_t state = 12345;
  const auto random = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state >> 11) * 0x1p-53;
  };
  const glm::dvec3 u = glm::normalize(glm::dvec3(1, 2, 3)),
                   w = glm::normalize(glm::cross(u, glm::dvec3(0, 0, 1)));
  const glm::dvec3 normal = glm::cross(u, w);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 5 + static_cast<int>(random() * 30);
    Corners face;
    double twice_area = 0;
    for (int i = 0; i < n; ++i) {
      const double angle = 6.283185307179586 * (i + 0.8 * random()) / n, radius = 0.2 + random();
      face.push_back(u * (radius * std::cos(angle)) + w * (radius * std::sin(angle)));
    }
    for (int i = 0; i < n; ++i) twice_area += glm::dot(glm::cross(face[i], face[(i + 1) % n]), normal);
    const CutFace cut = cut_face(face);
    ASSERT_EQ(cut.pieces.size(), std::size_t(n - 2)) << "trial " << trial;
    double sum = 0;
    for (const FacePiece& p : cut.pieces) {
      const double twice = glm::dot(
          glm::cross(face[p.corner[1]] - face[p.corner[0]], face[p.corner[2]] - face[p.corner[0]]), normal);
      EXPECT_GT(twice, 0);
      sum += twice;
    }
    // About 100 products of numbers near 1, each rounded by 2^-53.
    EXPECT_NEAR(sum, twice_area, 1e-13);
  }
}

}  // namespace
