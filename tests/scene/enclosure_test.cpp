// What is proven closed must be closed, and ordinary closed rooms must be proven so however their surfaces meet.
#include "scene/enclosure.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "oracle/reference.hpp"

namespace clrad {
namespace {

using Corners = std::vector<glm::dvec3>;

Scene room() {
  return oracle::box_scene({4, 3, 2.5}, {0.5}, {1});
}

void add(Scene& scene, const std::string& name, const Corners& corners) {
  Polygon p;
  p.corners = std::uint32_t(corners.size());
  std::copy(corners.begin(), corners.end(), p.corner.begin());
  p.name = name;
  scene.polygons.push_back(p);
}

// A box that faces outward, with the faces whose bit is set: x_min x_max y_min y_max z_min z_max.
void add_block(Scene& scene, const glm::dvec3& low, const glm::dvec3& high, unsigned faces) {
  const Scene inward = oracle::box_scene(high - low, {0.5}, {1});
  for (unsigned f = 0; f < 6; ++f) {
    if (!(faces >> f & 1)) continue;
    Corners c;
    for (int k = 3; k >= 0; --k) c.push_back(inward.polygons[f].corner[std::size_t(k)] + low);
    add(scene, "block " + std::to_string(f), c);
  }
}
constexpr unsigned all_faces = 63, no_bottom = 47;

bool closed(const Scene& scene) {
  return find_enclosure(scene).closed;
}
std::string reason(const Scene& scene) {
  return find_enclosure(scene).reason;
}
bool says(const Scene& scene, const std::string& what) {
  return reason(scene).find(what) != std::string::npos;
}

Scene transformed(Scene scene, const std::function<glm::dvec3(glm::dvec3)>& map) {
  for (Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k) p.corner[k] = map(p.corner[k]);
  return scene;
}

Scene block_room() {
  return oracle::scene_of(
      oracle::reference_case(oracle::reference("c_scenes_with_occlusion.json"), "C-block-room-1")
          .at("scene"));
}

TEST(Enclosure, RoomsOfTheReferenceAreProven) {
  const auto forms = oracle::reference("c_closed_forms.json");
  int furnaces = 0;
  for (const auto& c : forms.at("cases")) {
    if (c.at("kind") != "white_furnace" || !c.contains("closed")) continue;
    Scene scene;
    for (const auto& p : c.at("polygons")) scene.polygons.push_back(oracle::polygon(p, 0, "wall"));
    EXPECT_TRUE(closed(scene)) << c.at("id") << ": " << reason(scene);
    ++furnaces;
  }
  EXPECT_EQ(furnaces, 7);
  const auto boxes = oracle::reference("c_boxes.json");
  for (const auto& c : boxes.at("cases"))
    if (c.contains("scene")) {
      EXPECT_TRUE(closed(oracle::scene_of(c.at("scene")))) << c.at("id");
    }
  EXPECT_TRUE(closed(block_room())) << reason(block_room());
}

// A tilted, odd-sized, far-away room: T-junctions are only as exact as the file's decimals.
TEST(Enclosure, WhereverTheRoomIsAndHoweverItIsTurned) {
  const double c = std::cos(0.4), s = std::sin(0.4);
  const auto turn = [&](glm::dvec3 p) {
    return glm::dvec3(c * p.x - s * p.y, c * (s * p.x + c * p.y) - s * p.z,
                      s * (s * p.x + c * p.y) + c * p.z);
  };
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const Scene scene = transformed(block_room(), [&](glm::dvec3 p) { return scale * turn(p); });
    EXPECT_TRUE(closed(scene)) << scale << ": " << reason(scene);
  }
  const Scene far =
      transformed(block_room(), [&](glm::dvec3 p) { return turn(p) + glm::dvec3(1e6, -1e6, 1e6); });
  EXPECT_TRUE(closed(far)) << reason(far);
}

TEST(Enclosure, AGapOfAMicrometreIsOpen) {
  EXPECT_TRUE(closed(room()));
  Scene gap = room();
  for (std::uint32_t k = 0; k < 4; ++k) gap.polygons[5].corner[k].z += 1e-6;
  EXPECT_TRUE(says(gap, "open side"));
  Scene hole = room();
  hole.polygons.pop_back();
  EXPECT_TRUE(says(hole, "open side"));
  EXPECT_FALSE(closed(Scene{}));
}

TEST(Enclosure, AllMustFaceInward) {
  Scene outward = room();
  for (Polygon& p : outward.polygons) std::reverse(p.corner.begin(), p.corner.end());
  EXPECT_TRUE(says(outward, "faces out of"));
  Scene one = room();
  std::reverse(one.polygons[2].corner.begin(), one.polygons[2].corner.end());
  EXPECT_TRUE(says(one, "open side")) << "its sides add up with its neighbours' instead of cancelling";
}

TEST(Enclosure, ObjectsStandOrFloatInIt) {
  Scene scene = room();
  add_block(scene, {1, 1, 1}, {2, 2, 2}, all_faces);
  EXPECT_TRUE(closed(scene)) << reason(scene);
  add_block(scene, {2.5, 0.5, 0}, {3, 1, 0.7}, all_faces);  // on the floor with its bottom
  EXPECT_TRUE(closed(scene)) << reason(scene);
  add_block(scene, {2.5, 1.5, 0}, {3, 2, 0.7}, no_bottom);
  EXPECT_TRUE(closed(scene)) << reason(scene);
  add_block(scene, {2.6, 1.6, 0.7}, {2.9, 1.9, 0.9}, no_bottom);  // on top of that one
  EXPECT_TRUE(closed(scene)) << reason(scene);
  add_block(scene, {0, 0.2, 1}, {0.3, 0.8, 1.5}, 62);  // on the wall
  EXPECT_TRUE(closed(scene)) << reason(scene);
}

TEST(Enclosure, WhatStandsOnNothingIsOpen) {
  Scene above = room();
  add_block(above, {1, 1, 1e-6}, {2, 2, 1}, no_bottom);
  EXPECT_TRUE(says(above, "open side"));
  Scene over_the_edge = room();
  add_block(over_the_edge, {3.5, 1, 0}, {4.5, 2, 1}, no_bottom);
  EXPECT_TRUE(says(over_the_edge, "open side"));
  Scene without_lid = room();
  add_block(without_lid, {1, 1, 0}, {2, 2, 1}, 15);  // two outlines, one in the air
  EXPECT_TRUE(says(without_lid, "open side"));
  // The floor has a hole where the block stands askew over it.
  Scene hole = room();
  hole.polygons.erase(hole.polygons.begin() + 4);
  add(hole, "floor a", {{0, 0, 0}, {1.5, 0, 0}, {1.5, 3, 0}, {0, 3, 0}});
  add(hole, "floor b", {{1.6, 0, 0}, {4, 0, 0}, {4, 3, 0}, {1.6, 3, 0}});
  add_block(hole, {1, 1, 0}, {2, 2, 1}, no_bottom);
  EXPECT_TRUE(says(hole, "open side"));
}

TEST(Enclosure, APolygonLyingOnAWallMustFaceItsWay) {
  Scene lit = room();
  add(lit, "light", {{1, 1, 2.5}, {1, 2, 2.5}, {2, 2, 2.5}, {2, 1, 2.5}});
  EXPECT_TRUE(closed(lit)) << reason(lit);
  Scene upward = room();
  add(upward, "light", {{1, 1, 2.5}, {2, 1, 2.5}, {2, 2, 2.5}, {1, 2, 2.5}});
  EXPECT_FALSE(closed(upward));
  Scene in_space;
  add(in_space, "a", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  EXPECT_FALSE(closed(in_space));
  add(in_space, "on a", {{0.2, 0.2, 0}, {0.8, 0.2, 0}, {0.8, 0.8, 0}, {0.2, 0.8, 0}});
  EXPECT_FALSE(closed(in_space));
  add(in_space, "back of a", {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}});
  EXPECT_FALSE(closed(in_space));
}

TEST(Enclosure, BothSidesOfAPartition) {
  Scene scene = room();
  add(scene, "left", {{2, 1, 1}, {2, 2, 1}, {2, 2, 2}, {2, 1, 2}});
  EXPECT_TRUE(says(scene, "open side"));
  add(scene, "right", {{2, 1, 1}, {2, 1, 2}, {2, 2, 2}, {2, 2, 1}});
  EXPECT_TRUE(closed(scene)) << reason(scene);
}

TEST(Enclosure, ObjectsThatFaceInwardCloseOffARoomInTheRoom) {
  Scene scene = room();
  for (Polygon p : oracle::box_scene({1, 1, 1}, {0.5}, {1}).polygons) {
    for (auto& c : p.corner) c += glm::dvec3(1, 1, 1);
    scene.polygons.push_back(p);
  }
  EXPECT_TRUE(says(scene, "closed off"));
}

TEST(Enclosure, WhatSticksOutOfTheRoomIsFound) {
  Scene scene = room();
  add_block(scene, {1, 1, -0.5}, {2, 2, 1}, all_faces);  // through the floor
  EXPECT_FALSE(closed(scene));
  Scene outside = room();
  add_block(outside, {6, 1, 1}, {7, 2, 2}, all_faces);
  EXPECT_TRUE(says(outside, "faces out of"));
  // Two rooms side by side are two closed scenes, and together one.
  Scene two = room();
  for (Polygon p : room().polygons) {
    for (auto& c : p.corner) c.x += 10;
    two.polygons.push_back(p);
  }
  EXPECT_TRUE(closed(two)) << reason(two);
}

// 2000 boxes in a grid on one floor, half of them without a bottom: the proof is near-linear.
TEST(Enclosure, ManyObjects) {
  Scene scene = room();
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 at(0.1 + 0.07 * (i % 50), 0.1 + 0.07 * (i / 50), 0);
    add_block(scene, at, at + glm::dvec3(0.03, 0.03, 0.04), i % 2 ? all_faces : no_bottom);
  }
  EXPECT_TRUE(closed(scene)) << reason(scene);
}

}  // namespace
}  // namespace clrad
