/* Blocked or not: the one exact predicate behind every visibility engine.
 *
 * Ends and corners lie on the visibility grid (multiples of 2^-38 of the frame, |coordinate| <= 4), so they are integers
 * of at most 41 bits, their differences have 42 with the sign and |difference| <= 2^41. A product of two is at most
 * 2^82, a component of a normal 2^83, times a difference 2^124, and three of those stay below 2^126: every determinant
 * here fits a signed 128-bit integer, built from 64-bit multiplication. No rounding happens anywhere.
 *
 * A triangle T blocks the segment ab when
 *  - a and b differ, and neither end's plane is T's plane (an end's plane cannot block what starts on it), and
 *  - one end is strictly behind T's plane and the other is not (an end exactly on the plane counts as in front; the
 *    front is the side that sees the corners counter-clockwise), and the line meets the closed triangle: the three
 *    signed volumes of the line and T's edges are all >= 0 or all <= 0, so touching an edge or a corner is a hit and
 *    nothing leaks between triangles that share it; or
 *  - both ends are in T's plane and the open segment meets the closed triangle in it.
 * Swapping a and b flips the sign of all three volumes and nothing else, hence V(a, b) = V(b, a).
 */
#ifndef CLRAD_PREDICATE_CL
#define CLRAD_PREDICATE_CL

#include "shared/segment.cl"

/* A 128-bit two's-complement integer. */
typedef struct clrad_wide {
  ulong lo;
  long hi;
} clrad_wide;

static inline clrad_wide clrad_wide_product(long a, long b) {
  clrad_wide r;
  r.lo = (ulong)a * (ulong)b;
  r.hi = mul_hi(a, b);
  return r;
}

static inline clrad_wide clrad_wide_add(clrad_wide a, clrad_wide b) {
  clrad_wide r;
  r.lo = a.lo + b.lo;
  r.hi = (long)((ulong)a.hi + (ulong)b.hi + (ulong)(r.lo < a.lo));
  return r;
}

static inline clrad_wide clrad_wide_subtract(clrad_wide a, clrad_wide b) {
  clrad_wide r;
  r.lo = a.lo - b.lo;
  r.hi = (long)((ulong)a.hi - (ulong)b.hi - (ulong)(a.lo < b.lo));
  return r;
}

/* a * b modulo 2^128; the caller knows that it fits. */
static inline clrad_wide clrad_wide_times(clrad_wide a, long b) {
  clrad_wide r;
  r.lo = a.lo * (ulong)b;
  r.hi = (long)(mul_hi(a.lo, (ulong)b) - (b < 0 ? a.lo : 0ul) + (ulong)a.hi * (ulong)b);
  return r;
}

static inline int clrad_wide_sign(clrad_wide a) { return a.hi < 0 ? -1 : (a.hi != 0 || a.lo != 0 ? 1 : 0); }

/* a * d - b * c. */
static inline clrad_wide clrad_wide_determinant(long a, long b, long c, long d) {
  return clrad_wide_subtract(clrad_wide_product(a, d), clrad_wide_product(b, c));
}

typedef struct clrad_wide_vector {
  clrad_wide x, y, z;
} clrad_wide_vector;

static inline clrad_grid_point clrad_grid_minus(clrad_grid_point a, clrad_grid_point b) {
  clrad_grid_point r;
  r.x = a.x - b.x;
  r.y = a.y - b.y;
  r.z = a.z - b.z;
  return r;
}

static inline clrad_wide_vector clrad_grid_cross(clrad_grid_point a, clrad_grid_point b) {
  clrad_wide_vector r;
  r.x = clrad_wide_determinant(a.y, a.z, b.y, b.z);
  r.y = clrad_wide_determinant(a.z, a.x, b.z, b.x);
  r.z = clrad_wide_determinant(a.x, a.y, b.x, b.y);
  return r;
}

static inline int clrad_grid_dot_sign(clrad_wide_vector n, clrad_grid_point d) {
  return clrad_wide_sign(clrad_wide_add(clrad_wide_add(clrad_wide_times(n.x, d.x), clrad_wide_times(n.y, d.y)),
                                        clrad_wide_times(n.z, d.z)));
}

/* Sign of the determinant of (d, p, q). */
static inline int clrad_volume_sign(clrad_grid_point d, clrad_grid_point p, clrad_grid_point q) {
  return clrad_grid_dot_sign(clrad_grid_cross(p, q), d);
}

/* Sign of the doubled area of the triangle p, q, r of a plane seen along one axis. */
static inline int clrad_area_sign(long px, long py, long qx, long qy, long rx, long ry) {
  return clrad_wide_sign(clrad_wide_determinant(qx - px, qy - py, rx - px, ry - py));
}

/* Does the open segment ab meet the closed triangle v, all in one plane, seen along an axis on which the triangle's
 * projection has the orientation `turn` (+1 or -1)? By separating lines: two convex figures of the plane are apart
 * exactly when the line of one of their edges has them on its two sides. The segment is open, so it is off an edge's
 * inner side as soon as both ends are outside or on it and not both are on it. */
static inline int clrad_meets_in_plane(long ax, long ay, long bx, long by, long v0x, long v0y, long v1x, long v1y, long v2x,
                                long v2y, int turn) {
  int a0 = turn * clrad_area_sign(v0x, v0y, v1x, v1y, ax, ay), b0 = turn * clrad_area_sign(v0x, v0y, v1x, v1y, bx, by);
  int a1 = turn * clrad_area_sign(v1x, v1y, v2x, v2y, ax, ay), b1 = turn * clrad_area_sign(v1x, v1y, v2x, v2y, bx, by);
  int a2 = turn * clrad_area_sign(v2x, v2y, v0x, v0y, ax, ay), b2 = turn * clrad_area_sign(v2x, v2y, v0x, v0y, bx, by);
  if ((a0 <= 0 && b0 <= 0 && a0 + b0 < 0) || (a1 <= 0 && b1 <= 0 && a1 + b1 < 0) || (a2 <= 0 && b2 <= 0 && a2 + b2 < 0))
    return 0;
  int s = clrad_area_sign(ax, ay, bx, by, v0x, v0y) + clrad_area_sign(ax, ay, bx, by, v1x, v1y) +
          clrad_area_sign(ax, ay, bx, by, v2x, v2y);
  return s != 3 && s != -3;
}

/* 1 when the triangle blocks the segment, else 0. pre: the triangle's area is not zero. */
static inline int clrad_blocked(clrad_segment s, clrad_triangle t) {
  if (clrad_ignores(s, t.plane)) return 0;
  clrad_grid_point a = clrad_grid_position(s.ax, s.ay, s.az, s.ax_lo, s.ay_lo, s.az_lo);
  clrad_grid_point b = clrad_grid_position(s.bx, s.by, s.bz, s.bx_lo, s.by_lo, s.bz_lo);
  if (a.x == b.x && a.y == b.y && a.z == b.z) return 0;
  clrad_grid_point v0 = clrad_grid_position(t.x0, t.y0, t.z0, t.x0_lo, t.y0_lo, t.z0_lo);
  clrad_grid_point v1 = clrad_grid_position(t.x1, t.y1, t.z1, t.x1_lo, t.y1_lo, t.z1_lo);
  clrad_grid_point v2 = clrad_grid_position(t.x2, t.y2, t.z2, t.x2_lo, t.y2_lo, t.z2_lo);

  clrad_wide_vector n = clrad_grid_cross(clrad_grid_minus(v1, v0), clrad_grid_minus(v2, v0));
  int side_a = clrad_grid_dot_sign(n, clrad_grid_minus(a, v0));
  int side_b = clrad_grid_dot_sign(n, clrad_grid_minus(b, v0));
  if (side_a == 0 && side_b == 0) {
    int turn = clrad_wide_sign(n.z);
    if (turn != 0) return clrad_meets_in_plane(a.x, a.y, b.x, b.y, v0.x, v0.y, v1.x, v1.y, v2.x, v2.y, turn);
    turn = clrad_wide_sign(n.x);
    if (turn != 0) return clrad_meets_in_plane(a.y, a.z, b.y, b.z, v0.y, v0.z, v1.y, v1.z, v2.y, v2.z, turn);
    turn = clrad_wide_sign(n.y);
    return clrad_meets_in_plane(a.z, a.x, b.z, b.x, v0.z, v0.x, v1.z, v1.x, v2.z, v2.x, turn);
  }
  if ((side_a < 0) == (side_b < 0)) return 0;

  clrad_grid_point d = clrad_grid_minus(b, a);
  v0 = clrad_grid_minus(v0, a);
  v1 = clrad_grid_minus(v1, a);
  v2 = clrad_grid_minus(v2, a);
  int w0 = clrad_volume_sign(d, v0, v1), w1 = clrad_volume_sign(d, v1, v2), w2 = clrad_volume_sign(d, v2, v0);
  return (w0 >= 0 && w1 >= 0 && w2 >= 0) || (w0 <= 0 && w1 <= 0 && w2 <= 0);
}

#endif
