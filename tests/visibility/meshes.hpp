/// Closed meshes, whose surface no segment from inside to outside may pass.
#pragma once
#include <map>
#include <vector>

#include "visibility/pairs.hpp"

namespace clrad::test {

/// Corners of a box with its 12 triangles facing outward, around `middle`, half its edges in grid steps.
inline std::vector<oracle::Triangle> box(const GridPoint& middle, const GridPoint& half) {
  const auto corner = [&](int i) {
    return GridPoint{middle[0] + (i & 1 ? half[0] : -half[0]), middle[1] + (i & 2 ? half[1] : -half[1]),
                     middle[2] + (i & 4 ? half[2] : -half[2])};
  };
  std::vector<oracle::Triangle> triangles;
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    triangles.push_back({{corner(f[0]), corner(f[1]), corner(f[2])}});
    triangles.push_back({{corner(f[0]), corner(f[2]), corner(f[3])}});
  }
  return triangles;
}

/// An icosahedron whose faces are cut in four `times` times, vertices pushed to the sphere and snapped: 20 *
/// 4^times.
inline std::vector<oracle::Triangle> icosphere(const GridPoint& middle, double radius_steps, int times) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<glm::dvec3> v{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                            {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<std::size_t, 3>> faces{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (; times > 0; --times) {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> halves;
    const auto half = [&](std::size_t a, std::size_t b) {
      const auto [at, added] = halves.try_emplace(std::minmax(a, b), v.size());
      if (added) v.push_back((v[a] + v[b]) * 0.5);
      return at->second;
    };
    std::vector<std::array<std::size_t, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const std::size_t ab = half(a, b), bc = half(b, c), ca = half(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = finer;
    for (glm::dvec3& p : v) p *= std::sqrt((1 + g * g) / (p.x * p.x + p.y * p.y + p.z * p.z));
  }
  std::vector<oracle::Triangle> triangles;
  for (const auto& f : faces) {
    oracle::Triangle t;
    for (std::size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        t.corner[i][static_cast<std::size_t>(k)] =
            middle[static_cast<std::size_t>(k)] +
            std::llround(v[f[i]][k] / std::sqrt(1 + g * g) * radius_steps);
    triangles.push_back(t);
  }
  return triangles;
}

/// Segments from near the middle to the outside that pass exactly through a corner, a point of an edge, one
/// grid step beside one of these, or anywhere. pre: every point within `inside` steps of the middle is
/// inside, and every point farther than `outside` from it is outside.
inline std::vector<oracle::Segment> escapes(std::mt19937_64& random,
                                            const std::vector<oracle::Triangle>& mesh,
                                            const GridPoint& middle, std::int64_t inside,
                                            std::int64_t outside, std::size_t count) {
  std::vector<oracle::Segment> made;
  while (made.size() < count) {
    const oracle::Triangle& t = mesh[random() % mesh.size()];
    const std::size_t i = random() % 3;
    oracle::Segment s;
    s.from = random() % 4 ? sum(middle, anywhere(random, inside)) : middle;
    if (random() % 3 == 0)  // twice a corner minus the start: the corner is exactly half-way
      s.to = sum(sum(t.corner[i], t.corner[i]), s.from, -1);
    else  // the middle of an edge is exactly half-way
      s.to = sum(sum(t.corner[i], t.corner[(i + 1) % 3]), s.from, -1);
    if (random() % 4 == 0) s.to = sum(s.to, anywhere(random, 1));
    if (random() % 8 == 0) s.to = sum(middle, anywhere(random, 2 * outside));
    std::int64_t reach = 0;
    for (std::size_t k = 0; k < 3; ++k) reach = std::max(reach, std::abs(s.to[k] - middle[k]));
    if (reach <= outside) continue;
    bool fits = true;
    for (std::int64_t x : s.to) fits = fits && std::abs(x) <= farthest;
    if (!fits) continue;
    if (random() % 2) std::swap(s.from, s.to);
    made.push_back(s);
  }
  return made;
}

}  // namespace clrad::test
