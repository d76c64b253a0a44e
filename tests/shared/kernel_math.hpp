/// The shared kernel arithmetic compiled as C++, once in float and once in double: what the device computes,
/// where a debugger and millions of arguments can reach it. The device's results are compared with it bit by
/// bit.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>

#include "shared/types.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC push_options
#pragma GCC optimize("no-tree-slp-vectorize")

namespace kernel32 {
using uint = std::uint32_t;
using ulong = std::uint64_t;
using std::sqrt;
inline float as_float(std::uint32_t bits) {
  return std::bit_cast<float>(bits);
}
inline std::uint32_t as_uint(float x) {
  return std::bit_cast<std::uint32_t>(x);
}
#define REAL float
#define CLRAD_POINT_T clrad_point_float
#define __global
#define __constant static const
#define CLRAD_HOST_COMPILED
namespace {
#include "shared/factor.cl"
}
#undef REAL
#undef CLRAD_POINT_T
}  // namespace kernel32

#undef CLRAD_MATH_CL
#undef CLRAD_FACTOR_CL
#undef CLRAD_R
#undef CLRAD_EPSILON
#undef CLRAD_SPLIT
#undef CLRAD_PI
#undef CLRAD_GAUSS
#undef CLRAD_FACTOR_TOLERANCE

namespace kernel64 {
using uint = std::uint32_t;
using ulong = std::uint64_t;
using std::sqrt;
inline double as_double(std::uint64_t bits) {
  return std::bit_cast<double>(bits);
}
inline std::uint64_t as_ulong(double x) {
  return std::bit_cast<std::uint64_t>(x);
}
#define CLRAD_FP64
#define REAL double
#define CLRAD_POINT_T clrad_point_double
namespace {
#include "shared/factor.cl"
}
#undef REAL
#undef CLRAD_POINT_T
#undef CLRAD_FP64
#undef __global
#undef __constant
}  // namespace kernel64
#pragma GCC pop_options
#pragma GCC diagnostic pop
