#include "viewfactors/shaft.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <numeric>

namespace clrad {
namespace {

constexpr std::uint32_t leaf_size = 4;
// Frame units, where coordinates are below 2: a box keeps what a plane may have been turned or moved by.
constexpr double box_rounding = 1e-14, side_rounding = 1e-12;

}  // namespace

BoxTree::BoxTree(const SurfaceList& surfaces) {
  for (const Surface& s : surfaces.surface) {
    const glm::dvec3 at = surfaces.frame.to_frame(s.anchor_m);
    Box box{glm::dvec3(std::numeric_limits<double>::infinity()),
            glm::dvec3(-std::numeric_limits<double>::infinity())};
    for (const glm::dvec3& c : s.corner)
      box.low = glm::min(box.low, at + c), box.high = glm::max(box.high, at + c);
    boxes_.push_back({box.low - box_rounding, box.high + box_rounding});
  }
  order_.resize(boxes_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (boxes_.empty()) return;
  nodes_.emplace_back();
  build(0, 0, std::uint32_t(order_.size()));
}

void BoxTree::build(std::uint32_t node, std::uint32_t first, std::uint32_t count) {
  Box box = boxes_[order_[first]];
  for (std::uint32_t i = first; i < first + count; ++i) {
    box.low = glm::min(box.low, boxes_[order_[i]].low);
    box.high = glm::max(box.high, boxes_[order_[i]].high);
  }
  nodes_[node] = {box, first, count};
  if (count <= leaf_size) return;
  const glm::dvec3 size = box.high - box.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t half = count / 2;
  std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double x = boxes_[a].low[axis] + boxes_[a].high[axis],
                                  y = boxes_[b].low[axis] + boxes_[b].high[axis];
                     return x != y ? x < y : a < b;
                   });
  const auto children = std::uint32_t(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node] = {box, children, 0};
  build(children, first, half);
  build(children + 1, first + half, count - half);
}

std::vector<std::uint32_t> BoxTree::near(std::uint32_t a, std::uint32_t b, const Shaft& shaft,
                                         const glm::dvec3& origin) const {
  const glm::dvec3 low = glm::min(boxes_[a].low, boxes_[b].low),
                   high = glm::max(boxes_[a].high, boxes_[b].high);
  struct Side {
    glm::dvec3 normal;
    double offset;
  };
  std::vector<Side> sides;
  for (const Shaft::Plane& p : shaft.planes())
    sides.push_back({p.normal, glm::dot(p.normal, p.point + origin) + side_rounding});
  const auto meets = [&](const Box& box) {
    if (!glm::all(glm::lessThanEqual(box.low, high)) || !glm::all(glm::greaterThanEqual(box.high, low)))
      return false;
    for (const Side& s : sides) {
      const glm::dvec3 innermost(s.normal.x > 0 ? box.low.x : box.high.x,
                                 s.normal.y > 0 ? box.low.y : box.high.y,
                                 s.normal.z > 0 ? box.low.z : box.high.z);
      if (glm::dot(s.normal, innermost) > s.offset) return false;
    }
    return true;
  };
  std::vector<std::uint32_t> open{0}, found;
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!meets(node.box)) continue;
    if (node.count == 0) {
      open.push_back(node.first + 1);
      open.push_back(node.first);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (order_[i] != a && order_[i] != b && meets(boxes_[order_[i]])) found.push_back(order_[i]);
  }
  std::sort(found.begin(), found.end());
  return found;
}

Shaft::Shaft(const Convex& a, const Convex& b) : a_(a), b_(b) {
  const glm::dvec3 middle = 0.5 * (middle_of(a) + middle_of(b));
  size_ = std::max(reach_of(a, middle), reach_of(b, middle));
  add_planes(a, b);
  add_planes(b, a);
}

void Shaft::add_planes(const Convex& edges, const Convex& corners) {
  const double rounding = 1e-13 * size_;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const glm::dvec3 from = edges[e], along = edges[(e + 1) % edges.size()] - from;
    for (const glm::dvec3& c : corners) {
      glm::dvec3 normal = glm::cross(along, c - from);
      const double length = glm::length(normal);
      if (!(length > 1e-9 * glm::length(along) * size_)) continue;  // no well-defined plane
      normal /= length;
      double lowest = 0, highest = 0;
      for (const Convex* polygon : {&a_, &b_})
        for (const glm::dvec3& p : *polygon) {
          const double h = glm::dot(normal, p - from);
          lowest = std::min(lowest, h), highest = std::max(highest, h);
        }
      if (highest <= rounding)
        planes_.push_back({normal, from});
      else if (lowest >= -rounding)
        planes_.push_back({-normal, from});
    }
  }
}

bool Shaft::may_hold(const Convex& polygon, double allowed) const {
  const double tolerance = std::max(allowed, 1e-12 * size_);
  Convex inside = polygon;
  for (const Plane& plane : planes_) {
    // The hull is behind its planes.
    inside = cut(inside, heights_over(inside, plane.normal, plane.point), tolerance).back;
    if (inside.empty()) return false;
  }
  return true;
}

}  // namespace clrad
