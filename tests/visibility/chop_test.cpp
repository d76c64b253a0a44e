#include "visibility/chop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "device/divided.hpp"
#include "oracle/rational_visibility.hpp"
#include "visibility/boxes.hpp"
#include "visibility/pairs.hpp"
#include "visibility/setting.hpp"

namespace {

using clrad::Array;
using clrad::ChopOptions;
using clrad::Device;
using clrad::DeviceOptions;
using clrad::OccluderTriangle;
using clrad::Point;
using clrad::PointArray;
using clrad::Segments;
using clrad::test::at;
using clrad::test::Setting;
using Cells = std::array<std::uint32_t, 3>;
using Cell = std::array<std::uint32_t, 3>;

struct Answer {
  std::vector<std::uint32_t> masks, triangle;
  std::vector<float> t;
  bool operator==(const Answer&) const = default;
};

Answer ask(Device& device, clrad::VisibilityEngine& engine, const Setting& s) {
  const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
  const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, s.samples};
  Array<std::uint32_t> masks(device, segments.origin_count * segments.words_per_origin(), "masks");
  Array<std::uint32_t> triangle(device, segments.count(), "triangle");
  Array<float> t(device, segments.count(), "t");
  engine.occluded(segments, masks);
  engine.intersect_closest(segments, triangle, t);
  return {masks.download(), triangle.download(), t.download()};
}

std::vector<OccluderTriangle> random_triangles(std::mt19937_64& random, int count, double size) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<OccluderTriangle> all;
  for (int i = 0; i < count; ++i) {
    OccluderTriangle t{{}, std::uint32_t(i), std::uint32_t(i)};
    const glm::dvec3 middle(unit(random) * 0.9, unit(random) * 0.7, unit(random) * 0.5);
    for (auto& c : t.corner) c = middle + glm::dvec3(unit(random), unit(random), unit(random)) * size;
    all.push_back(t);
  }
  return all;
}

/// A room with two blocks in it and a light under its ceiling: the Cornell box's kind of scene, edges shared.
Setting room(std::mt19937_64& random, std::uint32_t receivers, std::uint32_t samples) {
  Setting s;
  s.samples = samples;
  clrad::test::add_box(s.triangles, {-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6});
  clrad::test::add_box(s.triangles, {-0.4, -0.6, -0.3}, {-0.1, 0.1, 0.1});
  clrad::test::add_box(s.triangles, {0.1, -0.6, 0.0}, {0.4, -0.2, 0.3});
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::uint32_t i = 0; i < receivers; ++i) {
    const auto& t = s.triangles[random() % s.triangles.size()];
    double u = unit(random), v = unit(random);
    if (i % 7 == 0) v = 0;       // on an edge, so in two planes at once
    if (i % 13 == 0) u = v = 0;  // in a corner
    if (u + v > 1) u = 1 - u, v = 1 - v;
    s.origins.push_back(
        at(t.corner[0] + (t.corner[1] - t.corner[0]) * u + (t.corner[2] - t.corner[0]) * v, t.plane));
  }
  for (std::uint32_t i = 0; i < samples; ++i)
    s.targets.push_back(at({-0.2 + 0.4 * unit(random), 0.6, -0.2 + 0.4 * unit(random)}, 3));
  return s;
}

/// Everything on a coarse lattice: vertices, edges, planes and voxel faces are met exactly all the time.
Setting lattice(std::mt19937_64& random, int triangles, int segments) {
  Setting s;
  const auto point = [&] {
    const auto value = [&] { return double(clrad::test::integer(random, -4, 4)) / 8; };
    return glm::dvec3(value(), value(), value());
  };
  for (int i = 0; i < triangles; ++i)
    s.triangles.push_back({{point(), point(), point()}, std::uint32_t(i), std::uint32_t(i)});
  for (int i = 0; i < segments; ++i) {
    s.origins.push_back(at(point(), random() % 4 ? 0xffffffffu : std::uint32_t(random() % 20)));
    s.targets.push_back(at(point(), random() % 4 ? 0xffffffffu : std::uint32_t(random() % 20)));
  }
  return s;
}

Setting scattered(std::mt19937_64& random, int triangles, double size, int segments) {
  Setting s;
  s.triangles = random_triangles(random, triangles, size);
  std::uniform_real_distribution<double> unit(-1.2, 1.2);
  for (int i = 0; i < segments; ++i) {
    s.origins.push_back(at({unit(random), unit(random), unit(random)}));
    s.targets.push_back(at({unit(random), unit(random), unit(random)}));
  }
  return s;
}

/// Rays of the kinds that break a DDA, for a grid: along axes, in voxel faces and edges, through corners,
/// starting and ending on them, outside the box, of zero length.
void add_hard_rays(Setting& s, const std::vector<float>& frame, const Cells& cells, std::mt19937_64& random) {
  const auto plane = [&](int a, std::uint32_t i) { return double(frame[a] + float(i) * frame[3 + a]); };
  std::uniform_real_distribution<double> unit(0, 1);
  const auto inside = [&](int a) { return plane(a, 0) + unit(random) * (plane(a, cells[a]) - plane(a, 0)); };
  const auto on_plane = [&](int a) { return plane(a, std::uint32_t(random() % (cells[a] + 1))); };
  const auto push = [&](glm::dvec3 a, glm::dvec3 b) {
    s.origins.push_back(at(a));
    s.targets.push_back(at(b));
  };
  for (int k = 0; k < 40; ++k)
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      glm::dvec3 p, q;
      // Along an axis: inside a voxel, in a face, along an edge; whole, half, beyond the box, backwards.
      p[a] = k % 2 ? plane(a, 0) - 0.1 : inside(a);
      q[a] = k % 4 < 2 ? plane(a, cells[a]) + 0.1 : on_plane(a);
      p[b] = q[b] = k % 3 ? on_plane(b) : inside(b);
      p[c] = q[c] = k % 3 == 1 ? on_plane(c) : inside(c);
      push(p, q);
      push(q, p);
      // In a face but not along an axis.
      p = {inside(0), inside(1), inside(2)};
      q = {inside(0), inside(1), inside(2)};
      p[a] = q[a] = on_plane(a);
      push(p, q);
      // From corner to corner, and through corners: a diagonal of several cells.
      p = {on_plane(0), on_plane(1), on_plane(2)};
      q = {on_plane(0), on_plane(1), on_plane(2)};
      push(p, q);
      q = p * 2.0 - q;
      push(p, q);
      // Almost along an axis.
      p = {inside(0), inside(1), inside(2)};
      q = p;
      q[a] = inside(a);
      q[b] += 0x1p-30;
      push(p, q);
      // Past the box, and zero length.
      push({plane(0, 0) - 0.2, inside(1), inside(2)}, {plane(0, 0) - 0.1, inside(1), inside(2)});
      push(p, p);
      push({3.9, 3.9, -3.9}, {inside(0), inside(1), inside(2)});
      push({plane(0, 0), plane(1, 0), plane(2, 0)},
           {plane(0, cells[0]), plane(1, cells[1]), plane(2, cells[2])});
    }
}

/// Does the segment meet the box? Slabs in double, over all voxels: nothing of the kernels' way along the
/// ray.
bool meets(glm::dvec3 p, glm::dvec3 q, glm::dvec3 low, glm::dvec3 high) {
  double begin = 0, end = 1;
  for (int a = 0; a < 3; ++a) {
    const double d = q[a] - p[a];
    if (low[a] > high[a]) return false;
    if (d == 0) {
      if (p[a] < low[a] || p[a] > high[a]) return false;
      continue;
    }
    const double x = (low[a] - p[a]) / d, y = (high[a] - p[a]) / d;
    begin = std::max(begin, std::min(x, y));
    end = std::min(end, std::max(x, y));
  }
  return begin <= end;
}

/// The pieces of every ray against brute force over all voxels: a voxel that the segment enters deeper than
/// `eps` must be visited, one that it stays away from by `eps` must not. eps is 128 u = 2^-17, twice what
/// kernels/shared/voxel.cl derives for the error of a ray's place. Returns how many rays left no choice (both
/// sets equal).
std::size_t verify_pieces(Device& device, const Setting& s, const ChopOptions& options) {
  const double eps = 0x1p-17;
  auto engine = clrad::make_chop(device, s.triangles, options);
  const auto cells = engine->grid().cells;
  const auto f = engine->grid().frame.download();
  const auto held = engine->grid().held.download();
  const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
  const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, 0};
  const auto pieces = engine->pieces(segments);
  std::vector<std::vector<clrad::RayPiece>> of(s.origins.size());
  std::uint64_t candidates = 0;
  for (const auto& p : pieces) {
    of[p.segment].push_back(p);
    candidates += held[(p.cell[2] * cells[1] + p.cell[1]) * cells[0] + p.cell[0]];
  }
  EXPECT_EQ(engine->counts().rays, s.origins.size());
  EXPECT_EQ(engine->counts().pieces, pieces.size());
  EXPECT_EQ(engine->counts().candidates, candidates);

  std::size_t decided = 0;
  for (std::size_t r = 0; r < s.origins.size(); ++r) {
    // Waves come one after the other, so sort by place; within a wave the order is the ray's own.
    auto& mine = of[r];
    std::set<Cell> visited;
    for (std::size_t k = 0; k < mine.size(); ++k) {
      EXPECT_TRUE(visited.insert(mine[k].cell).second) << "ray " << r << " visits a voxel twice";
      EXPECT_LE(mine[k].t0, mine[k].t1) << "ray " << r;
      if (k > 0) {
        EXPECT_EQ(mine[k - 1].t1, mine[k].t0) << "ray " << r << " has a gap";
      }
    }
    const auto p = s.origins[r].position, q = s.targets[r].position;
    std::size_t must = 0, may = 0;
    for (std::uint32_t z = 0; z < cells[2]; ++z)
      for (std::uint32_t y = 0; y < cells[1]; ++y)
        for (std::uint32_t x = 0; x < cells[0]; ++x) {
          const Cell c{x, y, z};
          glm::dvec3 low, high;
          for (int a = 0; a < 3; ++a) {
            low[a] = double(f[a] + float(c[a]) * f[3 + a]);
            high[a] = double(f[a] + float(c[a] + 1) * f[3 + a]);
          }
          const bool has = visited.count(c) > 0;
          if (p != q && meets(p, q, low + eps, high - eps)) {
            ++must;
            EXPECT_TRUE(has) << "ray " << r << " misses voxel " << x << ' ' << y << ' ' << z;
          }
          if (p != q && meets(p, q, low - eps, high + eps))
            ++may;
          else
            EXPECT_FALSE(has) << "ray " << r << " is never in voxel " << x << ' ' << y << ' ' << z;
        }
    if (must == may) {
      ++decided;
      EXPECT_EQ(mine.size(), must) << "ray " << r;
    }
  }
  return decided;
}

TEST(Chop, PiecesEqualBruteForceEnumeration) {
  const unsigned seed = 20261;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  const Setting s = scattered(random, 60, 0.2, 700);
  for (const ChopOptions& options :
       {ChopOptions{.cells = {6, 5, 4}}, ChopOptions{.cells = {1, 7, 1}}, ChopOptions{.cells = {3, 1, 8}},
        ChopOptions{.cells = {1, 1, 1}}, ChopOptions{.rays_per_batch = 96, .cells = {9, 8, 7}, .slab = 2},
        ChopOptions{.cells = {12, 4, 9}, .slab = 5}}) {
    // A random ray passes within eps of a voxel's edge with a probability below 1 %: some 20 edges within
    // reach, each 2 eps wide in a cell of 0.1.
    EXPECT_GE(verify_pieces(device, s, options), 690u);
  }
}

TEST(Chop, PiecesOfHardRaysEqualBruteForceEnumeration) {
  const unsigned seed = 20262;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  for (const ChopOptions& options :
       {ChopOptions{.cells = {6, 5, 4}}, ChopOptions{.cells = {4, 4, 4}, .slab = 1},
        ChopOptions{.cells = {2, 1, 9}, .slab = 3}}) {
    Setting s = scattered(random, 40, 0.2, 1);
    const auto frame = clrad::make_chop(device, s.triangles, options)->grid().frame.download();
    add_hard_rays(s, frame, options.cells, random);
    verify_pieces(device, s, options);
  }
}

void expect_same(Device& device, const Setting& s, const std::vector<ChopOptions>& all) {
  auto serial = clrad::make_engine("serial", device, s.triangles);
  const Answer expected = ask(device, *serial, s);
  for (const auto& options : all) {
    auto chop = clrad::make_chop(device, s.triangles, options);
    const Answer got = ask(device, *chop, s);
    EXPECT_EQ(got.masks, expected.masks);
    EXPECT_EQ(got.triangle, expected.triangle);
    EXPECT_EQ(got.t, expected.t);
  }
}

TEST(Chop, BitsEqualSerialAndTheRationalOracle) {
  const unsigned seed = 20263;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  for (const Setting& s : {scattered(random, 40, 0.4, 400), lattice(random, 30, 400), room(random, 100, 4)}) {
    std::vector<clrad::oracle::Triangle> triangles;
    for (const auto& t : s.triangles)
      triangles.push_back(
          {{clrad::snap(t.corner[0]), clrad::snap(t.corner[1]), clrad::snap(t.corner[2])}, t.plane});
    expect_same(device, s, {{.cells = {5, 4, 3}}});
    auto chop = clrad::make_chop(device, s.triangles, {.cells = {4, 3, 4}, .slab = 2});
    const auto got = ask(device, *chop, s);
    std::size_t blocked = 0, count = 0;
    for (std::size_t i = 0; i < s.origins.size(); ++i)
      for (std::uint32_t k = 0; k < std::max(s.samples, 1u); ++k, ++count) {
        const auto &a = s.origins[i], &b = s.targets[s.samples ? k : i];
        const bool expected = clrad::oracle::blocked(
            clrad::oracle::Segment{clrad::snap(a.position), clrad::snap(b.position), a.plane, b.plane},
            triangles);
        EXPECT_EQ(got.masks[i] >> k & 1u, expected) << "segment " << i << ' ' << k;
        EXPECT_EQ(got.triangle[count] != CLRAD_NONE, expected) << "segment " << i << ' ' << k;
        blocked += expected;
      }
    EXPECT_GT(blocked, count / 20);
    EXPECT_LT(blocked, count - count / 20);
  }
}

TEST(Chop, BitsEqualSerialOnHardRaysWhateverTheBatchAndTheWaves) {
  const unsigned seed = 20264;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  Setting s = lattice(random, 200, 3000);
  add_hard_rays(s, clrad::make_chop(device, s.triangles, {.cells = {6, 5, 4}})->grid().frame.download(),
                {6, 5, 4}, random);
  expect_same(device, s,
              {{.cells = {6, 5, 4}},
               {.rays_per_batch = 100, .cells = {6, 5, 4}},
               {.rays_per_batch = 1024, .cells = {6, 5, 4}, .slab = 1},
               {.cells = {16, 16, 16}},
               {.cells = {1, 1, 1}},
               {.cells = {1, 8, 1}, .slab = 2},
               {}});
  expect_same(device, scattered(random, 1500, 0.05, 6000),
              {{}, {.cells = {20, 20, 20}}, {.cells = {9, 9, 9}, .slab = 2}});
}

TEST(Chop, ManySamplesAndChosenOrigins) {
  const unsigned seed = 20265;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device;
  for (std::uint32_t samples : {1u, 31u, 32u, 33u, 100u}) {
    const Setting s = room(random, 300, samples);
    // Batches of several origins, of one, and of a part of one.
    expect_same(device, s, {{.cells = {3, 3, 3}}, {.rays_per_batch = 120}, {.rays_per_batch = 64}});
    // Every third origin, last first.
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < s.origins.size(); i += 3) chosen.insert(chosen.begin(), i);
    const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
    const Array<std::uint32_t> active(device, chosen, "active");
    const Segments segments{&origins, &active, std::uint32_t(chosen.size()), &targets, samples};
    Array<std::uint32_t> a(device, chosen.size() * segments.words_per_origin(), "masks"),
        b(device, a.size(), "masks");
    clrad::make_engine("serial", device, s.triangles)->occluded(segments, a);
    clrad::make_engine("chop", device, s.triangles)->occluded(segments, b);
    EXPECT_EQ(a.download(), b.download()) << samples << " samples";
  }
}

TEST(Chop, SameBitsAndCountsOnOtherDevices) {
  const unsigned seed = 20266;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const Setting s = room(random, 500, 16), hard = lattice(random, 100, 2000);
  std::vector<Answer> expected;
  for (const DeviceOptions& options :
       {DeviceOptions{}, DeviceOptions{.cores = clrad::test::one_core(), .work_group_size = 16},
        DeviceOptions{.packet_width = 1}}) {
    Device device(options);
    std::vector<Answer> got;
    for (const auto& setting : {s, hard}) {
      auto engine = clrad::make_chop(device, setting.triangles, {.cells = {4, 5, 6}, .slab = 3});
      got.push_back(ask(device, *engine, setting));
      const auto counts = engine->counts();
      EXPECT_EQ(counts.rays, 2 * (setting.samples ? s.origins.size() * s.samples : hard.origins.size()));
      EXPECT_GT(counts.exact, 0u);
      EXPECT_GT(counts.pieces, counts.rays);
      EXPECT_GE(counts.candidates, counts.exact);
    }
    if (expected.empty()) expected = got;
    EXPECT_TRUE(got == expected) << "width " << options.packet_width << " group " << options.work_group_size;
  }
}

TEST(Chop, BlockedRaysDoNoMoreWork) {
  Device device;
  // A wall in front of the origins, and behind it a long hall of triangles.
  std::vector<OccluderTriangle> triangles = {{{{-0.9, -1, -1}, {-0.9, 3, -1}, {-0.9, -1, 3}}, 0, 0}};
  std::mt19937_64 random(5);
  for (auto t : random_triangles(random, 400, 0.1)) triangles.push_back(t);
  Setting s{triangles, {}, {}, 0};
  std::uniform_real_distribution<double> unit(-0.4, 0.4);
  for (int i = 0; i < 1000; ++i) {
    s.origins.push_back(at({-0.95, unit(random), unit(random)}));
    s.targets.push_back(at({0.9, unit(random), unit(random)}));
  }
  std::uint64_t pieces[2];
  for (int waves = 0; waves < 2; ++waves) {
    auto engine = clrad::make_chop(device, s.triangles, {.cells = {32, 8, 8}, .slab = waves ? 4u : 0u});
    const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
    const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, 0};
    Array<std::uint32_t> masks(device, s.origins.size(), "masks");
    engine->occluded(segments, masks);
    for (auto m : masks.download()) EXPECT_EQ(m, 1u);
    pieces[waves] = engine->counts().pieces;
  }
  // The first of eight waves finds the wall; it holds 4 x planes and what is crossed of y and z on the way.
  EXPECT_LT(pieces[1] * 5, pieces[0]);
}

TEST(Chop, NothingBlocksInAnEmptyScene) {
  Device device;
  std::mt19937_64 random(6);
  Setting s = scattered(random, 0, 0.1, 100);
  // Zero-area triangles block nothing either.
  for (int k = 0; k < 2; ++k) {
    const auto got = ask(device, *clrad::make_chop(device, s.triangles), s);
    EXPECT_EQ(got.masks, std::vector<std::uint32_t>(100, 0));
    EXPECT_EQ(got.triangle, std::vector<std::uint32_t>(100, CLRAD_NONE));
    EXPECT_EQ(got.t, std::vector<float>(100, 1.0f));
    s.triangles.push_back({{{-1, -1, -1}, {0, 0, 0}, {1, 1, 1}}, 0, 0});
  }
  s.origins.clear();
  s.targets.clear();
  EXPECT_TRUE(ask(device, *clrad::make_chop(device, s.triangles), s).masks.empty());
}

TEST(Chop, StaysInsideTheMemoryBudget) {
  const unsigned seed = 20267;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  constexpr std::uint64_t budget = 64u << 20;
  const Setting s = room(random, 62500, 16);
  std::vector<std::uint32_t> expected;
  // By itself, and with batches asked for that cannot fit: a million rays of some 17 pieces.
  for (const ChopOptions& options :
       {ChopOptions{}, ChopOptions{.rays_per_batch = 1u << 20, .cells = {16, 16, 16}}}) {
    Device device({.memory_bytes = budget});
    auto engine = clrad::make_chop(device, s.triangles, options);
    const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
    const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, s.samples};
    Array<std::uint32_t> masks(device, s.origins.size(), "masks");
    engine->occluded(segments, masks);
    EXPECT_LE(device.ledger()->peak, budget);
    EXPECT_EQ(engine->counts().rays, 1000000u);
    const auto bits = masks.download();
    if (expected.empty()) expected = bits;
    EXPECT_TRUE(bits == expected);
  }
}

}  // namespace
