#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>

#include "scene/files.hpp"
#include "scene/topology.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;

const std::string kCubeVertices =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";  // lines 3 to 10
const std::vector<std::string> kInward = {"1 2 3 4", "5 8 7 6", "1 5 6 2", "4 3 7 8", "1 4 8 5", "2 6 7 3"};

std::string cube(const std::vector<std::string>& faces) {
  std::string text = kCubeVertices;
  for (const std::string& f : faces) text += "f " + f + "\n";
  return text;
}

TEST(SceneTopology, ClosedCubeIsWatertightEitherWay) {
  Folder folder;
  const std::string path = write_obj(folder, cube(kInward));
  EXPECT_TRUE(is_watertight(load_scene(path)));
  EXPECT_TRUE(check_scene(path).empty());
  std::vector<std::string> outward;
  for (std::string f : kInward) outward.push_back({f.rbegin(), f.rend()});
  EXPECT_TRUE(is_watertight(load_scene(write_obj(folder, cube(outward)))));
}

TEST(SceneTopology, EqualPlacesAreOneVertexWhateverTheirSign) {
  Folder folder;
  std::string text;
  const char* corner[] = {"", "-0 0 0", "1 -0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"};
  for (const std::string& f : kInward) {  // no vertex shared by index
    for (const char c : f) {
      if (c != ' ') text += std::string("v ") + corner[c - '0'] + "\n";
    }
    text += "f -4 -3 -2 -1\n";
  }
  EXPECT_TRUE(is_watertight(load_scene(write_obj(folder, text))));
}

TEST(SceneTopology, OpenCubeHasFourOpenEdges) {
  Folder folder;
  auto faces = kInward;
  faces.pop_back();
  const std::string path = write_obj(folder, cube(faces));
  EXPECT_FALSE(is_watertight(load_scene(path)));
  const auto found = of_rule(check_scene(path), "open-edges");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].message.starts_with("4 sides")) << found[0].message;
  EXPECT_NE(found[0].message.find("a.obj:11"), std::string::npos);
  EXPECT_TRUE(load_scene(path).diagnostics.empty()) << "open edges are for check only";
}

TEST(SceneTopology, ClosedSurfacesAreThoseWithoutOpenOrTurnedSides) {
  Folder folder;
  const auto none = std::vector<std::uint32_t>(6, 0xffffffffu);
  EXPECT_EQ(closed_surfaces(load_scene(write_obj(folder, cube(kInward)))), std::vector<std::uint32_t>(6, 0));
  auto faces = kInward;
  faces[3] = "8 7 3 4";
  EXPECT_EQ(closed_surfaces(load_scene(write_obj(folder, cube(faces)))), none) << "one is turned";
  faces = kInward;
  faces.pop_back();
  EXPECT_EQ(closed_surfaces(load_scene(write_obj(folder, cube(faces)))), std::vector(5, 0xffffffffu))
      << "open";
  // A square before two cubes: each cube is named by its first polygon.
  std::string text = kCubeVertices;
  for (int k = 0; k < 8; ++k)
    text += "v " + std::to_string(3 + (k % 4 == 1 || k % 4 == 2)) + " " + std::to_string(k % 4 / 2) + " " +
            std::to_string(k / 4) + "\n";
  text += "v 9 0 0\nv 9 1 0\nv 9 1 1\nf -3 -2 -1\n";
  for (const std::string& f : kInward) text += "f " + f + "\n";
  for (std::string f : kInward) {
    std::string moved;
    for (const char c : f) moved += c == ' ' ? std::string(" ") : std::to_string(c - '0' + 8);
    text += "f " + moved + "\n";
  }
  EXPECT_EQ(closed_surfaces(load_scene(write_obj(folder, text))),
            (std::vector<std::uint32_t>{0xffffffffu, 1, 1, 1, 1, 1, 1, 7, 7, 7, 7, 7, 7}));
}

TEST(SceneTopology, EachTurnedFaceIsFound) {
  Folder folder;
  for (std::size_t turned = 0; turned < 6; ++turned) {
    auto faces = kInward;
    faces[turned] = {faces[turned].rbegin(), faces[turned].rend()};
    const std::string path = write_obj(folder, cube(faces));
    EXPECT_FALSE(is_watertight(load_scene(path)));
    const auto found = of_rule(load_scene(path).diagnostics, "orientation");
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].where.line, 11u + turned);
  }
}

TEST(SceneTopology, TJunctionIsNotWatertight) {
  Folder folder;
  auto faces = kInward;
  faces[5] = "2 6 9 10";  // the face x = 1 in two halves, which its neighbours do not know of
  faces.push_back("10 9 7 3");
  const std::string path =
      write_obj(folder, kCubeVertices + "v 1 0.5 1\nv 1 0.5 0\n" + cube(faces).substr(kCubeVertices.size()));
  EXPECT_FALSE(is_watertight(load_scene(path)));
  EXPECT_EQ(of_rule(check_scene(path), "open-edges").size(), 1u);
}

TEST(SceneTopology, ThirdPolygonOnAnEdgeIsNotWatertight) {
  Folder folder;
  auto faces = kInward;
  faces.push_back("1 2 7");
  EXPECT_FALSE(is_watertight(load_scene(write_obj(folder, cube(faces)))));
}

TEST(SceneTopology, MoebiusStripCannotBeOriented) {
  Folder folder;
  // Five quads round the axis; the last joins the first with its ends exchanged.
  std::string text;
  for (int i = 0; i < 5; ++i) {
    const double a = 6.283185307179586 * i / 5, tilt = a / 2;
    for (const double side : {-0.3, 0.3}) {
      const double r = 1 + side * std::cos(tilt);
      text += "v " + std::to_string(r * std::cos(a)) + " " + std::to_string(r * std::sin(a)) + " " +
              std::to_string(side * std::sin(tilt)) + "\n";
    }
  }
  for (int i = 0; i < 5; ++i) {
    const int a = 2 * i + 1, b = a + 1, c = i < 4 ? a + 2 : 2, d = i < 4 ? a + 3 : 1;
    text += "f " + std::to_string(a) + " " + std::to_string(c) + " " + std::to_string(d) + "\nf " +
            std::to_string(a) + " " + std::to_string(d) + " " + std::to_string(b) + "\n";
  }
  const auto found = of_rule(load_scene(write_obj(folder, text)).diagnostics, "orientation");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].message.find("Moebius"), std::string::npos);
}

// Cubes of edge `size` at (x, x, x), their vertices counted back from the face.
std::string cube_at(double x, double size, bool inward) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                              {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    text += "v";
    for (const int c : corner[i]) text += " " + std::to_string(x + size * c);
    text += "\n";
  }
  for (std::string f : kInward) {
    if (!inward) std::reverse(f.begin(), f.end());
    text += "f";
    for (const char c : f) {
      if (c != ' ') text += " " + std::to_string(c - '9');
    }
    text += "\n";
  }
  return text;
}

TEST(SceneTopology, InsideOutObjectsAndRooms) {
  Folder folder;
  const auto lines = [&](const std::string& text) {
    std::vector<std::uint32_t> found;
    for (const Diagnostic& d : of_rule(check_scene(write_obj(folder, text)), "inside-out"))
      found.push_back(d.where.line);
    return found;
  };
  using Lines = std::vector<std::uint32_t>;  // each cube takes 14 lines, its faces from the ninth on
  EXPECT_EQ(lines(cube_at(0, 8, true) + cube_at(1, 1, false) + cube_at(4, 2, false)), Lines{});
  EXPECT_EQ(lines(cube_at(0, 8, true) + cube_at(1, 1, true) + cube_at(4, 2, false)), Lines{25});
  EXPECT_EQ(lines(cube_at(0, 8, false) + cube_at(1, 1, false)), Lines{11});
  EXPECT_EQ(lines(cube_at(0, 8, false)), Lines{11});
  EXPECT_EQ(lines(cube_at(0, 8, true)), Lines{});
  EXPECT_EQ(lines(cube_at(1e6, 8, true) + cube_at(1e6 + 1, 1, true) + cube_at(1e6 + 4, 2, false)), Lines{25});
}

TEST(SceneTopology, NothingIsNotWatertight) {
  EXPECT_FALSE(is_watertight(Scene{}));
}

}  // namespace
