// What occluders show to a point: the planes through it and their outline, of flat polygons and of closed convex bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <random>
#include <vector>

#include "shared/kernel_math.hpp"

namespace clrad {
namespace {

using glm::dvec3;
using std::uint32_t;

// The tables of one occluder (kernels/viewfactors/tables.cl).
struct Occluder {
  std::vector<double> vertex, plane;
  std::vector<uint32_t> words, side;

  struct Shown {
    int sides;
    std::vector<dvec3> inward;
    std::vector<double> size;
  };
  Shown shown_to(const dvec3& x) const {
    kernel64::clrad_vector h[MOST_SIDES];
    double size[MOST_SIDES];
    Shown s{kernel64::shown_sides(words.data(), side.data(), plane.data(), vertex.data(), 0,
                                  kernel64::clrad_make(x.x, x.y, x.z), h, size),
            {},
            {}};
    for (int k = 0; k < s.sides; ++k)
      s.inward.emplace_back(h[k].x, h[k].y, h[k].z), s.size.push_back(size[k]);
    return s;
  }
};

void add(std::vector<double>& all, const dvec3& v) {
  all.insert(all.end(), {v.x, v.y, v.z});
}

// Half edges `half` about the origin: six faces, twelve edges.
Occluder box(const dvec3& half) {
  Occluder o;
  for (int k = 0; k < 8; ++k) add(o.vertex, dvec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1) * half);
  for (int f = 0; f < 6; ++f) {  // face 2 axis + 1 is the upper one
    dvec3 n(0);
    n[f / 2] = f % 2 ? 1 : -1;
    add(o.plane, n), o.plane.insert(o.plane.end(), {half[f / 2], 0});
  }
  for (uint32_t k = 0; k < 8; ++k)
    for (uint32_t axis = 0; axis < 3; ++axis) {
      if (k >> axis & 1) continue;
      const uint32_t b = (axis + 1) % 3, c = (axis + 2) % 3;
      o.side.insert(o.side.end(), {k, k | 1u << axis, 2 * b + (k >> b & 1), 2 * c + (k >> c & 1)});
    }
  o.words = {0, 8, 0, 0, 12};
  return o;
}

// Where the ray from x along d is inside the box, from the entry to the exit; negative when it misses. [distance]
double length_inside(const dvec3& x, const dvec3& d, const dvec3& half) {
  double enter = 0, leave = INFINITY;
  for (int a = 0; a < 3; ++a) {
    const double s = (-half[a] - x[a]) / d[a], t = (half[a] - x[a]) / d[a];
    enter = std::max(enter, std::min(s, t)), leave = std::min(leave, std::max(s, t));
  }
  return leave - enter;
}

TEST(ViewFactorTables, ABodyHidesWhatItsOutlineEncloses) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto any = [&](double size) { return dvec3(unit(random), unit(random), unit(random)) * size; };
  int outlines[MOST_SIDES + 1] = {}, hit = 0, missed = 0;
  for (int i = 0; i < 400; ++i) {
    const dvec3 half = glm::abs(any(0.5)) + 0.05;
    const Occluder o = box(half);
    const dvec3 x = any(2);
    if (std::abs(x.x) < half.x && std::abs(x.y) < half.y && std::abs(x.z) < half.z) continue;
    const auto shown = o.shown_to(x);
    // One face shows four edges; two or three show six.
    ASSERT_TRUE(shown.sides == 4 || shown.sides == 6) << shown.sides;
    ++outlines[shown.sides];
    for (int k = 0; k < 50; ++k) {
      const dvec3 d = glm::normalize(any(0.6) - x);
      double least = INFINITY;
      for (int e = 0; e < shown.sides; ++e) {
        const auto s = std::size_t(e);
        // Six products, 2^-53 of each: no component of a normal is off by more than 2^-50 of `size`.
        ASSERT_LE(glm::length(shown.inward[s]), 4 * shown.size[s]);
        least = std::min(least, glm::dot(shown.inward[s], d) / shown.size[s]);
      }
      if (std::abs(least) < 1e-12) continue;  // through the outline, but for rounding
      const bool inside = length_inside(x, d, half) > 0;
      EXPECT_EQ(least > 0, inside) << "box " << i << " ray " << k;
      ++(inside ? hit : missed);
    }
  }
  EXPECT_GT(outlines[4], 10);
  EXPECT_GT(outlines[6], 100);
  EXPECT_GT(hit, 2000);
  EXPECT_GT(missed, 2000);
}

TEST(ViewFactorTables, ABodyHidesAllFromAPointUnderItsFace) {
  EXPECT_EQ(box({0.5, 0.5, 0.5}).shown_to({0.1, -0.2, -0.5}).sides, 0);
  EXPECT_EQ(box({0.5, 0.5, 0.5}).shown_to({0.1, -0.2, -0.5 - 0x1p-40}).sides, 4);
}

TEST(ViewFactorTables, AFlatPolygonIsSeenFromBothSidesAndNotEdgeOn) {
  Occluder o;
  for (const dvec3& c : {dvec3(0, 0, 1), dvec3(2, 0, 1), dvec3(2, 1, 1), dvec3(0, 1, 1)}) add(o.vertex, c);
  o.plane = {0, 0, 1, 1, 1e-9};
  o.words = {0, 4, 0, 0, 0};
  for (const double z : {0.0, 3.0}) {
    const dvec3 x(0.25, 0.5, z);
    const auto shown = o.shown_to(x);
    ASSERT_EQ(shown.sides, 4);
    for (const dvec3& y : {dvec3(1, 0.5, 1), dvec3(1.99, 0.01, 1), dvec3(2.01, 0.5, 1), dvec3(1, -0.01, 1)}) {
      bool within = true;
      for (const dvec3& h : shown.inward) within &= glm::dot(h, y - x) > 0;
      EXPECT_EQ(within, y.x < 2 && y.y > 0) << y.x << ' ' << y.y << " from z = " << z;
    }
  }
  EXPECT_EQ(o.shown_to({5, 5, 1 + 1e-10}).sides, -1);
  EXPECT_EQ(o.shown_to({5, 5, 1 + 1e-8}).sides, 4);
}

TEST(ViewFactorTables, PointsOfAQuad) {
  const double quad[] = {0, 0, 0, 2, 0, 0, 2, 1, 4, 0, 1, 0};
  const auto at = [&](double u, double v) {
    const auto p = kernel64::quad_point(quad, u, v);
    return dvec3(p.x, p.y, p.z);
  };
  EXPECT_EQ(at(0, 0), dvec3(0, 0, 0));
  EXPECT_EQ(at(1, 0), dvec3(2, 0, 0));
  EXPECT_EQ(at(1, 1), dvec3(2, 1, 4));
  EXPECT_EQ(at(0.5, 0.5), dvec3(1, 0.5, 1));
}

}  // namespace
}  // namespace clrad
