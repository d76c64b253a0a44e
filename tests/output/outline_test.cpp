#include "output/outline.hpp"

#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <set>

#include "mesh/subdivide.hpp"
#include "output/adaptive.hpp"
#include "output/support.hpp"

namespace clrad {
namespace {

using test::none;
using Triangle = std::array<std::uint32_t, 3>;

std::vector<std::uint32_t> vertices(const Outline& o) {
  return {o.vertex.begin(), o.vertex.begin() + o.vertices};
}

TEST(Outline, CornersAndTVerticesInOrderFromTheFirstTVertex) {
  Element quad, triangle;
  quad.vertex = {1, 2, 3, 4};
  triangle.vertex = {1, 2, 3, none};
  using List = std::vector<std::uint32_t>;
  EXPECT_EQ(vertices(outline(quad)), (List{1, 2, 3, 4}));
  EXPECT_EQ(vertices(outline(triangle)), (List{1, 2, 3}));
  quad.middle = {none, 23, none, 41};
  EXPECT_EQ(vertices(outline(quad)), (List{23, 3, 4, 41, 1, 2}));
  quad.middle = {12, 23, 34, 41};
  EXPECT_EQ(vertices(outline(quad)), (List{12, 2, 23, 3, 34, 4, 41, 1}));
  triangle.middle = {none, none, 31, none};
  EXPECT_EQ(vertices(outline(triangle)), (List{31, 1, 2, 3}));
}

// Empty when the triangles cover every polygon exactly once without a crack, else what is wrong. By the lattice's whole
// numbers: every triangle has area and faces forward, the areas add up, and every edge has its opposite, or lies on one side
// of the polygon.
std::string crack(const Mesh& mesh, const Scene& scene, const std::vector<Triangle>& triangles) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::vector<std::int64_t> doubled(mesh.polygons.size(), 0);
  for (const Triangle& t : triangles) {
    const std::uint32_t polygon = mesh.receivers[t[0]].surface;
    std::int64_t x[3], y[3];
    for (std::size_t k = 0; k < 3; ++k) {
      if (mesh.receivers[t[k]].surface != polygon) return "a triangle of two polygons";
      x[k] = mesh.lattice[t[k]][0], y[k] = mesh.lattice[t[k]][1];
      if (!edges.insert({t[k], t[(k + 1) % 3]}).second)
        return "an edge that two triangles have in one direction";
    }
    const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area <= 0) return "a triangle without area, or that turns its back";
    doubled[polygon] += area;
  }
  for (std::size_t p = 0; p < mesh.polygons.size(); ++p) {
    const std::int64_t u = mesh.polygons[p].patches_u * std::int64_t(lattice_unit(0)),
                       v = mesh.polygons[p].patches_v * std::int64_t(lattice_unit(0));
    if (doubled[p] != (scene.polygons[p].corners == 4 ? 2 : 1) * u * v) return "areas that do not add up";
  }
  for (const auto& [a, b] : edges) {
    if (edges.count({b, a})) continue;
    const PolygonMesh& m = mesh.polygons[mesh.receivers[a].surface];
    const bool quad = scene.polygons[mesh.receivers[a].surface].corners == 4;
    const std::uint32_t u = m.patches_u * lattice_unit(0), v = m.patches_v * lattice_unit(0);
    const auto &p = mesh.lattice[a], &q = mesh.lattice[b];
    const auto both = [&](auto&& on) { return on(p) && on(q); };
    const bool side = both([](auto& l) { return l[0] == 0; }) || both([](auto& l) { return l[1] == 0; }) ||
                      (quad && both([&](auto& l) { return l[0] == u; })) ||
                      (quad && both([&](auto& l) { return l[1] == v; })) ||
                      (!quad && both([&](auto& l) { return l[0] + l[1] == u; }));
    if (!side) return "a crack: an edge inside a polygon that only one triangle has";
  }
  return {};
}

TEST(Outline, FansOverOutlinesLeaveNoCrack) {
  const Solution s = test::adaptive_solution(1);
  std::vector<Triangle> fans, bare;
  std::set<std::uint32_t> sizes;
  for (const Element& e : s.mesh.elements) {
    const auto v = vertices(outline(e));
    sizes.insert(std::uint32_t(v.size()));
    for (std::size_t k = 2; k < v.size(); ++k) fans.push_back({v[0], v[k - 1], v[k]});
    bare.push_back({e.vertex[0], e.vertex[1], e.vertex[2]});
    if (e.vertex[3] != none) bare.push_back({e.vertex[0], e.vertex[2], e.vertex[3]});
  }
  EXPECT_EQ(crack(s.mesh, s.scene, fans), "");
  EXPECT_NE(crack(s.mesh, s.scene, bare), "")
      << "the corners alone leave cracks, or this test cannot see any";
  const std::set<std::uint32_t> wanted{3, 4, 5, 6};
  EXPECT_TRUE(std::includes(sizes.begin(), sizes.end(), wanted.begin(), wanted.end()));
  std::set<std::uint32_t> levels;
  for (const Element& e : s.mesh.elements) levels.insert(e.level);
  EXPECT_EQ(levels.size(), 3u);
}

TEST(Outline, FansOverWhatSubdivisionMakesLeaveNoCrack) {
  Solution s = test::solution(test::adaptive_solution(1).scene, 0.5,
                              [](std::uint32_t, std::uint32_t, const glm::dvec3&) { return 1.0; });
  std::mt19937 random(3);
  for (int round = 0; round < 4; ++round) {
    std::vector<std::uint32_t> split(s.mesh.elements.size());
    for (auto& flag : split) flag = random() % 6 == 0;
    subdivide(test::device(), s.scene, s.frame, s.mesh, split);
    std::vector<Triangle> fans;
    for (const Element& e : s.mesh.elements) {
      const auto v = vertices(outline(e));
      for (std::size_t k = 2; k < v.size(); ++k) fans.push_back({v[0], v[k - 1], v[k]});
    }
    EXPECT_EQ(crack(s.mesh, s.scene, fans), "") << "round " << round;
  }
}

class GltfOfAdaptiveMeshes : public test::FileTest {};

TEST_F(GltfOfAdaptiveMeshes, HasNoCracks) {
  const Solution s = test::adaptive_solution(3);
  write_gltf(in_folder("a.glb"), s);
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning, in_folder("a.glb"))) << error;
  std::vector<Triangle> triangles;
  for (const auto& primitive : model.meshes[0].primitives) {
    const auto& accessor = model.accessors[primitive.indices];
    const auto& view = model.bufferViews[accessor.bufferView];
    const std::size_t before = triangles.size();
    triangles.resize(before + accessor.count / 3);
    std::memcpy(&triangles[before], model.buffers[view.buffer].data.data() + view.byteOffset,
                4 * accessor.count);
  }
  EXPECT_EQ(crack(s.mesh, s.scene, triangles), "");
}

}  // namespace
}  // namespace clrad
