/// Segments and triangles for the visibility tests, on the grid: random ones and ones made to be hard.
#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "clrad/visibility.hpp"
#include "oracle/rational_visibility.hpp"

namespace clrad::test {

struct Pair {
  oracle::Segment segment;
  oracle::Triangle triangle;
};

inline std::int64_t integer(std::mt19937_64& random, std::int64_t low, std::int64_t high) {
  return low + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(high - low + 1));
}

inline constexpr std::int64_t farthest = std::int64_t(1) << 40;  // 4 frame units in grid steps

inline GridPoint anywhere(std::mt19937_64& random, std::int64_t reach = farthest) {
  return {integer(random, -reach, reach), integer(random, -reach, reach), integer(random, -reach, reach)};
}
inline GridPoint sum(const GridPoint& a, const GridPoint& b, std::int64_t times = 1) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}

/// A triangle of 2^least_size grid steps up to the frame, and a segment of as varied a length whose line
/// mostly meets it.
inline Pair random_pair(std::mt19937_64& random, std::int64_t least_size) {
  const std::int64_t size = std::int64_t(1) << integer(random, least_size, 38),
                     length = std::int64_t(1) << integer(random, least_size, 38);
  const GridPoint middle = anywhere(random, std::int64_t(1) << integer(random, 0, 39));
  Pair pair;
  GridPoint* v = pair.triangle.corner;
  for (int i = 0; i < 3; ++i) v[i] = sum(middle, anywhere(random, size));
  // A point of the triangle, or of its plane beside it.
  GridPoint aim;
  const double along_0 = double(random() % 1024) / 1024, along_1 = double(random() % 1024) / 1024;
  for (std::size_t k = 0; k < 3; ++k)
    aim[k] =
        v[0][k] + std::llround(along_0 * double(v[1][k] - v[0][k]) + along_1 * double(v[2][k] - v[0][k]));
  const GridPoint direction = anywhere(random, length);
  pair.segment.from = sum(aim, direction, integer(random, -1, 2) * 2 + 1);
  pair.segment.to = sum(sum(aim, direction, -1), anywhere(random, 1 + length / 16));
  return pair;
}

/// All coordinates from a few values of one step: vertices, edges and planes are met exactly all the time.
inline Pair lattice_pair(std::mt19937_64& random) {
  const std::int64_t step = std::int64_t(1) << integer(random, 0, 38), reach = integer(random, 1, 3);
  GridPoint origin = anywhere(random, farthest - 4 * step > 0 && random() % 2 ? farthest - 4 * step : 0);
  if (random() % 16 == 0) origin = {0, 0, 0};
  const auto point = [&] { return sum(origin, anywhere(random, reach), step); };
  Pair pair;
  for (GridPoint& corner : pair.triangle.corner) corner = point();
  pair.segment.from = point();
  pair.segment.to = point();
  // Everything in one plane.
  if (random() % 4 == 0) {
    const std::size_t axis = random() % 3;
    for (GridPoint& corner : pair.triangle.corner) corner[axis] = origin[axis];
    pair.segment.from[axis] = pair.segment.to[axis] = origin[axis];
  }
  return pair;
}

/// A segment through, or one grid step beside, a corner or a point of an edge, or ending there.
inline Pair aimed_pair(std::mt19937_64& random) {
  const std::int64_t size = std::int64_t(1) << integer(random, 0, 36), length = std::int64_t(1)
                                                                                << integer(random, 0, 36);
  const GridPoint aim = anywhere(random, std::int64_t(1) << integer(random, 0, 39));
  const GridPoint direction = anywhere(random, length), edge = anywhere(random, size);
  Pair pair;
  GridPoint* corner = pair.triangle.corner;
  const std::size_t first = random() % 3;
  corner[first] = sum(aim, edge, integer(random, 0, 3));
  corner[(first + 1) % 3] = sum(aim, edge, -integer(random, 0, 3));
  corner[(first + 2) % 3] = sum(aim, anywhere(random, size));
  pair.segment.from = sum(aim, direction, integer(random, 0, 3));
  pair.segment.to = sum(aim, direction, -integer(random, 0, 3));
  // In the triangle's plane, along an edge or across.
  if (random() % 8 == 0) pair.segment.to = sum(aim, edge, integer(random, -6, 6));
  if (random() % 8 == 0) pair.segment.from = sum(aim, edge, integer(random, -6, 6));
  if (random() % 3 == 0) pair.segment.to = sum(pair.segment.to, anywhere(random, 1));
  return pair;
}

/// Coordinates at the very ends of the range: the largest determinants there are.
inline Pair extreme_pair(std::mt19937_64& random) {
  const std::int64_t inset = random() % 2 ? 0 : std::int64_t(1) << integer(random, 0, 30);
  const auto value = [&] {
    const std::int64_t v = farthest - (inset ? integer(random, 0, inset) : 0);
    return random() % 8 == 0 ? 0 : random() % 2 ? v : -v;
  };
  const auto point = [&] { return GridPoint{value(), value(), value()}; };
  return {{point(), point()}, {{point(), point(), point()}}};
}

inline bool in_range(const Pair& pair) {
  for (const GridPoint* p : {&pair.segment.from, &pair.segment.to, &pair.triangle.corner[0],
                             &pair.triangle.corner[1], &pair.triangle.corner[2]})
    for (std::int64_t x : *p)
      if (x > farthest || x < -farthest) return false;
  return true;
}

/// `count` pairs whose triangle has area: sizes as in scenes (4 mm of a 4 m room and more), or hard ones.
/// Planes are given at random from a few, and none.
inline std::vector<Pair> pairs(std::mt19937_64& random, std::size_t count, bool hard) {
  std::vector<Pair> made;
  while (made.size() < count) {
    Pair pair;
    switch (hard ? 1 + random() % 4 : 0) {
      case 0:
        pair = random_pair(random, 28);
        break;
      case 1:
        pair = lattice_pair(random);
        break;
      case 2:
        pair = aimed_pair(random);
        break;
      case 3:
        pair = random_pair(random, 0);
        break;
      default:
        pair = extreme_pair(random);
        break;
    }
    if (!in_range(pair) || !oracle::has_area(pair.triangle)) continue;
    if (random() % 8 == 0) {
      pair.triangle.plane = static_cast<std::uint32_t>(random() % 2);
      pair.segment.from_plane = static_cast<std::uint32_t>(random() % 4);
      pair.segment.to_plane = random() % 2 ? 0xffffffffu : static_cast<std::uint32_t>(random() % 4);
    }
    made.push_back(pair);
  }
  return made;
}

inline Point point(const GridPoint& p, std::uint32_t plane) {
  return {unsnap(p), {0, 0, 1}, plane, 0xffffffffu};
}

inline OccluderTriangle occluder(const oracle::Triangle& t) {
  return {{unsnap(t.corner[0]), unsnap(t.corner[1]), unsnap(t.corner[2])}, t.plane, 0};
}

}  // namespace clrad::test
