// The structs of kernels/shared/types.h as the host sees them; kernels/device/layout.cl says what the device
// sees.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "clrad/device.hpp"
#include "shared/types.h"

namespace clrad {

static_assert(sizeof(clrad_point_float) == 48 && offsetof(clrad_point_float, nx) == 24 &&
              offsetof(clrad_point_float, plane) == 36);
static_assert(sizeof(clrad_point_double) == 88 && offsetof(clrad_point_double, nx) == 48 &&
              offsetof(clrad_point_double, plane) == 72);
static_assert(sizeof(clrad_triangle) == 80 && offsetof(clrad_triangle, x0_lo) == 36 &&
              offsetof(clrad_triangle, plane) == 72);

/// Sizes and offsets in the order in which kernels/device/layout.cl writes them.
inline std::vector<std::uint32_t> host_layout(bool fp64) {
  std::vector<std::uint32_t> v{sizeof(clrad_point_float),          offsetof(clrad_point_float, nx),
                               offsetof(clrad_point_float, plane), sizeof(clrad_triangle),
                               offsetof(clrad_triangle, x0_lo),    offsetof(clrad_triangle, plane)};
  if (fp64) {
    v.push_back(sizeof(clrad_point_double));
    v.push_back(offsetof(clrad_point_double, nx));
    v.push_back(offsetof(clrad_point_double, plane));
  }
  return v;
}

}  // namespace clrad
