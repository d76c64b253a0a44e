/* A batch's rays as pairs of ends that are snapped once and shared by many rays. */
#ifndef CLRAD_ENDS_CL
#define CLRAD_ENDS_CL
#include "shared/segment.cl"
#include "shared/triangle.cl"

/* A ray is two ends on the visibility grid: ray r of a batch goes from end r / run of `from` to end r % run
 * of `to`, or, in pairs, from end r to end r. An end: x y z and their low parts as float bits, plane, spare. */
#define END_WORDS 8

typedef struct ray_ends {
  __global const uint *a, *b;
} ray_ends;

static inline ray_ends ends_of(__global const uint* from, __global const uint* to, uint run, uint pairs,
                               uint r) {
  /* r / run without an integer division, which has no vector form: r < 2^24, so the guess is off by one at
   * most. */
  uint q = convert_uint(convert_float(r) / convert_float(run));
  q -= q * run > r ? 1u : 0u;
  q += (q + 1u) * run <= r ? 1u : 0u;
  ray_ends e;
  e.a = from + (pairs ? r : q) * END_WORDS;
  e.b = to + (pairs ? r : r - q * run) * END_WORDS;
  return e;
}

static inline float ray_origin(ray_ends e, uint axis) {
  return as_float(e.a[axis]);
}
static inline float ray_direction(ray_ends e, uint axis) {
  return CLRAD_DIFFERENCE(as_float(e.b[axis]), as_float(e.b[3 + axis]), as_float(e.a[axis]),
                          as_float(e.a[3 + axis]));
}

static inline clrad_segment whole_segment(ray_ends e) {
  clrad_segment s;
  s.ax = as_float(e.a[0]);
  s.ay = as_float(e.a[1]);
  s.az = as_float(e.a[2]);
  s.ax_lo = as_float(e.a[3]);
  s.ay_lo = as_float(e.a[4]);
  s.az_lo = as_float(e.a[5]);
  s.bx = as_float(e.b[0]);
  s.by = as_float(e.b[1]);
  s.bz = as_float(e.b[2]);
  s.bx_lo = as_float(e.b[3]);
  s.by_lo = as_float(e.b[4]);
  s.bz_lo = as_float(e.b[5]);
  s.a_plane = e.a[6];
  s.b_plane = e.b[6];
  return s;
}

#endif
