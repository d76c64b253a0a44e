/* Segments between points: which two points segment r joins, and their place on the visibility grid.
 *
 * A coordinate is snapped to the nearest multiple of 2^-38 of the frame; host/visibility/snap.hpp is the same rule for
 * the host. Points of double precision are first split into a pair of floats, so that all precisions snap alike.
 */
#ifndef CLRAD_SEGMENT_CL
#define CLRAD_SEGMENT_CL

#define CLRAD_GRID_STEPS 0x1p38f /* grid steps per unit of the frame */
#define CLRAD_GRID_STEP 0x1p-38f

/* A position on the grid, in steps: |coordinate| <= 2^40. */
typedef struct clrad_grid_point {
  long x, y, z;
} clrad_grid_point;

/* A segment with both ends snapped; hi + lo is exact, |lo| at most half an ulp of hi. 14 words. */
typedef struct clrad_segment {
  float ax, ay, az, ax_lo, ay_lo, az_lo;
  float bx, by, bz, bx_lo, by_lo, bz_lo;
  uint a_plane, b_plane;
} clrad_segment;

/* rint without a branch or a call, which some devices make of it: beyond 2^23 every float is whole, below it adding 2^23 rounds. */
static inline float clrad_rint(float x) {
  const float large = x < 0.0f ? -0x1p23f : 0x1p23f;
  return fabs(x) < 0x1p23f ? (x + large) - large : x;
}

/* The nearest grid step of hi + lo, |lo| <= 2^24 steps, again as such a pair: the nearest float to it and the rest (at most 2^16
 * steps), which is what converting the whole number of steps to float and subtracting would give. In floats throughout, and
 * without a branch: the whole parts are taken apart from hi and lo exactly, only the sum of the two fractions is rounded, and the
 * last four lines are Knuth's sum of two floats with its error. */
static inline void clrad_snap(float hi, float lo, float* snapped, float* snapped_lo) {
  const float h = hi * CLRAD_GRID_STEPS, l = lo * CLRAD_GRID_STEPS;
  const float h_whole = clrad_rint(h), l_whole = clrad_rint(l);
  const float rest = l_whole + clrad_rint((h - h_whole) + (l - l_whole));
  const float sum = h_whole + rest, part = sum - h_whole;
  const float error = (h_whole - (sum - part)) + (rest - part);
  *snapped = sum * CLRAD_GRID_STEP;
  *snapped_lo = error * CLRAD_GRID_STEP;
}

/* The grid coordinates of a snapped position hi + lo. */
static inline clrad_grid_point clrad_grid_position(float x, float y, float z, float x_lo, float y_lo, float z_lo) {
  clrad_grid_point p;
  p.x = convert_long(x * CLRAD_GRID_STEPS) + convert_long(x_lo * CLRAD_GRID_STEPS);
  p.y = convert_long(y * CLRAD_GRID_STEPS) + convert_long(y_lo * CLRAD_GRID_STEPS);
  p.z = convert_long(z * CLRAD_GRID_STEPS) + convert_long(z_lo * CLRAD_GRID_STEPS);
  return p;
}

/* One end of a segment: a point snapped. */
typedef struct clrad_end {
  float x, y, z, x_lo, y_lo, z_lo;
  uint plane;
} clrad_end;

/* A point's coordinates as pairs of floats. */
static inline void clrad_split_point(__global const CLRAD_POINT_T* p, float* x, float* y, float* z, float* x_lo, float* y_lo,
                                     float* z_lo) {
  *x = (float)p->x;
  *y = (float)p->y;
  *z = (float)p->z;
#ifdef CLRAD_FP64
  *x_lo = (float)((p->x - *x) + p->x_lo);
  *y_lo = (float)((p->y - *y) + p->y_lo);
  *z_lo = (float)((p->z - *z) + p->z_lo);
#else
  *x_lo = p->x_lo;
  *y_lo = p->y_lo;
  *z_lo = p->z_lo;
#endif
}

static inline clrad_end clrad_snap_point(__global const CLRAD_POINT_T* p) {
  clrad_end e;
  float x, y, z, x_lo, y_lo, z_lo;
  clrad_split_point(p, &x, &y, &z, &x_lo, &y_lo, &z_lo);
  clrad_snap(x, x_lo, &e.x, &e.x_lo);
  clrad_snap(y, y_lo, &e.y, &e.y_lo);
  clrad_snap(z, z_lo, &e.z, &e.z_lo);
  e.plane = p->plane;
  return e;
}

/* Segment r of `Segments` (clrad/visibility.hpp): with samples > 0, chosen origin r / samples and target r % samples;
 * with samples == 0, chosen origin r and the target of the same index. The chosen origins are active[0], active[1], ...
 * or, when use_active is 0, all of them in order (`active` is then not read). */
static inline uint clrad_segment_origin(__global const uint* active, uint use_active, uint samples, ulong r) {
  uint chosen = (uint)(samples ? r / samples : r);
  return use_active ? active[chosen] : chosen;
}

static inline clrad_segment clrad_make_segment(__global const CLRAD_POINT_T* origin, __global const CLRAD_POINT_T* target) {
  const clrad_end a = clrad_snap_point(origin), b = clrad_snap_point(target);
  const clrad_segment s = {a.x,    a.y,    a.z,    a.x_lo, a.y_lo,  a.z_lo, b.x,
                           b.y,    b.z,    b.x_lo, b.y_lo, b.z_lo, a.plane, b.plane};
  return s;
}

static inline clrad_segment clrad_fetch_segment(__global const CLRAD_POINT_T* origins, __global const uint* active,
                                         uint use_active, __global const CLRAD_POINT_T* targets, uint samples, ulong r) {
  uint origin = clrad_segment_origin(active, use_active, samples, r);
  return clrad_make_segment(origins + origin, targets + (samples ? (uint)(r % samples) : origin));
}

/* A segment ignores the occluders in the planes of its two ends. CLRAD_NONE is no plane. */
static inline int clrad_ignores(clrad_segment s, uint plane) {
  return plane != CLRAD_NONE && (plane == s.a_plane || plane == s.b_plane);
}

#endif
