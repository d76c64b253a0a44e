#include "visibility/grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "device/divided.hpp"

namespace {

using clrad::Device;
using clrad::Grid;
using clrad::Occluders;
using clrad::OccluderTriangle;
using Cells = std::array<std::uint32_t, 3>;

std::vector<OccluderTriangle> triangles_of_two_sizes(std::mt19937_64& random, int count, double size) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<OccluderTriangle> all;
  for (int i = 0; i < count; ++i) {
    OccluderTriangle t{{}, std::uint32_t(i), std::uint32_t(i)};
    const glm::dvec3 middle(unit(random) * 0.9, unit(random) * 0.7, unit(random) * 0.5);
    const double mine = i % 10 == 0 ? 0.8 : size;
    for (auto& c : t.corner) c = middle + glm::dvec3(unit(random), unit(random), unit(random)) * mine;
    all.push_back(t);
  }
  return all;
}

/// Squared distance, by plain sampling-free geometry in double: do triangle and box [low, high] overlap?
/// Clips the triangle by the box's six planes (Sutherland & Hodgman) and asks whether anything is left. Not
/// the kernel's method.
bool overlap(const OccluderTriangle& t, glm::dvec3 low, glm::dvec3 high) {
  std::vector<glm::dvec3> polygon(t.corner, t.corner + 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto inside = [&](const glm::dvec3& p) {
        return side ? high[axis] - p[axis] : p[axis] - low[axis];
      };
      std::vector<glm::dvec3> kept;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const auto a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        const double da = inside(a), db = inside(b);
        if (da >= 0) kept.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
      }
      polygon = kept;
    }
  return !polygon.empty();
}

struct Lists {
  std::vector<std::vector<std::uint32_t>> of;
};

Lists download(const Grid& grid) {
  const auto held = grid.held.download(), first = grid.first_block.download();
  const auto lanes = grid.lanes.download(0, std::uint64_t(grid.blocks) * grid.width);
  Lists lists;
  for (std::uint32_t v = 0; v < grid.voxels(); ++v) {
    EXPECT_EQ(first[v + 1] - first[v], (held[v] + grid.width - 1) / grid.width);
    std::vector<std::uint32_t> mine;
    for (std::uint32_t i = first[v] * grid.width; i < first[v + 1] * grid.width; ++i)
      if (i - first[v] * grid.width < held[v])
        mine.push_back(lanes[i]);
      else
        EXPECT_EQ(lanes[i], CLRAD_NONE);
    lists.of.push_back(mine);
  }
  EXPECT_EQ(first[grid.voxels()], grid.blocks);
  return lists;
}

/// Lists hold all that overlaps the voxel, nothing that is farther than four pads from it, each once,
/// ascending.
void verify(Device& device, const std::vector<OccluderTriangle>& triangles, Cells cells) {
  const Occluders occluders(device, triangles);
  const Grid grid(device, occluders, cells);
  ASSERT_EQ(grid.cells, cells);
  const auto lists = download(grid);
  const auto f = grid.frame.download();
  std::size_t listed = 0, loose = 0;
  for (std::uint32_t v = 0; v < grid.voxels(); ++v) {
    const std::uint32_t i[3] = {v % cells[0], v / cells[0] % cells[1], v / cells[0] / cells[1]};
    const auto& mine = lists.of[v];
    EXPECT_TRUE(std::is_sorted(mine.begin(), mine.end()));
    EXPECT_EQ(std::adjacent_find(mine.begin(), mine.end()), mine.end());
    const std::set<std::uint32_t> has(mine.begin(), mine.end());
    glm::dvec3 low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = double(f[a]) + i[a] * double(f[3 + a]);
      high[a] = double(f[a]) + (i[a] + 1) * double(f[3 + a]);
    }
    const double pad = 0x1p-16, slack = 4 * pad;
    for (std::uint32_t k = 0; k < triangles.size(); ++k) {
      const bool must = overlap(triangles[k], low, high);
      const bool may = overlap(triangles[k], low - slack, high + slack);
      if (must) {
        EXPECT_TRUE(has.count(k)) << "triangle " << k << " voxel " << v;
      }
      if (!may && has.count(k)) ++loose;
      listed += has.count(k);
    }
  }
  // The separating axes of box and triangle are complete, so what is padded away from is apart but for
  // rounding.
  EXPECT_EQ(loose, 0u) << "of " << listed;
  EXPECT_GE(listed, triangles.size());
}

TEST(Grid, ListsHoldWhatOverlapsAndNoMore) {
  const unsigned seed = 4711;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  verify(device, triangles_of_two_sizes(random, 150, 0.2), {5, 4, 3});
  verify(device, triangles_of_two_sizes(random, 60, 0.05), {1, 1, 1});
  verify(device, triangles_of_two_sizes(random, 60, 0.05), {9, 1, 2});
  verify(device, triangles_of_two_sizes(random, 1, 0.3), {4, 4, 4});
}

TEST(Grid, TrianglesInVoxelFacesAreInBothVoxels) {
  Device device;
  // Squares at x = -0.5, 0, 0.5: with 2 cells the middle one lies in the plane between them.
  std::vector<OccluderTriangle> triangles;
  for (double x : {-0.5, 0.0, 0.5}) {
    triangles.push_back({{{x, -0.5, -0.5}, {x, 0.5, -0.5}, {x, 0.5, 0.5}}, 0, 0});
    triangles.push_back({{{x, -0.5, -0.5}, {x, 0.5, 0.5}, {x, -0.5, 0.5}}, 0, 0});
  }
  const Occluders occluders(device, triangles);
  const Grid grid(device, occluders, {2, 1, 1});
  const auto lists = download(grid);
  EXPECT_EQ(lists.of[0], (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(lists.of[1], (std::vector<std::uint32_t>{2, 3, 4, 5}));
  verify(device, triangles, {4, 3, 2});
}

TEST(Grid, IsTheSameForAllWorkGroupsAndCores) {
  std::mt19937_64 random(7);
  const auto triangles = triangles_of_two_sizes(random, 300, 0.1);
  std::vector<std::uint32_t> lanes, held;
  for (const clrad::DeviceOptions& options :
       {clrad::DeviceOptions{}, clrad::DeviceOptions{.cores = clrad::test::one_core()},
        clrad::DeviceOptions{.work_group_size = 16}}) {
    Device device(options);
    const Occluders occluders(device, triangles);
    const Grid grid(device, occluders);
    if (lanes.empty()) {
      lanes = grid.lanes.download();
      held = grid.held.download();
    }
    EXPECT_EQ(lanes, grid.lanes.download());
    EXPECT_EQ(held, grid.held.download());
  }
}

TEST(Grid, WidthChangesBlocksOnly) {
  std::mt19937_64 random(8);
  const auto triangles = triangles_of_two_sizes(random, 100, 0.2);
  std::vector<std::vector<std::uint32_t>> first;
  for (unsigned width : {1u, 4u, 16u}) {
    Device device({.packet_width = width});
    const Occluders occluders(device, triangles);
    const Grid grid(device, occluders, {3, 4, 5});
    EXPECT_EQ(grid.width, width);
    const auto lists = download(grid).of;
    if (first.empty()) first = lists;
    EXPECT_EQ(lists, first);
  }
}

TEST(Grid, NothingToHold) {
  Device device;
  const Occluders occluders(device, {});
  const Grid grid(device, occluders);
  EXPECT_EQ(grid.blocks, 0u);
  EXPECT_EQ(grid.voxels(), 1u);
}

TEST(Grid, ResolutionGrowsWithTheSceneAndStaysInMemory) {
  std::mt19937_64 random(9);
  std::uint32_t before = 0;
  for (int count : {20, 2000, 20000}) {
    const auto triangles = triangles_of_two_sizes(random, count, 0.02);
    const auto built = [&](Device& device) {
      const Occluders occluders(device, triangles);
      const Grid grid(device, occluders);
      // Cells follow the shape of the scene: x is the longest side, z the shortest.
      EXPECT_GE(grid.cells[0], grid.cells[1]);
      EXPECT_GE(grid.cells[1], grid.cells[2]);
      return grid.voxels();
    };
    Device ample;
    const std::uint32_t voxels = built(ample);
    EXPECT_GT(voxels, before);
    before = voxels;
    // A device whose lists take more room gets a coarser grid then.
    Device small({.memory_bytes = 64u << 20});
    EXPECT_LE(built(small), voxels);
    EXPECT_LE(small.ledger()->peak, 64u << 20);
  }
}

}  // namespace
