#include "viewfactors/convex.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace clrad {

Halves cut(const Convex& polygon, std::span<const double> heights, double tolerance) {
  Halves halves;
  bool above = false, below = false;
  for (const double h : heights) above |= h > tolerance, below |= h < -tolerance;
  if (!above || !below) {
    if (above) halves.front = polygon;
    if (below) halves.back = polygon;
    return halves;
  }
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    const double a = heights[i], b = heights[next];
    if (a >= -tolerance) halves.front.push_back(polygon[i]);
    if (a <= tolerance) halves.back.push_back(polygon[i]);
    if ((a > tolerance && b < -tolerance) || (a < -tolerance && b > tolerance)) {
      const glm::dvec3 x = polygon[i] + (polygon[next] - polygon[i]) * (a / (a - b));
      halves.front.push_back(x);
      halves.back.push_back(x);
    }
  }
  if (halves.front.size() < 3) halves.front.clear();
  if (halves.back.size() < 3) halves.back.clear();
  return halves;
}

std::vector<double> heights_over(const Convex& polygon, const glm::dvec3& normal, const glm::dvec3& point) {
  std::vector<double> heights;
  heights.reserve(polygon.size());
  for (const glm::dvec3& c : polygon) heights.push_back(glm::dot(normal, c - point));
  return heights;
}

glm::dvec3 twice_area(const Convex& polygon) {
  glm::dvec3 sum(0);
  for (std::size_t i = 2; i < polygon.size(); ++i)
    sum += glm::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  return sum;
}

double area_of(const Convex& polygon) {
  return 0.5 * glm::length(twice_area(polygon));
}

glm::dvec3 middle_of(const Convex& polygon) {
  glm::dvec3 sum(0);
  for (const glm::dvec3& c : polygon) sum += c;
  return sum / double(polygon.size());
}

double reach_of(const Convex& polygon, const glm::dvec3& point) {
  double reach = 0;
  for (const glm::dvec3& c : polygon) reach = std::max(reach, glm::distance(c, point));
  return reach;
}

std::vector<Convex> without(const Convex& polygon, const Convex& hole, const glm::dvec3& normal,
                            double tolerance) {
  std::vector<Convex> pieces;
  Convex rest = polygon;
  const double turn = glm::dot(twice_area(hole), normal) < 0 ? -1 : 1;
  for (std::size_t i = 0; i < hole.size() && !rest.empty(); ++i) {
    const glm::dvec3 side = hole[(i + 1) % hole.size()] - hole[i];
    const glm::dvec3 inward = glm::cross(normal, side) * turn;
    const double length = glm::length(inward);
    if (!(length > 0)) continue;
    Halves halves = cut(rest, heights_over(rest, inward / length, hole[i]), tolerance);
    if (!halves.back.empty()) pieces.push_back(std::move(halves.back));
    rest = std::move(halves.front);
  }
  // They only touch: nothing was taken away.
  if (rest.empty()) return {polygon};
  return pieces;
}

}  // namespace clrad
