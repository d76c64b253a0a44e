/// The shared kernel arithmetic compiled as C++, once in float and once in double: what the device computes,
/// where a debugger and millions of arguments can reach it. The device's results are compared with it bit by
/// bit.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>

#include "shared/types.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC push_options
#pragma GCC optimize("no-tree-slp-vectorize")

// OpenCL's vectors of sixteen, as far as the kernels' text uses them: lane by lane, each operation rounded once.
namespace kernel_host {
template <class Real>
struct Many {
  Real lane[16];
  template <class Operation>
  static Many each(const Many& a, const Many& b, Operation operation) {
    Many r;
    for (int i = 0; i < 16; ++i) r.lane[i] = operation(a.lane[i], b.lane[i]);
    return r;
  }
  static Many all(Real x) {
    Many r;
    for (Real& y : r.lane) y = x;
    return r;
  }
  friend Many operator+(const Many& a, const Many& b) { return each(a, b, std::plus<Real>()); }
  friend Many operator*(const Many& a, const Many& b) { return each(a, b, std::multiplies<Real>()); }
  friend Many operator/(const Many& a, const Many& b) { return each(a, b, std::divides<Real>()); }
  friend Many operator*(Real a, const Many& b) { return all(a) * b; }
  friend Many operator/(Real a, const Many& b) { return each(all(a), b, std::divides<Real>()); }
  friend Many operator-(Real a, const Many& b) { return each(all(a), b, std::minus<Real>()); }
};
template <class Real>
Many<Real> vload16(std::size_t block, const Real* from) {
  Many<Real> r;
  for (std::size_t i = 0; i < 16; ++i) r.lane[i] = from[16 * block + i];
  return r;
}
template <class Real>
Real clrad_lanes_sum(Many<Real> x) {
  for (int half = 8; half > 0; half /= 2)
    for (int i = 0; i < half; ++i) x.lane[i] += x.lane[i + half];
  return x.lane[0];
}
}  // namespace kernel_host

namespace kernel32 {
using kernel_host::clrad_lanes_sum;
using kernel_host::vload16;
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
using clrad_many = kernel_host::Many<float>;

#include "shared/factor.cl"
#include "viewfactors/tables.cl"
}  // namespace
#undef REAL
#undef CLRAD_POINT_T
}  // namespace kernel32

#undef CLRAD_MATH_CL
#undef CLRAD_FACTOR_CL
#undef CLRAD_VIEWFACTORS_TABLES_CL
#undef CLRAD_R
#undef CLRAD_EPSILON
#undef CLRAD_PAIR_ATAN2_ERROR
#undef CLRAD_SPLIT
#undef CLRAD_PI
#undef CLRAD_GAUSS_BLOCKS
#undef CLRAD_FACTOR_TOLERANCE

namespace kernel64 {
using kernel_host::clrad_lanes_sum;
using kernel_host::vload16;
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
using clrad_many = kernel_host::Many<double>;

#include "shared/factor.cl"
#include "viewfactors/tables.cl"
}  // namespace
#undef REAL
#undef CLRAD_POINT_T
#undef CLRAD_FP64
#undef __global
#undef __constant
}  // namespace kernel64
#pragma GCC pop_options
#pragma GCC diagnostic pop
