/// The frame in which kernels work: the scene centred and scaled by a power of two, so that single precision
/// is spent on the scene and not on where it stands.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include "clrad/scene.hpp"

namespace clrad {

/// frame = (world - centre) x 2^-exponent. Scaling is exact; the subtraction is exact wherever the file's
/// coordinates are not finer than 2^-53 of the extent, so a scene moved by a representable distance keeps its
/// frame coordinates.
struct Frame {
  glm::dvec3 centre{0, 0, 0};  ///< middle of the bounding box [m]
  int exponent = 0;            ///< one frame unit is 2^exponent metres

  double scale() const { return std::ldexp(1.0, -exponent); }  ///< frame units per metre
  double metres() const { return std::ldexp(1.0, exponent); }  ///< metres per frame unit
  glm::dvec3 to_frame(const glm::dvec3& world_m) const { return (world_m - centre) * scale(); }
  glm::dvec3 from_frame(const glm::dvec3& frame) const { return frame * metres() + centre; }
};

/// The frame of a scene with at least one polygon: longest side of the bounding box in [1, 2), coordinates in
/// [-1, 1).
inline Frame frame_of(const Scene& scene) {
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-std::numeric_limits<double>::infinity());
  for (const Polygon& polygon : scene.polygons) {
    for (std::uint32_t i = 0; i < polygon.corners; ++i) {
      low = glm::min(low, polygon.corner[i]);
      high = glm::max(high, polygon.corner[i]);
    }
  }
  Frame frame;
  const glm::dvec3 size = high - low;
  const double extent = std::max({size.x, size.y, size.z});
  if (!(extent > 0) || !std::isfinite(extent)) return frame;
  frame.centre = low + 0.5 * size;
  std::frexp(extent, &frame.exponent);
  frame.exponent -= 1;
  // Far from the origin the rounding of the middle itself can push one side to exactly 1.
  const glm::dvec3 reach = glm::max(high - frame.centre, frame.centre - low) * frame.scale();
  if (std::max({reach.x, reach.y, reach.z}) >= 1.0) frame.exponent += 1;
  return frame;
}

}  // namespace clrad
