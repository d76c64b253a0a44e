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

/* The nearest grid step of hi + lo. The whole parts are taken apart from hi and lo exactly; only the sum of the two
 * fractions is rounded. */
static inline long clrad_snap(float hi, float lo) {
  float h = hi * CLRAD_GRID_STEPS, l = lo * CLRAD_GRID_STEPS;
  float h_whole = rint(h), l_whole = rint(l);
  return convert_long(h_whole) + convert_long(l_whole) + convert_long(rint((h - h_whole) + (l - l_whole)));
}

/* Splits a grid coordinate into hi + lo, exactly: hi is the nearest float, lo the rest (at most 2^16 steps). */
static inline float clrad_grid_hi(long steps) { return convert_float(steps) * CLRAD_GRID_STEP; }
static inline float clrad_grid_lo(long steps) {
  return convert_float(steps - convert_long(convert_float(steps))) * CLRAD_GRID_STEP;
}

/* The grid coordinates of a snapped position hi + lo. */
static inline clrad_grid_point clrad_grid_position(float x, float y, float z, float x_lo, float y_lo, float z_lo) {
  clrad_grid_point p;
  p.x = convert_long(x * CLRAD_GRID_STEPS) + convert_long(x_lo * CLRAD_GRID_STEPS);
  p.y = convert_long(y * CLRAD_GRID_STEPS) + convert_long(y_lo * CLRAD_GRID_STEPS);
  p.z = convert_long(z * CLRAD_GRID_STEPS) + convert_long(z_lo * CLRAD_GRID_STEPS);
  return p;
}

static inline clrad_grid_point clrad_snap_point(__global const CLRAD_POINT_T* p) {
  clrad_grid_point g;
#ifdef CLRAD_FP64
  float x = (float)p->x, y = (float)p->y, z = (float)p->z;
  g.x = clrad_snap(x, (float)((p->x - x) + p->x_lo));
  g.y = clrad_snap(y, (float)((p->y - y) + p->y_lo));
  g.z = clrad_snap(z, (float)((p->z - z) + p->z_lo));
#else
  g.x = clrad_snap(p->x, p->x_lo);
  g.y = clrad_snap(p->y, p->y_lo);
  g.z = clrad_snap(p->z, p->z_lo);
#endif
  return g;
}

/* Segment r of `Segments` (clrad/visibility.hpp): with samples > 0, chosen origin r / samples and target r % samples;
 * with samples == 0, chosen origin r and the target of the same index. The chosen origins are active[0], active[1], ...
 * or, when use_active is 0, all of them in order (`active` is then not read). */
static inline uint clrad_segment_origin(__global const uint* active, uint use_active, uint samples, ulong r) {
  uint chosen = (uint)(samples ? r / samples : r);
  return use_active ? active[chosen] : chosen;
}

static inline clrad_segment clrad_make_segment(__global const CLRAD_POINT_T* origin, __global const CLRAD_POINT_T* target) {
  clrad_grid_point a = clrad_snap_point(origin), b = clrad_snap_point(target);
  clrad_segment s;
  s.ax = clrad_grid_hi(a.x);
  s.ay = clrad_grid_hi(a.y);
  s.az = clrad_grid_hi(a.z);
  s.ax_lo = clrad_grid_lo(a.x);
  s.ay_lo = clrad_grid_lo(a.y);
  s.az_lo = clrad_grid_lo(a.z);
  s.bx = clrad_grid_hi(b.x);
  s.by = clrad_grid_hi(b.y);
  s.bz = clrad_grid_hi(b.z);
  s.bx_lo = clrad_grid_lo(b.x);
  s.by_lo = clrad_grid_lo(b.y);
  s.bz_lo = clrad_grid_lo(b.z);
  s.a_plane = origin->plane;
  s.b_plane = target->plane;
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
