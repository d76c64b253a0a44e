// Planar convex polygons on the host: cut by planes, taken from each other.
#pragma once
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace clrad {

/// Corners in order, in one plane; empty: nothing.
using Convex = std::vector<glm::dvec3>;

struct Halves {
  Convex front, back;
};

/// `polygon` cut where `heights` (one a corner, linear over its plane) change sign. A corner within `tolerance` of 0
/// belongs to both parts. A part with no corner beyond the tolerance is empty.
Halves cut(const Convex& polygon, std::span<const double> heights, double tolerance);

/// Heights of its corners over the plane through `point` with normal `normal`.
std::vector<double> heights_over(const Convex& polygon, const glm::dvec3& normal, const glm::dvec3& point);

/// Twice the area, as a vector along the normal by the right-hand rule.
glm::dvec3 twice_area(const Convex& polygon);
double area_of(const Convex& polygon);
glm::dvec3 middle_of(const Convex& polygon);
/// Longest distance of a corner from `point`.
double reach_of(const Convex& polygon, const glm::dvec3& point);

/// `polygon` without `hole`, which lies in the same plane, as convex pieces; `normal` is that plane's. Slivers narrower
/// than `tolerance` are dropped.
std::vector<Convex> without(const Convex& polygon, const Convex& hole, const glm::dvec3& normal,
                            double tolerance);

}  // namespace clrad
