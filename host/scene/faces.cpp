#include "scene/faces.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

using Index = std::uint32_t;
using Corners = std::span<const glm::dvec3>;
using Loop = std::vector<Index>;

double rounding_of(Corners corners) {
  double largest = 0;
  for (const glm::dvec3& c : corners) {
    const glm::dvec3 size = glm::abs(c);
    largest = std::max({largest, size.x, size.y, size.z});
  }
  return 4.0 * 0x1p-52 * largest;
}

// Twice the area vector (Newell), relative to the first corner.
glm::dvec3 area_vector(Corners corners, const Loop& loop) {
  glm::dvec3 sum(0);
  for (std::size_t i = 2; i < loop.size(); ++i) {
    sum += glm::cross(corners[loop[i - 1]] - corners[loop[0]], corners[loop[i]] - corners[loop[0]]);
  }
  return sum;
}

// Cross products of tiny edges underflow; dividing by the longest one first does not.
double distance_to_line(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const double length = glm::distance(a, b);
  return length > 0 ? glm::length(glm::cross(p - a, (b - a) / length)) : glm::distance(p, a);
}

bool on_one_line(Corners corners, const Loop& loop, double rounding) {
  Index a = loop[0], b = loop[0];
  double longest = 0;
  // The corner furthest from the first, then the one furthest from that: within a factor of the diameter, and
  // O(n).
  for (const int pass : {0, 1}) {
    (void)pass;
    a = b;
    longest = 0;
    for (const Index i : loop) {
      const double d = glm::distance(corners[a], corners[i]);
      if (d > longest) longest = d, b = i;
    }
  }
  return std::all_of(loop.begin(), loop.end(), [&](Index i) {
    return distance_to_line(corners[i], corners[a], corners[b]) <= rounding;
  });
}

// Signed height of corner b over the line a-c, seen along `normal`: positive where the loop turns left.
double turn_height(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& normal) {
  const double length = glm::distance(a, c);
  if (!(length > 0)) return -glm::distance(a, b);
  return glm::dot(glm::cross(b - a, (c - b) / length), normal);
}

FacePiece triangle(Index a, Index b, Index c) {
  return {{a, b, c, 0}, 3};
}

// The two triangles on either side of the diagonal from corner `from` to `from + 2`. Diagonal 1-3 starts
// at 1.
void cut_quad(const Loop& q, Index from, std::vector<FacePiece>& pieces) {
  const auto at = [&](Index k) { return q[(from + k) % 4]; };
  pieces.push_back(triangle(at(0), at(1), at(2)));
  pieces.push_back(triangle(at(0), at(2), at(3)));
}

void cut_quad_by_rule(Corners corners, const Loop& q, double rounding, CutFace& cut) {
  const std::array<glm::dvec3, 4> c = {corners[q[0]], corners[q[1]], corners[q[2]], corners[q[3]]};
  const double length = std::max(glm::distance(c[0], c[2]), glm::distance(c[1], c[3]));
  const glm::dvec3 across = length > 0 ? glm::cross((c[2] - c[0]) / length, c[3] - c[1]) : glm::dvec3(0);
  if (!(glm::length(across) > rounding)) {  // not all on one line, yet without area: two halves cancel
    cut.rules.push_back(FaceRule::self_intersecting);
    return;
  }
  const glm::dvec3 normal = glm::normalize(across);
  int reflex = 0;
  int pivot = -1;  // the corner that the cut must start from
  for (int i = 0; i < 4; ++i) {
    const double height = turn_height(c[(i + 3) % 4], c[i], c[(i + 1) % 4], normal);
    if (height < -rounding) ++reflex;
    if (height <= rounding && (pivot < 0 || height < -rounding)) pivot = i;
  }
  if (reflex > 1) {
    cut.rules.push_back(FaceRule::self_intersecting);
    return;
  }
  cut.non_planarity = quad_non_planarity(c);
  if (cut.non_planarity > kPlanarTolerance) cut.rules.push_back(FaceRule::non_planar);
  if (pivot >= 0) cut.rules.push_back(reflex == 1 ? FaceRule::concave : FaceRule::straight_corner);
  if (pivot >= 0) {
    cut_quad(q, pivot % 2 == 0 ? 0 : 1, cut.pieces);
  } else if (cut.non_planarity > kPlanarTolerance) {
    cut_quad(q, 0, cut.pieces);
  } else {
    cut.pieces.push_back({{q[0], q[1], q[2], q[3]}, 4});
  }
}

bool in_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                 const glm::dvec3& normal) {
  const auto left_of = [&](const glm::dvec3& from, const glm::dvec3& to) {
    return glm::dot(glm::cross(to - from, p - from), normal) >= 0;
  };
  return left_of(a, b) && left_of(b, c) && left_of(c, a);
}

double smallest_sine(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double ab = glm::distance(a, b), bc = glm::distance(b, c), ca = glm::distance(c, a);
  const double twice_area = glm::length(glm::cross(b - a, c - a));
  return twice_area * std::min({ab, bc, ca}) / (ab * bc * ca);
}

// Ear clipping: an ear is a corner that turns left and whose triangle holds no other corner; of all ears the
// one with the largest smallest angle goes first, ties to the lower index, never leaving a remainder without
// area.
void clip_ears(Corners corners, Loop loop, double rounding, CutFace& cut) {
  const glm::dvec3 sum = area_vector(corners, loop);
  const double size = glm::length(sum);
  cut.rules.push_back(size > 0 ? FaceRule::many_corners : FaceRule::self_intersecting);
  if (!(size > 0)) return;
  const glm::dvec3 normal = sum / size;
  while (loop.size() > 3) {
    const std::size_t n = loop.size();
    std::size_t best = n;
    double best_shape = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const glm::dvec3 &a = corners[loop[(i + n - 1) % n]], &b = corners[loop[i]],
                       &c = corners[loop[(i + 1) % n]];
      if (turn_height(a, b, c, normal) <= rounding) continue;
      const double shape = smallest_sine(a, b, c);
      if (!(shape > best_shape)) continue;
      const bool empty = std::none_of(loop.begin(), loop.end(), [&](Index k) {
        const glm::dvec3& p = corners[k];
        return p != a && p != b && p != c && in_triangle(p, a, b, c, normal);
      });
      if (!empty) continue;
      Loop rest = loop;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
      if (on_one_line(corners, rest, rounding)) continue;
      best = i;
      best_shape = shape;
    }
    if (best == n) {
      cut.rules = {FaceRule::self_intersecting};
      cut.pieces.clear();
      return;
    }
    cut.pieces.push_back(triangle(loop[(best + n - 1) % n], loop[best], loop[(best + 1) % n]));
    loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (turn_height(corners[loop[0]], corners[loop[1]], corners[loop[2]], normal) <= 0) {
    cut.rules = {FaceRule::self_intersecting};
    cut.pieces.clear();
    return;
  }
  cut.pieces.push_back(triangle(loop[0], loop[1], loop[2]));
}

}  // namespace

double quad_non_planarity(const std::array<glm::dvec3, 4>& c) {
  const double length = std::max(glm::distance(c[0], c[2]), glm::distance(c[1], c[3]));
  if (!(length > 0)) return 0;
  const glm::dvec3 across = glm::cross((c[2] - c[0]) / length, (c[3] - c[1]) / length);
  const double size = glm::length(across);
  return size > 0 ? std::abs(glm::dot((c[1] - c[0]) / length, across / size)) : 0;
}

CutFace cut_face(Corners corners) {
  CutFace cut;
  Loop loop;
  for (Index i = 0; i < corners.size(); ++i) {
    const Index before = i == 0 ? static_cast<Index>(corners.size()) - 1 : i - 1;
    if (corners[i] != corners[before]) loop.push_back(i);
  }
  const double rounding = rounding_of(corners);
  if (loop.size() < 3 || on_one_line(corners, loop, rounding)) {
    cut.rules.push_back(FaceRule::degenerate);
    return cut;
  }
  if (loop.size() < corners.size()) cut.rules.push_back(FaceRule::repeated_corner);
  if (loop.size() == 3) {
    cut.pieces.push_back(triangle(loop[0], loop[1], loop[2]));
  } else if (loop.size() == 4) {
    cut_quad_by_rule(corners, loop, rounding, cut);
  } else {
    clip_ears(corners, loop, rounding, cut);
  }
  return cut;
}

}  // namespace clrad
