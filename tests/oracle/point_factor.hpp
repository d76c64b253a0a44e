// The form factor of a point and a polygon by Lambert's contour formula, for clarity alone, in any type of
// number: with long double it has 19 digits to lose by cancellation, with `Quad` 34.
#pragma once
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <glm/vec3.hpp>
#include <vector>

namespace clrad::oracle {

using Quad = boost::multiprecision::cpp_bin_float_quad;

template <class Real>
struct Vec {
  Real x, y, z;
  Vec operator-(const Vec& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec operator+(const Vec& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec operator*(const Real& s) const { return {x * s, y * s, z * s}; }
};
template <class Real>
Real dot(const Vec<Real>& a, const Vec<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
Vec<Real> cross(const Vec<Real>& a, const Vec<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Fraction of the cosine-weighted hemisphere at p about n that the polygon's front covers; 0 in its plane
/// and behind it. Corners counter-clockwise seen from the front; p and n as given, nothing is rounded.
template <class Real>
Real point_factor(const glm::dvec3& p, const glm::dvec3& n, const std::vector<glm::dvec3>& polygon) {
  using std::atan2, std::sqrt;
  using V = Vec<Real>;
  const V normal{Real(n.x), Real(n.y), Real(n.z)}, origin{Real(p.x), Real(p.y), Real(p.z)};
  std::vector<V> corner, above;
  for (const auto& c : polygon) corner.push_back(V{Real(c.x), Real(c.y), Real(c.z)} - origin);
  const std::size_t count = corner.size();
  V front{0, 0, 0};
  for (std::size_t k = 0; k < count; ++k) front = front + cross(corner[k], corner[(k + 1) % count]);
  if (!(dot(front, corner[0]) < 0)) return 0;
  for (std::size_t k = 0; k < count; ++k) {
    const V &a = corner[k], &b = corner[(k + 1) % count];
    const Real ha = dot(normal, a), hb = dot(normal, b);
    if (ha >= 0) above.push_back(a);
    if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) above.push_back(a + (b - a) * Real(ha / (ha - hb)));
  }
  Real sum = 0;
  for (std::size_t k = 0; k < above.size(); ++k) {
    const V &a = above[k], &b = above[(k + 1) % above.size()];
    const V c = cross(b, a);
    const Real length = sqrt(dot(c, c));
    if (length > 0) sum += Real(atan2(length, dot(a, b))) * dot(normal, c) / length;
  }
  return sum / (2 * Real(atan2(Real(0), Real(-1))));
}

}  // namespace clrad::oracle
