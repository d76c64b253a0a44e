// Adaptive subdivision as a mesh operation: where vertices and elements go, whoever asked for them.
#include "mesh/subdivide.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "mesh/lattice.hpp"
#include "render/support.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

struct UnsplitSubject {
  Scene scene;
  Frame frame;
  Mesh mesh;
};

// A square, a kite (not a parallelogram) and a triangle, cut into several patches of several elements.
UnsplitSubject unsplit_subject() {
  UnsplitSubject s;
  s.scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                         test::polygon({{0, 0, 1}, {2, 0, 1}, {1.5, 1.5, 1}, {0, 1, 1}}),
                         test::polygon({{0, 0, 2}, {2, 0, 2}, {0, 1.5, 2}})});
  s.frame = frame_of(s.scene);
  s.mesh = build_mesh(s.scene, s.frame, plane_ids(s.scene), {.patch_edge_m = 1.1, .element_edge_m = 0.6});
  return s;
}

// Splits a random third of the elements, `rounds` times.
void split_at_random(Device& device, UnsplitSubject& s, int rounds, unsigned seed) {
  std::mt19937 random(seed);
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint32_t> split(s.mesh.elements.size());
    for (auto& word : split) word = random() % 3 == 0;
    subdivide(device, s.scene, s.frame, s.mesh, split);
  }
}

std::uint32_t corners_of(const Element& e) {
  return e.vertex[3] == 0xffffffffu ? 3 : 4;
}

TEST(Subdivide, ElementsCoverTheirPatchesInDepthFirstOrder) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  split_at_random(device, s, 4, 1);
  std::uint32_t next = 0;
  for (std::uint32_t p = 0; p < s.mesh.patches.size(); ++p) {
    const Patch& patch = s.mesh.patches[p];
    ASSERT_EQ(patch.first_element, next);
    double area = 0;
    std::uint64_t code = 0;
    for (std::uint32_t e = next; e < next + patch.elements; ++e) {
      const Element& element = s.mesh.elements[e];
      ASSERT_EQ(element.patch, p);
      // The leaves' code ranges follow each other without a gap: a partition of the patch.
      ASSERT_EQ(element.code, code);
      code += std::uint64_t(1) << 2 * (lattice_depth - element.level);
      area += element.area_m2;
      double weights = 0;
      for (const double w : element.weight) weights += w;
      EXPECT_NEAR(weights, 1, 1e-14);
    }
    EXPECT_EQ(code, std::uint64_t(1) << 2 * lattice_depth);
    // One rounding a term and one an addition.
    EXPECT_NEAR(area, patch.area_m2, 4e-16 * patch.elements * patch.area_m2);
    next += patch.elements;
  }
  EXPECT_EQ(next, s.mesh.elements.size());
  for (const PolygonMesh& polygon : s.mesh.polygons)
    EXPECT_EQ(polygon.first_element, s.mesh.patches[polygon.first_patch].first_element);
}

TEST(Subdivide, EveryPlaceHasOneVertexAndEveryVertexIsWhereItsParentsSay) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  const std::uint32_t before = s.mesh.vertex_count();
  split_at_random(device, s, 4, 2);
  ASSERT_GT(s.mesh.vertex_count(), before);
  ASSERT_EQ(s.mesh.lattice.size(), s.mesh.vertex_count());
  ASSERT_EQ(s.mesh.parents.size(), s.mesh.vertex_count());
  ASSERT_EQ(s.mesh.position_m.size(), s.mesh.vertex_count());
  std::set<std::array<std::uint32_t, 3>> places;
  std::set<std::uint32_t> used;
  for (const Element& e : s.mesh.elements)
    for (std::uint32_t k = 0; k < corners_of(e); ++k) used.insert(e.vertex[k]);
  for (std::uint32_t v = 0; v < s.mesh.vertex_count(); ++v) {
    const auto [i, j] = s.mesh.lattice[v];
    EXPECT_TRUE(places.insert({s.mesh.receivers[v].surface, i, j}).second) << "vertex " << v << " twice";
    EXPECT_EQ(used.count(v), 1u) << "vertex " << v << " is in no element";
    if (s.mesh.parents[v][0] == 0xffffffffu) continue;
    double mean_i = 0, mean_j = 0;
    for (const std::uint32_t parent : s.mesh.parents[v]) {
      EXPECT_EQ(s.mesh.receivers[parent].surface, s.mesh.receivers[v].surface);
      mean_i += s.mesh.lattice[parent][0] / 4.0, mean_j += s.mesh.lattice[parent][1] / 4.0;
    }
    EXPECT_EQ(mean_i, i);
    EXPECT_EQ(mean_j, j);
    // The lattice is a plane's bilinear map: the vertex lies where the map takes its coordinates.
    const PolygonMesh& polygon = s.mesh.polygons[s.mesh.receivers[v].surface];
    const LatticeMap map(s.scene.polygons[s.mesh.receivers[v].surface], s.frame, polygon.patches_u,
                         polygon.patches_v);
    EXPECT_EQ(s.mesh.position_m[v], s.frame.from_frame(map.position(i, j)));
  }
}

TEST(Subdivide, NeighboursDifferByOneLevelAndTheirEdgesKnowTheVertexBetween) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  split_at_random(device, s, 5, 3);
  using LatticePlace = std::array<std::uint32_t, 3>;
  std::map<LatticePlace, std::uint32_t> at;
  for (std::uint32_t v = 0; v < s.mesh.vertex_count(); ++v)
    at[{s.mesh.receivers[v].surface, s.mesh.lattice[v][0], s.mesh.lattice[v][1]}] = v;
  std::size_t middles = 0;
  for (const Element& e : s.mesh.elements)
    for (std::uint32_t k = 0; k < corners_of(e); ++k) {
      const auto a = s.mesh.lattice[e.vertex[k]], b = s.mesh.lattice[e.vertex[(k + 1) % corners_of(e)]];
      const std::uint32_t surface = s.mesh.receivers[e.vertex[k]].surface;
      const auto on_edge = [&](double t) {
        return at.find({surface, std::uint32_t(a[0] + t * (double(b[0]) - a[0])),
                        std::uint32_t(a[1] + t * (double(b[1]) - a[1]))});
      };
      const auto middle = on_edge(0.5);
      EXPECT_EQ(e.middle[k], middle == at.end() ? 0xffffffffu : middle->second);
      middles += e.middle[k] != 0xffffffffu;
      EXPECT_EQ(on_edge(0.25), at.end());
      EXPECT_EQ(on_edge(0.75), at.end());
    }
  EXPECT_GT(middles, 10u);  // or the test has seen nothing
}

TEST(Subdivide, SplittingEverythingGivesTheFinerRegularMesh) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  const Mesh fine =
      build_mesh(s.scene, s.frame, plane_ids(s.scene), {.patch_edge_m = 1.1, .element_edge_m = 0.3});
  subdivide(device, s.scene, s.frame, s.mesh, std::vector<std::uint32_t>(s.mesh.elements.size(), 1));
  ASSERT_EQ(s.mesh.elements.size(), fine.elements.size());
  ASSERT_EQ(s.mesh.vertex_count(), fine.vertex_count());
  for (std::size_t e = 0; e < fine.elements.size(); ++e) {
    const Element &a = s.mesh.elements[e], &b = fine.elements[e];
    EXPECT_EQ(a.code, b.code);
    EXPECT_EQ(a.level, b.level);
    EXPECT_EQ(a.area_m2, b.area_m2);
    EXPECT_EQ(a.weight, b.weight);
    for (std::uint32_t k = 0; k < corners_of(b); ++k)
      EXPECT_EQ(s.mesh.position_m[a.vertex[k]], fine.position_m[b.vertex[k]]);
  }
}

TEST(Subdivide, NewVerticesFollowMortonOrderWithinAPolygon) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  const Subdivision done =
      subdivide(device, s.scene, s.frame, s.mesh, std::vector<std::uint32_t>(s.mesh.elements.size(), 1));
  const auto morton = [](std::uint32_t i, std::uint32_t j) {
    std::uint64_t code = 0;
    for (int bit = 0; bit < 32; ++bit)
      code |= std::uint64_t(i >> bit & 1) << 2 * bit | std::uint64_t(j >> bit & 1) << (2 * bit + 1);
    return code;
  };
  for (std::uint32_t v = done.first_vertex + 1; v < s.mesh.vertex_count(); ++v) {
    const auto key = [&](std::uint32_t at) {
      return std::pair(s.mesh.receivers[at].surface, morton(s.mesh.lattice[at][0], s.mesh.lattice[at][1]));
    };
    EXPECT_LT(key(v - 1), key(v));
  }
}

TEST(Subdivide, NothingWantedChangesNothing) {
  Device device;
  UnsplitSubject s = unsplit_subject();
  const Mesh before = s.mesh;
  const Subdivision done =
      subdivide(device, s.scene, s.frame, s.mesh, std::vector<std::uint32_t>(s.mesh.elements.size(), 0));
  EXPECT_EQ(done.split, 0u);
  EXPECT_EQ(s.mesh.elements.size(), before.elements.size());
  EXPECT_EQ(s.mesh.vertex_count(), before.vertex_count());
}

}  // namespace
}  // namespace clrad
