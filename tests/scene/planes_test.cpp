#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/frame.hpp"
#include "scene/planes.hpp"

namespace {

using namespace clrad;
using Ids = std::vector<std::uint32_t>;

void add(Scene& scene, std::vector<glm::dvec3> corners) {
  Polygon polygon;
  polygon.corners = static_cast<std::uint32_t>(corners.size());
  std::copy(corners.begin(), corners.end(), polygon.corner.begin());
  scene.polygons.push_back(polygon);
}

struct Random {
  std::uint64_t state;
  double operator()(double low, double high) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return low + (high - low) * static_cast<double>(state >> 11) * 0x1p-53;
  }
};

// A plane with two directions in it.
struct Wall {
  glm::dvec3 origin, u, v;
  glm::dvec3 at(double a, double b) const { return origin + a * u + b * v; }
};

Wall random_wall(Random& random) {
  const auto direction = [&] {
    return glm::normalize(glm::dvec3(random(-1, 1), random(-1, 1), random(-1, 1)) + 1e-3);
  };
  const glm::dvec3 u = direction();
  const glm::dvec3 v = glm::normalize(glm::cross(u, direction()));
  return {glm::dvec3(random(-1, 1), random(-1, 1), random(-1, 1)), u, v};
}

TEST(ScenePlanes, WallsOfARoomAndBothFacings) {
  Scene scene;
  add(scene, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  add(scene, {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  add(scene, {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}});  // the first, facing down
  add(scene, {{2, 2, 0}, {3, 2, 0}, {2, 3, 0}});             // apart, in its plane
  add(scene, {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}});  // across
  add(scene, {{0.2, 0.2, -0.0}, {0.3, 0.2, 0.0}, {0.3, 0.3, -0.0}, {0.2, 0.3, 0}});
  EXPECT_EQ(plane_ids(scene), (Ids{0, 1, 0, 0, 2, 0}));
  EXPECT_EQ(plane_ids(Scene{}), Ids{});
}

TEST(ScenePlanes, ToleranceIsTwoToMinus36OfTheFrame) {
  // A floor 1.5 wide: one frame unit is a metre. A tile above it by less and by more than the tolerance.
  for (const double height : {0.9 * 0x1p-36, 1.1 * 0x1p-36, -0.9 * 0x1p-36, -1.1 * 0x1p-36}) {
    Scene scene;
    add(scene, {{0.5, 0.5, height}, {0.625, 0.5, height}, {0.625, 0.625, height}, {0.5, 0.625, height}});
    add(scene, {{0, 0, 0}, {1.5, 0, 0}, {1.5, 1.5, 0}, {0, 1.5, 0}});
    ASSERT_EQ(frame_of(scene).exponent, 0);
    const bool same = std::abs(height) < 0x1p-36;
    EXPECT_EQ(plane_ids(scene), same ? (Ids{0, 0}) : (Ids{0, 1})) << height;
  }
  // One corner out is enough to be out.
  Scene scene;
  add(scene, {{0, 0, 0}, {1.5, 0, 0}, {1.5, 1.5, 0}, {0, 1.5, 0}});
  add(scene, {{0.5, 0.5, 0}, {0.625, 0.5, 0}, {0.5, 0.625, 1e-10}});
  EXPECT_EQ(plane_ids(scene), (Ids{0, 1}));
}

// Tilted walls in pieces of very different sizes with T-junctions, some turned round; moved away from the
// origin.
void expect_pieces_found(const glm::dvec3& move, std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed) + ", moved by " + std::to_string(move.x));
  Random random{seed};
  Scene scene;
  Ids wall_of;
  for (std::uint32_t w = 0; w < 40; ++w) {
    const Wall wall = random_wall(random);
    for (int piece = 0; piece < 30; ++piece) {
      const double size = std::ldexp(1.0, -static_cast<int>(random(0, 12)));
      const double a = random(0, 1), b = random(0, 1);
      std::vector<glm::dvec3> quad = {wall.at(a, b), wall.at(a + size, b), wall.at(a + size, b + size),
                                      wall.at(a, b + size)};
      for (glm::dvec3& c : quad) c += move;
      if (random(0, 1) < 0.5) std::reverse(quad.begin(), quad.end());
      if (random(0, 1) < 0.3) quad.pop_back();
      add(scene, quad);
      wall_of.push_back(w);
    }
  }
  const Ids ids = plane_ids(scene);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_EQ(ids[i], wall_of[i]) << "piece " << i;  // walls come one after the other, so ids count them
  }
}

TEST(ScenePlanes, TiltedWallsInPieces) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) expect_pieces_found(glm::dvec3(0), seed);
}

TEST(ScenePlanes, TiltedWallsInPiecesFarFromTheOrigin) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) expect_pieces_found(glm::dvec3(1e6, -1e6, 0.7e6), seed);
}

TEST(ScenePlanes, StackedSheetsStayApart) {
  Random random{7};
  for (int trial = 0; trial < 20; ++trial) {
    const Wall wall = random_wall(random);
    const glm::dvec3 normal = glm::cross(wall.u, wall.v);
    Scene scene;
    Ids expected;
    // 200 sheets 1e-9 apart (the tolerance is 1.5e-11 of a frame unit, here of 2 m at most).
    for (std::uint32_t sheet = 0; sheet < 200; ++sheet) {
      const glm::dvec3 lift = normal * (1e-9 * sheet);
      for (int piece = 0; piece < 2; ++piece) {
        const double a = 0.5 * piece;
        add(scene, {wall.at(a, 0) + lift, wall.at(a + 0.5, 0) + lift, wall.at(a + 0.5, 1) + lift,
                    wall.at(a, 1) + lift});
        expected.push_back(sheet);
      }
    }
    EXPECT_EQ(plane_ids(scene), expected);
  }
}

TEST(ScenePlanes, SliversJoinTheWallTheyLieIn) {
  // Widths down to 1e-13: their own normals are noise, their corners are not.
  Random random{11};
  const Wall wall = random_wall(random);
  Scene scene;
  add(scene, {wall.at(0, 0), wall.at(1, 0), wall.at(1, 1), wall.at(0, 1)});
  for (int k = 1; k <= 13; ++k) {
    const double width = std::pow(10.0, -k);
    add(scene, {wall.at(0.1, 0.5), wall.at(0.9, 0.5), wall.at(0.5, 0.5 + width)});
  }
  for (const std::uint32_t id : plane_ids(scene)) EXPECT_EQ(id, 0u);
}

TEST(ScenePlanes, AlmostCoplanarWallsStayApart) {
  // Two halves of a floor that meet at an angle of 1e-9: the far side is off by 70 times the tolerance.
  Scene scene;
  add(scene, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  add(scene, {{-1, 0, 1e-9}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 1e-9}});
  EXPECT_EQ(plane_ids(scene), (Ids{0, 1}));
}

TEST(ScenePlanes, OrderAndScaleDoNotMatter) {
  Random random{3};
  Scene scene;
  for (int w = 0; w < 10; ++w) {
    const Wall wall = random_wall(random);
    for (int piece = 0; piece < 4; ++piece) {
      const double a = random(0, 1), b = random(0, 1);
      add(scene, {wall.at(a, b), wall.at(a + 0.1, b), wall.at(a, b + 0.1)});
    }
  }
  const Ids ids = plane_ids(scene);
  Scene other = scene;
  std::reverse(other.polygons.begin(), other.polygons.end());
  for (Polygon& p : other.polygons) {
    for (glm::dvec3& c : p.corner) c *= 0x1p-20;
  }
  const Ids reversed = plane_ids(other);
  const std::size_t n = ids.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      EXPECT_EQ(ids[i] == ids[j], reversed[n - 1 - i] == reversed[n - 1 - j]);
  }
}

// 2^17 polygons in 2^11 parallel planes. Comparing each with each plane would take 2^28 tests of three
// corners, each a few nanoseconds; comparing all pairs 64 times that. Hashing takes well under a second.
TEST(ScenePlanes, ManyPolygonsInManyPlanes) {
  constexpr std::uint32_t kCount = 1 << 17, kPlanes = 1 << 11;
  Random random{5};
  Scene scene;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double z = double(i % kPlanes) / kPlanes, a = random(0, 1), b = random(0, 1);
    add(scene, {{a, b, z}, {a + 0.01, b, z}, {a, b + 0.01, z}});
  }
  const auto start = std::chrono::steady_clock::now();
  const Ids ids = plane_ids(scene);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  for (std::uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(ids[i], i % kPlanes);
  EXPECT_LT(seconds.count(), 5.0);
}

}  // namespace
