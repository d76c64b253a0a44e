/// The oracle of visibility: does a triangle block a segment, in integers and rationals of unlimited size, by
/// another way than the kernels': it finds the point where the line meets the plane and asks whether it is in
/// the triangle; in the plane it clips the segment by the triangle's three half-planes.
#pragma once
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <span>

#include "visibility/snap.hpp"

namespace clrad::oracle {

using Integer = boost::multiprecision::cpp_int;
using Rational = boost::multiprecision::cpp_rational;
using Vector = std::array<Integer, 3>;

inline Vector vector(const GridPoint& p) {
  return {Integer(p[0]), Integer(p[1]), Integer(p[2])};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vector scaled(const Vector& a, const Integer& s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
inline Vector plus(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Integer dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Triangle {
  GridPoint corner[3];
  std::uint32_t plane = 0xffffffffu;
};
struct Segment {
  GridPoint from, to;
  std::uint32_t from_plane = 0xffffffffu, to_plane = 0xffffffffu;
};

inline Vector normal(const Triangle& t) {
  return cross(vector(t.corner[1]) - vector(t.corner[0]), vector(t.corner[2]) - vector(t.corner[0]));
}
inline bool has_area(const Triangle& t) {
  return normal(t) != Vector{0, 0, 0};
}

/// The exact predicate and its end-point rule.
inline bool blocked(const Segment& s, const Triangle& t) {
  constexpr std::uint32_t none = 0xffffffffu;
  if (t.plane != none && (t.plane == s.from_plane || t.plane == s.to_plane)) return false;
  if (s.from == s.to) return false;
  const Vector n = normal(t), a = vector(s.from), b = vector(s.to);
  const std::array<Vector, 3> v{vector(t.corner[0]), vector(t.corner[1]), vector(t.corner[2])};
  const Integer side_a = dot(n, a - v[0]), side_b = dot(n, b - v[0]);

  // Inward normal of edge i in the plane of the triangle, and how far inside a point is.
  const auto inside = [&](std::size_t i, const Vector& p) -> Integer {
    return dot(cross(n, v[(i + 1) % 3] - v[i]), p - v[i]);
  };
  if (side_a == 0 && side_b == 0) {
    // The parameters of the line inside the closed triangle: [low, high]. The open segment is (0, 1).
    bool bounded_low = false, bounded_high = false;
    Rational low, high;
    for (std::size_t i = 0; i < 3; ++i) {
      const Integer at_a = inside(i, a), slope = inside(i, b) - at_a;
      if (slope == 0) {
        if (at_a < 0) return false;
        continue;
      }
      const Rational where = Rational(-at_a) / Rational(slope);
      if (slope > 0) {
        low = bounded_low ? std::max(low, where) : where;
        bounded_low = true;
      } else {
        high = bounded_high ? std::min(high, where) : where;
        bounded_high = true;
      }
    }
    // A triangle is bounded, so both ends are.
    return low <= high && low < 1 && high > 0;
  }
  if ((side_a < 0) == (side_b < 0)) return false;
  // The point a + (b - a) side_a / (side_a - side_b), times w > 0.
  Integer w = side_a - side_b, along = side_a;
  if (w < 0) w = -w, along = -along;
  const Vector p = plus(scaled(a, w), scaled(b - a, along));
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector edge_normal = cross(n, v[(i + 1) % 3] - v[i]);
    if (dot(edge_normal, p - scaled(v[i], w)) < 0) return false;
  }
  return true;
}

inline bool blocked(const Segment& s, std::span<const Triangle> triangles) {
  for (const Triangle& t : triangles)
    if (has_area(t) && blocked(s, t)) return true;
  return false;
}

}  // namespace clrad::oracle
