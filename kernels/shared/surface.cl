/* Where a ray meets the plane of a polygon, in the polygon's own coordinates, and back.
 *
 * Each polygon has a frame of its own: origin corner 0, axes e1 = c1 - c0 and e2 = c3 - c0 (triangle: c2 - c0). The dual
 * vectors give a point's coordinates (a, b) in it. The opposite corner of a quad is (1 + p, 1 + q), so the bilinear map is
 *     a = u (1 + p v),   b = v (1 + q u).
 * Its inverse solves p v^2 + (1 + q a - p b) v - b = 0; inside a convex quad the root belonging to it is
 *     v = 2 b / (h + sqrt(h^2 + 4 p b)),  h = 1 + q a - p b,   u = a / (1 + p v),
 * where the denominator is 2 (1 + q u) > 0 and the square root is the map's Jacobian: no case distinction is needed, and
 * p = q = 0 gives v = b, u = a. */
#ifndef CLRAD_SURFACE_CL
#define CLRAD_SURFACE_CL
#include "shared/math.cl"

/* The table of a polygon, as host/render/surfaces.cpp makes it: corner 0 hi, lo, normal, dual of e1, dual of e2 (three
 * reals each), p, q, 1 for a quad, 0 for a triangle, and 1 where the next polygon is its back, else 0. */
#define CLRAD_POLYGON_REALS 20
/* Its axes, kept apart because only what starts on polygons needs them: e1 hi, lo, e2 hi, lo. */
#define CLRAD_AXES_REALS 12

typedef struct clrad_seen {
  REAL facing; /* direction . normal: negative when the front is seen */
  REAL a, b;
} clrad_seen;

clrad_seen clrad_meet(__global const REAL* polygon, __global const CLRAD_POINT_T* origin,
                      __global const CLRAD_POINT_T* target) {
  const CLRAD_POINT_T o = *origin, t = *target;
  const REAL at_hi[3] = {o.x, o.y, o.z}, at_lo[3] = {o.x_lo, o.y_lo, o.z_lo};
  const REAL direction[3] = {(t.x - o.x) + (t.x_lo - o.x_lo), (t.y - o.y) + (t.y_lo - o.y_lo),
                             (t.z - o.z) + (t.z_lo - o.z_lo)};
  REAL from[3];
  REAL height = 0, facing = 0;
  for (int c = 0; c < 3; ++c) {
    from[c] = (at_hi[c] - polygon[c]) + (at_lo[c] - polygon[3 + c]);
    height += from[c] * polygon[6 + c];
    facing += direction[c] * polygon[6 + c];
  }
  clrad_seen s;
  s.facing = facing, s.a = 0, s.b = 0;
  const REAL along = -height / facing;
  for (int c = 0; c < 3; ++c) {
    const REAL at = from[c] + along * direction[c];
    s.a += at * polygon[9 + c];
    s.b += at * polygon[12 + c];
  }
  return s;
}

/* (u, v) of the bilinear quad or the triangle, not clamped. */
void clrad_parameters(__global const REAL* polygon, clrad_seen s, REAL* u, REAL* v) {
  *u = s.a, *v = s.b;
  if (polygon[17] == (REAL)0) return;
  const REAL p = polygon[15], q = polygon[16];
  const REAL h = (REAL)1 + q * s.a - p * s.b;
  const REAL d = h * h + (REAL)4 * p * s.b;
  *v = (REAL)2 * s.b / (h + sqrt(d > (REAL)0 ? d : (REAL)0));
  *u = s.a / ((REAL)1 + p * *v);
}

/* NaN: not contained. */
int clrad_contains(__global const REAL* polygon, clrad_seen s) {
  REAL u, v;
  clrad_parameters(polygon, s, &u, &v);
  return polygon[17] != (REAL)0 ? u >= (REAL)0 && v >= (REAL)0 && u <= (REAL)1 && v <= (REAL)1
                                : u >= (REAL)0 && v >= (REAL)0 && u + v <= (REAL)1;
}

REAL clrad_unit_clamped(REAL x, REAL high) { return x > (REAL)0 ? (x < high ? x : high) : (REAL)0; /* NaN: 0 */ }

/* corner 0 + a e1 + b e2, one coordinate: on the plane to twice the digits of REAL. */
clrad_pair clrad_on_axis(__global const REAL* polygon, __global const REAL* axes, REAL a, REAL b, int c) {
  clrad_pair corner, e1, e2;
  corner.hi = polygon[c], corner.lo = polygon[3 + c];
  e1.hi = axes[c], e1.lo = axes[3 + c];
  e2.hi = axes[6 + c], e2.lo = axes[9 + c];
  return clrad_pair_add(corner, clrad_pair_add(clrad_pair_times(e1, a), clrad_pair_times(e2, b)));
}

/* The point that was met, as the end of a segment; its normal is the polygon's. Not outside the polygon, whatever the
 * rounding: a ray from a mirror's edge may not begin behind the wall that meets it there. */
CLRAD_POINT_T clrad_point_on(__global const REAL* polygon, __global const REAL* axes, clrad_seen s, uint plane,
                             uint surface) {
  REAL u, v;
  clrad_parameters(polygon, s, &u, &v);
  v = clrad_unit_clamped(v, (REAL)1);
  u = clrad_unit_clamped(u, polygon[17] != (REAL)0 ? (REAL)1 : (REAL)1 - v);
  const REAL a = u * ((REAL)1 + polygon[15] * v), b = v * ((REAL)1 + polygon[16] * u);
  const clrad_pair x = clrad_on_axis(polygon, axes, a, b, 0), y = clrad_on_axis(polygon, axes, a, b, 1),
                   z = clrad_on_axis(polygon, axes, a, b, 2);
  CLRAD_POINT_T p;
  p.x = x.hi, p.y = y.hi, p.z = z.hi;
  p.x_lo = x.lo, p.y_lo = y.lo, p.z_lo = z.lo;
  p.nx = polygon[6], p.ny = polygon[7], p.nz = polygon[8];
  p.plane = plane, p.surface = surface, p.spare = 0;
#ifdef CLRAD_FP64
  p.spare_2 = 0;
#endif
  return p;
}

#endif
