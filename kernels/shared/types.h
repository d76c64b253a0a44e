/* The few structs that the host and the kernels both read: scalars only, no padding left to the compiler.
 * The host asserts sizes and offsets (host/device/layout.hpp); kernels/device/layout.cl reports what the device's
 * compiler made of them, and the first test compares the two. */
#ifndef CLRAD_TYPES_H
#define CLRAD_TYPES_H

#ifdef __OPENCL_VERSION__
typedef uint clrad_uint;
#else
#include <cstdint>
typedef std::uint32_t clrad_uint;
#endif

/* A receiver, a sample on a shooter, a sensor, the end of a ray: a position in the scene's frame as an unevaluated
 * sum hi + lo (48 bits in float), a unit normal, the plane its segments ignore and the surface it
 * lies on (polygon index; CLRAD_NONE for a free point). */
#define CLRAD_POINT(name, real)  \
  typedef struct name {          \
    real x, y, z;                \
    real x_lo, y_lo, z_lo;       \
    real nx, ny, nz;             \
    clrad_uint plane, surface, spare; \
  } name

CLRAD_POINT(clrad_point_float, float);
#if !defined(__OPENCL_VERSION__) || defined(CLRAD_FP64)
typedef struct clrad_point_double {
  double x, y, z;
  double x_lo, y_lo, z_lo;
  double nx, ny, nz;
  clrad_uint plane, surface, spare, spare_2;
} clrad_point_double;
#endif

/* An occluder: a triangle whose corners lie on the visibility grid (multiples of 2^-38 of the frame); hi + lo is exact. */
typedef struct clrad_triangle {
  float x0, y0, z0, x1, y1, z1, x2, y2, z2;
  float x0_lo, y0_lo, z0_lo, x1_lo, y1_lo, z1_lo, x2_lo, y2_lo, z2_lo;
  clrad_uint plane, polygon;
} clrad_triangle;

/* What the fast test (shared/triangle.cl) needs of an occluder besides its corners; edge i goes from corner i to corner
 * i + 1. Every component is the exact value rounded once to float: relative error at most 2^-24 each. */
typedef struct clrad_facet {
  float e0x, e0y, e0z, e1x, e1y, e1z, e2x, e2y, e2z;
  float nx, ny, nz;  /* edge 0 x edge 1, not normalised: points to the front */
  float edge_size;   /* an upper bound of the 1-norm of each edge */
  float normal_size; /* the largest |component| of the normal */
  clrad_uint spare_0, spare_1;
} clrad_facet;

#define CLRAD_NONE 0xffffffffu

#endif
