/// The visibility grid on the host: the same rule as kernels/shared/segment.cl, in integers of 2^-38 of the
/// frame.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>

namespace clrad {

inline constexpr double grid_steps = 0x1p38;  ///< grid steps per unit of the frame
inline constexpr double grid_range = 4.0;  ///< largest |coordinate| [frame] that the exact predicate can take

using GridPoint = std::array<std::int64_t, 3>;  ///< a position in grid steps

/// The nearest grid step of a coordinate that was split into hi = (float)x and lo = (float)(x - hi).
inline std::int64_t snap(float hi, float lo) {
  const float h = hi * 0x1p38f, l = lo * 0x1p38f;
  const float h_whole = std::rint(h), l_whole = std::rint(l);
  return static_cast<std::int64_t>(h_whole) + static_cast<std::int64_t>(l_whole) +
         static_cast<std::int64_t>(std::rint((h - h_whole) + (l - l_whole)));
}

inline std::int64_t snap(double x) {
  const float hi = static_cast<float>(x);
  return snap(hi, static_cast<float>(x - static_cast<double>(hi)));
}

inline GridPoint snap(const glm::dvec3& p) {
  return {snap(p.x), snap(p.y), snap(p.z)};
}

/// Where a grid point is in the frame. Exact.
inline glm::dvec3 unsnap(const GridPoint& p) {
  return {static_cast<double>(p[0]) / grid_steps, static_cast<double>(p[1]) / grid_steps,
          static_cast<double>(p[2]) / grid_steps};
}

/// A grid coordinate as a pair of floats in the frame, hi + lo exact.
struct FloatPair {
  float hi, lo;
};
inline FloatPair split(std::int64_t steps) {
  const float hi = static_cast<float>(steps);
  return {hi * 0x1p-38f, static_cast<float>(steps - static_cast<std::int64_t>(hi)) * 0x1p-38f};
}

/// Throws UsageError, naming `what`, unless every coordinate is finite and within +-4 of the frame.
void check_range(const glm::dvec3& p, const char* what);

}  // namespace clrad
