#include "scene/quads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace {

using namespace clrad;
using Triangles = std::vector<std::array<glm::dvec3, 3>>;

std::size_t quads_in(const std::vector<MergedFace>& faces) {
  return static_cast<std::size_t>(
      std::count_if(faces.begin(), faces.end(), [](const auto& f) { return f.count == 4; }));
}

TEST(SceneQuads, PairBecomesTheQuadWhicheverDiagonalAndStart) {
  const std::array<glm::dvec3, 4> q = {{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}};
  for (int first = 0; first < 3; ++first) {
    for (int second = 0; second < 3; ++second) {
      for (int diagonal = 0; diagonal < 2; ++diagonal) {
        const std::array<int, 3> a = diagonal ? std::array{0, 1, 3} : std::array{0, 1, 2};
        const std::array<int, 3> b = diagonal ? std::array{1, 2, 3} : std::array{0, 2, 3};
        Triangles t(2);
        for (int i = 0; i < 3; ++i) t[0][i] = q[a[(i + first) % 3]], t[1][i] = q[b[(i + second) % 3]];
        const auto faces = merge_quads(t);
        ASSERT_EQ(faces.size(), 1u);
        ASSERT_EQ(faces[0].count, 4u);
        const auto start =
            std::find(faces[0].corner.begin(), faces[0].corner.end(), q[0]) - faces[0].corner.begin();
        for (int i = 0; i < 4; ++i) EXPECT_EQ(faces[0].corner[(start + i) % 4], q[i]);
      }
    }
  }
}

TEST(SceneQuads, WhatIsNoPlanarConvexQuadStays) {
  const auto faces_of = [](const glm::dvec3& fourth) {
    return merge_quads({{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{0, 0, 0}, {1, 1, 0}, fourth}}}).size();
  };
  EXPECT_EQ(faces_of({0, 1, 0}), 1u);
  EXPECT_EQ(faces_of({0, 1, 2.8e-6}), 1u);  // 0.99e-6 of the diagonal
  EXPECT_EQ(faces_of({0, 1, 2.9e-6}), 2u);  // not planar
  EXPECT_EQ(faces_of({0.25, 0.5, 0}), 1u);  // convex still
  EXPECT_EQ(faces_of({-1, 0, 0}), 2u);      // a straight corner at the origin
  EXPECT_EQ(faces_of({-2, -1, 0}), 2u);     // concave there
  // Facing opposite ways, and an edge of three.
  EXPECT_EQ(merge_quads({{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{1, 1, 0}, {0, 0, 0}, {0, 1, 0}}}}).size(),
            2u);
  EXPECT_EQ(merge_quads({{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}},
                         {{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}},
                         {{{0, 0, 0}, {1, 1, 0}, {0, 0, 1}}}})
                .size(),
            3u);
}

TEST(SceneQuads, GridBecomesItsCells) {
  // 8 x 5 cells with diagonals of both kinds, corners rounded to float as in a file.
  Triangles t;
  const auto at = [](int i, int j) { return glm::dvec3(float(0.1 * i), float(0.3 * j), 0.7f); };
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      if ((i + j) % 3 == 0) {
        t.push_back({a, b, d});
        t.push_back({b, c, d});
      } else {
        t.push_back({a, b, c});
        t.push_back({a, c, d});
      }
    }
  }
  const auto faces = merge_quads(t);
  ASSERT_EQ(faces.size(), 40u);
  EXPECT_EQ(quads_in(faces), 40u);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    EXPECT_EQ(faces[f].triangle, 2 * f) << "file order";
    double low = 1e9, high = -1e9;
    for (const auto& c : faces[f].corner) low = std::min(low, c.x), high = std::max(high, c.x);
    EXPECT_NEAR(high - low, 0.1, 1e-6) << "a cell, not a parallelogram across two";
  }
}

TEST(SceneQuads, EachTriangleIsUsedOnce) {
  // A flat fan of five: two quads and one triangle, area kept.
  Triangles t;
  for (int i = 0; i < 5; ++i) {
    const double a = 0.5 * i, b = 0.5 * (i + 1);
    t.push_back({{{0, 0, 0}, {std::cos(a), std::sin(a), 0}, {std::cos(b), std::sin(b), 0}}});
  }
  const auto faces = merge_quads(t);
  EXPECT_EQ(faces.size(), 3u);
  EXPECT_EQ(quads_in(faces), 2u);
}

}  // namespace
