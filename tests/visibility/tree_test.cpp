// The tree of occluders: every triangle in one leaf, inside the boxes above it, whatever the triangles are like.
#include "visibility/tree.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "visibility/snap.hpp"

namespace clrad {
namespace {

struct Box {
  float low[3], high[3];
};

struct Walked {
  std::vector<std::uint32_t> seen;  ///< how often each place in the tree's order lies in a leaf
  std::uint32_t nodes = 0, levels = 0, largest_leaf = 0, outside = 0;
};

// Walks all of it; counts triangles that stick out of a box above them.
Walked walked(const Tree& tree) {
  const auto words = tree.nodes.download();
  const auto triangles = tree.triangles.download();
  Walked w;
  w.seen.resize(tree.count);
  struct Entry {
    std::uint32_t node, level;
    std::vector<Box> above;
  };
  std::vector<Entry> stack{{0, 1, {}}};
  while (!stack.empty()) {
    const Entry e = stack.back();
    stack.pop_back();
    ++w.nodes;
    w.levels = std::max(w.levels, e.level);
    const std::uint32_t* node = &words.at(64ull * e.node);
    for (std::uint32_t k = 0; k < 8; ++k) {
      Box box;
      for (std::size_t a = 0; a < 3; ++a) {
        box.low[a] = std::bit_cast<float>(node[8 * a + k]);
        box.high[a] = std::bit_cast<float>(node[8 * (3 + a) + k]);
      }
      if (box.low[0] > box.high[0]) continue;  // no child
      auto above = e.above;
      above.push_back(box);
      const std::uint32_t code = node[48 + k], in_leaf = code & 7;
      if (in_leaf == 0) {
        stack.push_back({code >> 3, e.level + 1, above});
        continue;
      }
      w.largest_leaf = std::max(w.largest_leaf, in_leaf);
      for (std::uint32_t i = code >> 3; i < (code >> 3) + in_leaf; ++i) {
        ++w.seen.at(i);
        const clrad_triangle& t = triangles[i];
        const float hi[3][3] = {{t.x0, t.y0, t.z0}, {t.x1, t.y1, t.z1}, {t.x2, t.y2, t.z2}};
        const float lo[3][3] = {
            {t.x0_lo, t.y0_lo, t.z0_lo}, {t.x1_lo, t.y1_lo, t.z1_lo}, {t.x2_lo, t.y2_lo, t.z2_lo}};
        for (const Box& b : above)
          for (int c = 0; c < 3; ++c)
            for (int a = 0; a < 3; ++a) {
              const double place = double(hi[c][a]) + lo[c][a];
              w.outside += place < b.low[a] || place > b.high[a];
            }
      }
    }
  }
  return w;
}

// Every input triangle once, in boxes that hold it.
void expect_whole(Device& device, const std::vector<OccluderTriangle>& triangles, const char* what) {
  SCOPED_TRACE(what);
  const Tree tree(device, Occluders(device, triangles));
  ASSERT_EQ(tree.count, triangles.size());
  const Walked w = walked(tree);
  EXPECT_EQ(w.seen, std::vector<std::uint32_t>(tree.count, 1));
  EXPECT_EQ(w.nodes, tree.inner);
  EXPECT_LE(w.levels, tree.depth);
  EXPECT_LE(tree.depth, Tree::most_depth);
  EXPECT_LE(w.largest_leaf, 4u);
  EXPECT_EQ(w.outside, 0u);
  auto index = tree.input_index.download();
  index.resize(tree.count);
  std::vector<bool> there(tree.count);
  for (std::size_t k = 0; k < index.size(); ++k) {
    ASSERT_FALSE(there.at(index[k]));
    there[index[k]] = true;
    // What is at place k is that triangle.
    const clrad_triangle t = tree.triangles.at(k);
    EXPECT_EQ(t.polygon, triangles[index[k]].polygon);
    EXPECT_EQ(double(t.x1) + t.x1_lo, unsnap(snap(triangles[index[k]].corner[1])).x);
  }
}

std::vector<OccluderTriangle> random_ones(std::uint32_t count, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<OccluderTriangle> all;
  for (std::uint32_t i = 0; i < count; ++i) {
    OccluderTriangle t{{}, i, i};
    const glm::dvec3 middle(unit(random), 0.5 * unit(random), 0.1 * unit(random));
    for (auto& c : t.corner) c = middle + size * glm::dvec3(unit(random), unit(random), unit(random));
    all.push_back(t);
  }
  return all;
}

TEST(Tree, HoldsEveryTriangleOnceInsideItsBoxes) {
  Device device;
  for (const std::uint32_t n : {0u, 1u, 2u, 3u, 4u, 5u, 8u, 9u, 17u, 100u, 5000u})
    expect_whole(device, random_ones(n, n > 100 ? 0.02 : 0.3, n), ("random, " + std::to_string(n)).c_str());
}

TEST(Tree, TakesEqualAndNestedAndFlatTriangles) {
  Device device;
  auto equal = random_ones(1, 0.5, 7);
  for (std::uint32_t i = 1; i < 3000; ++i)
    equal.push_back({{equal[0].corner[0], equal[0].corner[1], equal[0].corner[2]}, i, i});
  expect_whole(device, equal, "3000 times the same");
  // Each a hair larger than the one before, about one point: clusters grow by one triangle at a time.
  std::vector<OccluderTriangle> nested;
  double size = 1e-6;
  for (std::uint32_t i = 0; i < 600; ++i, size *= 1.02)
    nested.push_back({{{-size, -size, 0}, {size, -size, 0}, {0, size, size}}, i, i});
  expect_whole(device, nested, "nested");
  EXPECT_EQ(Tree(device, Occluders(device, nested)).depth,
            11u);  // built again, balanced: 2^9 < 600 <= 2^10, and the leaves
  auto flat = random_ones(700, 0.05, 8);
  for (auto& t : flat)
    for (auto& c : t.corner) c.z = 0.25;
  expect_whole(device, flat, "all in one plane");
}

TEST(Tree, IsTheSameOnEveryDeviceAndBetterThanABalancedOne) {
  const auto triangles = random_ones(20000, 0.01, 9);
  std::vector<std::uint32_t> first;
  for (const DeviceOptions& options :
       {DeviceOptions{}, DeviceOptions{.work_group_size = 16, .packet_width = 1}}) {
    Device device(options);
    const Tree tree(device, Occluders(device, triangles));
    if (first.empty()) first = tree.nodes.download();
    EXPECT_EQ(tree.nodes.download(), first);
    // What joining by boxes is for: fewer tests than in the tree that joins by number.
    const Tree balanced(device, Occluders(device, triangles), true);
    EXPECT_LT(tree.cost, balanced.cost);
    EXPECT_EQ(balanced.depth, 16u);  // 2^14 < 20000 <= 2^15, and the leaves
  }
}

}  // namespace
}  // namespace clrad
