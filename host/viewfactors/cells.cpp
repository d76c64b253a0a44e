#include "viewfactors/cells.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

// Half a cell against the length over which the integrand varies: Gauss points are then 1.5 such lengths apart.
constexpr double longest_half = 3;
// The same against half the width of a shadow.
constexpr double longest_half_in_shadow = 1.5;

glm::dvec3 at(const Quad& q, double u, double v) {
  return (q[0] * (1 - u) + q[1] * u) * (1 - v) + (q[3] * (1 - u) + q[2] * u) * v;
}

// A cell as a parallelogram: its middle and half its extent along u and v.
struct Extent {
  glm::dvec3 middle, half[2];
};

Extent extent_of(const Quad& quad, const CellPlace& cell) {
  const double wu = std::ldexp(1.0, -int(cell.level_u)), wv = std::ldexp(1.0, -int(cell.level_v));
  const glm::dvec3 a = at(quad, cell.u * wu, cell.v * wv), b = at(quad, (cell.u + 1) * wu, cell.v * wv),
                   c = at(quad, (cell.u + 1) * wu, (cell.v + 1) * wv),
                   d = at(quad, cell.u * wu, (cell.v + 1) * wv);
  return {0.25 * (a + b + c + d), {0.25 * (b + c - a - d), 0.25 * (c + d - a - b)}};
}

// Distance of a segment (or point) from a cell, by minimising over one coordinate after the other: near enough.
double distance(const Extent& cell, const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 middle = 0.5 * (from + to);
  const glm::dvec3 axis[3] = {cell.half[0], cell.half[1], 0.5 * (from - to)};
  double t[3] = {0, 0, 0};
  glm::dvec3 apart = cell.middle - middle;
  for (int sweep = 0; sweep < 8; ++sweep)
    for (int k = 0; k < 3; ++k) {
      const double length2 = glm::dot(axis[k], axis[k]);
      if (!(length2 > 0)) continue;
      const double next = std::clamp(t[k] - glm::dot(axis[k], apart) / length2, -1.0, 1.0);
      apart += axis[k] * (next - t[k]);
      t[k] = next;
    }
  return glm::length(apart);
}

}  // namespace

CellPlace CellPlace::half(bool along_v, std::uint32_t which) const {
  CellPlace child = *this;
  if (along_v)
    child.v = 2 * v + which, child.level_v++;
  else
    child.u = 2 * u + which, child.level_u++;
  return child;
}

std::vector<Quad> quads_of(const Convex& polygon) {
  std::vector<Quad> quads;
  for (std::size_t k = 1; k + 1 < polygon.size(); k += 2)
    quads.push_back({polygon[0], polygon[k], polygon[k + 1], polygon[std::min(k + 2, polygon.size() - 1)]});
  return quads;
}

CellGrading::CellGrading(const PairPart& part, double negligible) : negligible_(negligible) {
  add_edges(part.shooter, part);
  for (const auto& o : part.occluders) {
    add_edges(o.corner, part);
    if (o.shadow.bounded && 4 * o.shadow.half[0] * o.shadow.half[1] > negligible)
      shadows_.push_back(o.shadow);
  }
}

void CellGrading::add_edges(const Convex& polygon, const PairPart& part) {
  const glm::dvec3 n = part.receiver_normal, on = part.receiver[0][0];
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 from = polygon[i], to = polygon[(i + 1) % polygon.size()];
    const double height = std::max(glm::dot(n, from - on), glm::dot(n, to - on)),
                 length = glm::distance(from, to);
    // An edge in the receiver's own plane is seen under the same right angle from everywhere; where it ends another begins.
    if (height > 1e-9 * length) edges_.push_back({from, to, std::min(height, length)});
  }
}

void CellGrading::grade(const Quad& quad, std::vector<CellPlace>& cells) const {
  struct Open {
    CellPlace cell;
    std::vector<std::uint32_t> edges, shadows;  // that still mattered to the parent
  };
  std::vector<Open> open(1);
  for (std::uint32_t i = 0; i < edges_.size(); ++i) open[0].edges.push_back(i);
  for (std::uint32_t i = 0; i < shadows_.size(); ++i) open[0].shadows.push_back(i);
  while (!open.empty()) {
    Open now = std::move(open.back());
    open.pop_back();
    const Extent cell = extent_of(quad, now.cell);
    double excess[2] = {1, 1};  // of each side over what is allowed; above 1: too long
    std::vector<std::uint32_t> edges, shadows;
    for (const std::uint32_t i : now.edges) {
      const Edge& e = edges_[i];
      const double size = glm::length(cell.half[0]) + glm::length(cell.half[1]);
      const double near = std::max(distance(cell, e.from, e.to), e.scale);
      if (size <= longest_half * near) continue;  // nor will it matter to a part of the cell
      edges.push_back(i);
      const double end =
          std::max(std::min(distance(cell, e.from, e.from), distance(cell, e.to, e.to)), e.scale);
      const glm::dvec3 along = glm::normalize(e.to - e.from);
      for (int k = 0; k < 2; ++k) {
        const glm::dvec3 across = cell.half[k] - along * glm::dot(along, cell.half[k]);
        excess[k] = std::max({excess[k], glm::length(across) / (longest_half * near),
                              glm::length(cell.half[k]) / (longest_half * end)});
      }
    }
    for (const std::uint32_t i : now.shadows) {
      const auto& s = shadows_[i];
      bool meets = true;
      double longest[2] = {0, 0};
      for (int axis = 0; axis < 2; ++axis) {
        const double reach[2] = {std::abs(glm::dot(s.axis[axis], cell.half[0])),
                                 std::abs(glm::dot(s.axis[axis], cell.half[1]))};
        meets &=
            std::abs(glm::dot(s.axis[axis], cell.middle - s.middle)) <= s.half[axis] + reach[0] + reach[1];
        for (int k = 0; k < 2; ++k)
          longest[k] = std::max(longest[k], reach[k] / (longest_half_in_shadow * s.half[axis]));
      }
      if (!meets || std::max(longest[0], longest[1]) <= 0.5) continue;
      shadows.push_back(i);
      for (int k = 0; k < 2; ++k) excess[k] = std::max(excess[k], longest[k]);
    }
    const double area = 4 * glm::length(glm::cross(cell.half[0], cell.half[1]));
    const bool along_v = excess[1] > excess[0];
    const std::uint32_t level = along_v ? now.cell.level_v : now.cell.level_u;
    if (!(std::max(excess[0], excess[1]) > 1) || area < negligible_ || level >= deepest_cell) {
      cells.push_back(now.cell);
      continue;
    }
    for (const std::uint32_t which : {1u, 0u})
      open.push_back({now.cell.half(along_v, which), edges, shadows});
  }
}

}  // namespace clrad
