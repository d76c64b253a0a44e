// Which polygons get a back, and that everything that looks at a scene's topology does not stumble over backs.
#include "scene/backs.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "oracle/reference.hpp"
#include "scene/enclosure.hpp"
#include "scene/files.hpp"
#include "scene/gltf_text.hpp"
#include "scene/planes.hpp"
#include "scene/topology.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t two_sided_paper = 1;

// A room of six polygons that faces inward; materials 0: grey walls that emit `exitance`, 1: grey, two-sided.
Scene room_with_paper_material(double exitance = 1) {
  Scene scene = oracle::box_scene({4, 3, 2.5}, {0.5}, {exitance});
  Material paper;
  paper.name = "paper";
  paper.reflectance = {0.5}, paper.emitted_exitance = {0};
  paper.two_sided = true;
  scene.materials.resize(1);
  for (Polygon& p : scene.polygons) p.material = 0;
  scene.materials.push_back(paper);
  return scene;
}

void add_paper(Scene& scene, const std::vector<glm::dvec3>& corners, const std::string& name = "paper") {
  Polygon p;
  p.corners = std::uint32_t(corners.size());
  std::copy(corners.begin(), corners.end(), p.corner.begin());
  p.material = two_sided_paper;
  p.name = name;
  scene.polygons.push_back(p);
}

const std::vector<glm::dvec3> sheet_in_room = {{1, 1, 1}, {3, 1, 1}, {3, 2, 1.5}, {1, 2, 1.5}};

// A box that faces outward.
void add_paper_box(Scene& scene, const glm::dvec3& low, const glm::dvec3& high) {
  const Scene inward = oracle::box_scene(high - low, {0.5}, {1});
  for (const Polygon& p : inward.polygons) {
    std::vector<glm::dvec3> c;
    for (int k = 3; k >= 0; --k) c.push_back(p.corner[std::size_t(k)] + low);
    add_paper(scene, c, "box");
  }
}

TEST(SceneBacks, FollowTheirFronts) {
  Scene scene = room_with_paper_material();
  add_paper(scene, sheet_in_room);
  add_paper(scene, {{1, 1, 2}, {2, 1, 2}, {1, 2, 2}}, "triangle");
  const Scene both = with_backs(scene);
  ASSERT_EQ(both.polygons.size(), scene.polygons.size() + 2);
  const auto planes = plane_ids(both);
  for (const std::size_t front : {6u, 8u}) {
    const Polygon &f = both.polygons[front], &b = both.polygons[front + 1];
    EXPECT_FALSE(f.back);
    EXPECT_TRUE(b.back);
    EXPECT_EQ(b.name, f.name + " (back)");
    EXPECT_EQ(b.corners, f.corners);
    EXPECT_EQ(b.corner[0], f.corner[0]);
    EXPECT_EQ(b.corner[1], f.corner[f.corners - 1]);
    EXPECT_EQ(b.material, f.material);
    EXPECT_LT(glm::length(b.normal() + f.normal()), 1e-15);
    EXPECT_EQ(planes[front], planes[front + 1]);
  }
  EXPECT_EQ(with_backs(both).polygons.size(), both.polygons.size()) << "twice";
  EXPECT_EQ(plane_ids(scene), (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(planes, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 6, 7, 7}));
}

TEST(SceneBacks, OneSidedAndGlassGetNone) {
  Scene scene = room_with_paper_material();
  EXPECT_EQ(with_backs(scene).polygons.size(), 6u);
  add_paper(scene, sheet_in_room);
  scene.materials[two_sided_paper].transmission = {0.4};
  EXPECT_EQ(with_backs(scene).polygons.size(), 7u);
}

// A quad that is out of plane by less than the reader's 1e-6 is in no other polygon's plane to the grid's 1e-11, but its back
// is in the same.
TEST(SceneBacks, ANearlyPlaneQuadAndItsBackShareAPlane) {
  Scene scene = room_with_paper_material();
  add_paper(scene, {{1, 1, 1}, {3, 1, 1}, {3, 2, 1 + 5e-7}, {1, 2, 1}});
  const auto planes = plane_ids(with_backs(scene));
  EXPECT_EQ(planes[6], planes[7]);
}

TEST(SceneBacks, InsidesOfSolidsAreDarkUnlessSomethingReachesIn) {
  Scene scene = room_with_paper_material();
  add_paper_box(scene, {1, 1, 0}, {2, 2, 1});  // stands on the floor
  TwoSided found = find_two_sided(scene);
  EXPECT_EQ(found.dark, 6u);
  EXPECT_TRUE(found.backs.empty());

  Scene stacked = scene;
  add_paper_box(stacked, {1.2, 1.2, 1}, {1.8, 1.8, 2});
  EXPECT_EQ(find_two_sided(stacked).dark, 12u) << "one stands on the other";

  Scene pierced = scene;
  add_paper(pierced, {{0.5, 1.5, 0.5}, {1.5, 1.5, 0.5}, {1.5, 1.5, 0.7}});
  found = find_two_sided(pierced);
  EXPECT_EQ(found.dark, 0u) << "a sheet through its side";
  EXPECT_EQ(found.backs.size(), 7u);

  Scene held = scene;
  add_paper_box(held, {1.3, 1.3, 0.3}, {1.7, 1.7, 0.7});
  found = find_two_sided(held);
  EXPECT_EQ(found.dark, 6u) << "the inner of two boxes";
  EXPECT_EQ(found.backs.size(), 6u) << "the outer one";

  Scene seen = scene;
  seen.cameras = {{"inside", {1.5, 1.5, 0.5}, {0, 0, 0}, {0, 0, 1}, 0.7}};
  EXPECT_EQ(find_two_sided(seen).dark, 0u) << "a camera in it";

  Scene bulb = scene;
  PunctualLight light;
  light.position_m = {1.5, 1.5, 0.5};
  bulb.lights = {light};
  EXPECT_EQ(find_two_sided(bulb).dark, 0u) << "a light in it";

  Scene lit = scene;
  lit.materials[two_sided_paper].emitted_exitance = {1};
  EXPECT_EQ(find_two_sided(lit).dark, 0u) << "it emits inwards";

  Scene open = scene;
  open.polygons.pop_back();
  EXPECT_EQ(find_two_sided(open).dark, 0u) << "a box without a lid";
  EXPECT_EQ(find_two_sided(open).backs.size(), 5u);

  // Turned by 45 degrees two boxes have overlapping bounding boxes, but a face of one has all of the other before it.
  Scene turned = room_with_paper_material();
  add_paper_box(turned, {1, 1, 0}, {2, 2, 1});
  add_paper_box(turned, {2.1, 1, 0}, {3.1, 2, 1});
  for (std::size_t p = 6; p < turned.polygons.size(); ++p)
    for (glm::dvec3& c : turned.polygons[p].corner) c = {(c.x - c.y) / 2 + 1, (c.x + c.y) / 2 - 0.5, c.z};
  EXPECT_EQ(find_two_sided(turned).dark, 12u);
}

TEST(SceneBacks, ALShapedSolidKeepsItsBacks) {
  Scene scene = room_with_paper_material();
  // An L in the x-y plane, extruded; its notch makes it no convex solid.
  const std::vector<glm::dvec2> outline = {{1, 1}, {2, 1}, {2, 1.5}, {1.5, 1.5}, {1.5, 2}, {1, 2}};
  const auto at = [&](std::size_t k, double z) { return glm::dvec3(outline[k % 6], z); };
  for (std::size_t k = 0; k < 6; ++k) add_paper(scene, {at(k, 0), at(k + 1, 0), at(k + 1, 1), at(k, 1)});
  for (const double z : {0.0, 1.0})  // two quads each, split from the notch to the outer corner
    for (const std::array<std::size_t, 4> q : {std::array<std::size_t, 4>{0, 1, 2, 3}, {0, 3, 4, 5}})
      z > 0 ? add_paper(scene, {at(q[0], z), at(q[1], z), at(q[2], z), at(q[3], z)})
            : add_paper(scene, {at(q[3], z), at(q[2], z), at(q[1], z), at(q[0], z)});
  const TwoSided found = find_two_sided(scene);
  EXPECT_EQ(found.dark, 0u);
  EXPECT_EQ(found.backs.size(), 10u);
}

TEST(SceneBacks, ChecksDoNotSeeThem) {
  Scene scene = room_with_paper_material();
  EXPECT_TRUE(is_watertight(with_backs(scene)));
  scene.polygons[0].material = two_sided_paper;
  const Scene wall = with_backs(scene);
  ASSERT_EQ(wall.polygons.size(), 7u);
  EXPECT_TRUE(is_watertight(wall));
  const auto surface = closed_surfaces(wall);
  EXPECT_EQ(surface[0], 0u);
  EXPECT_EQ(surface[1], 0xffffffffu) << "a back";
  EXPECT_EQ(surface[2], 0u);
  std::vector<Diagnostic> findings;
  check_orientation(wall, findings);
  check_open_edges(wall, findings);
  EXPECT_TRUE(findings.empty());
}

// A room that is closed stays so with sheets in it, whose both sides are fronts; one-sided sheets have black backs.
TEST(SceneBacks, ClosedRoomsStayProvenClosed) {
  Scene scene = room_with_paper_material();
  add_paper(scene, sheet_in_room);
  EXPECT_FALSE(find_enclosure(scene).closed) << "one-sided";
  EXPECT_TRUE(find_enclosure(with_backs(scene)).closed) << find_enclosure(with_backs(scene)).reason;

  Scene partition = room_with_paper_material();
  add_paper(partition,
            {{2, 0, 0}, {2, 3, 0}, {2, 3, 1.5}, {2, 0, 1.5}});  // stands on the floor, from wall to wall
  EXPECT_TRUE(find_enclosure(with_backs(partition)).closed) << find_enclosure(with_backs(partition)).reason;

  Scene carpet = room_with_paper_material();
  add_paper(carpet, {{1, 1, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}});
  EXPECT_TRUE(find_enclosure(with_backs(carpet)).closed) << find_enclosure(with_backs(carpet)).reason;
  carpet.materials[two_sided_paper].emitted_exitance = {1};
  EXPECT_FALSE(find_enclosure(with_backs(carpet)).closed) << "its back emits out of the room";

  Scene everything = room_with_paper_material();
  for (Polygon& p : everything.polygons) p.material = two_sided_paper;
  add_paper(everything, sheet_in_room);
  add_paper_box(everything, {1, 1, 0}, {2, 2, 0.5});
  EXPECT_TRUE(find_enclosure(with_backs(everything)).closed) << find_enclosure(with_backs(everything)).reason;
  Scene hole = everything;
  hole.polygons.erase(hole.polygons.begin() + 3);
  EXPECT_FALSE(find_enclosure(with_backs(hole)).closed);
}

TEST(SceneBacks, GltfSaysDoubleSidedAndOptionsOverrule) {
  using Json = nlohmann::json;
  clrad_test::Gltf g;
  const int positions = g.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const int indices = g.indices(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  const int material = g.material(
      {{"name", "leaf"},
       {"doubleSided", true},
       {"emissiveFactor", {1, 1, 1}},
       {"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 0}}}});
  const Json primitive = {
      {"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"material", material}};
  g.node({{"name", "leaf"}, {"mesh", g.mesh({primitive})}});
  const clrad_test::Folder folder;
  const std::string path = folder.write("leaf.gltf", g.text());
  const Scene scene = load_scene(path);
  EXPECT_TRUE(scene.materials[0].two_sided);
  EXPECT_EQ(with_backs(scene).polygons.size(), 2u);
  EXPECT_TRUE(clrad_test::of_rule(scene.diagnostics, "double-sided").empty());
  EXPECT_FALSE(load_scene(path, {.sides = Sides::one}).materials[0].two_sided);

  const auto found = clrad_test::of_rule(check_scene(path), "two-sided");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].where.item.find("leaf"), std::string::npos);
  EXPECT_TRUE(clrad_test::of_rule(check_scene(path, {.sides = Sides::one}), "two-sided").empty());

  const std::string obj = clrad_test::write_obj(folder, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  EXPECT_EQ(with_backs(load_scene(obj)).polygons.size(), 1u);
  EXPECT_EQ(with_backs(load_scene(obj, {.sides = Sides::two})).polygons.size(), 2u);
}

}  // namespace
}  // namespace clrad
