/* The fast test of a segment against a triangle in plain floats: miss, hit, or too close to tell. What it cannot tell
 * goes to shared/predicate.cl, so the final answer is exact and the same for every engine, width and device.
 *
 * With D = b - a, A_i = v_i - a, edges e_i = v_(i+1) - v_i and N = e_0 x e_1 it looks at
 *   volumes  U_i = D . (e_i x A_i)       (edge 2 uses A_0, since e_2 x A_2 = e_2 x A_0)
 *   sides    S_a = -N . A_0,  S_b = N . (b - v_0)
 * and a triangle is hit when S_a and S_b have different signs and all U_i the same one.
 *
 * How wrong can they be? u = 2^-24; every operation is rounded once (no contraction). All positions are hi + lo on the
 * grid with |lo| <= u |hi| and |lo| <= 2^16 grid steps.
 *  1. A difference is (p_hi - q_hi) + (p_lo - q_lo). The second bracket is exact (integers below 2^18 in grid steps).
 *     If p_hi and q_hi are within a factor of two the first is exact too (Sterbenz) and the sum rounds once. If not, it
 *     is at least half of max(|p_hi|, |q_hi|), so the lo parts change it by a factor of 1 +- 4u at most. Either way each
 *     component of a difference has relative error at most 2u(1 + 4u).
 *  2. Edges and normals are exact values rounded once (relative error u a component).
 *  3. A product e_j A_k: 1 + 2 + 1 = 4u; a component of the cross product: 5u (|e_j||A_k| + |e_k||A_j|); times D_i (2u),
 *     rounded (1u), summed (2u): |U - exact| <= 10u sum_i |D_i| (|e_j||A_k| + |e_k||A_j|) <= 10u |D|_max |e|_1 |A|_1.
 *     |A_1|_1 <= |A_0|_1 + |e_0|_1. With 12 for 10 the terms in u^2 and the rounding of the bound itself are covered:
 *       E_U = |D|_max * (12u edge_size (|A_0|_1 + edge_size) + 2^-80).
 *  4. A side: N (u) times A (2u), rounded (u), summed (2u): 6u sum |N_i||A_i|; with 8 for 6 as above
 *       E_S = 8u normal_size |A|_1 + 2^-110.
 *  The last terms cover devices that flush subnormal numbers: |D|_max >= 2^-38 unless D = 0, flushing changes a result
 *  by less than 2^-126, and fewer than 16 operations can be flushed.
 * A comparison with NaN is false, which makes the pair undecided; it cannot happen for finite input within +-4.
 */
#ifndef CLRAD_TRIANGLE_CL
#define CLRAD_TRIANGLE_CL

#include "shared/box.cl"
#include "shared/predicate.cl"

#define CLRAD_MISS 0
#define CLRAD_HIT 1
#define CLRAD_UNDECIDED 2

#define CLRAD_VOLUME_ERROR 0x1.8p-21f /* 12u */
#define CLRAD_VOLUME_FLOOR 0x1p-80f
#define CLRAD_SIDE_ERROR 0x1p-21f /* 8u */
#define CLRAD_SIDE_FLOOR 0x1p-110f

/* For scalars and vectors alike. Arguments are plain names. */
#define CLRAD_DIFFERENCE(p, p_lo, q, q_lo) (((p) - (q)) + ((p_lo) - (q_lo)))
#define CLRAD_CROSS(ay, az, by, bz) ((ay) * (bz) - (az) * (by))
#define CLRAD_DOT(ax, ay, az, bx, by, bz) (((ax) * (bx) + (ay) * (by)) + (az) * (bz))
#define CLRAD_NORM_1(x, y, z) ((fabs(x) + fabs(y)) + fabs(z))
#define CLRAD_MIN(a, b) ((a) < (b) ? (a) : (b))
#define CLRAD_MAX(a, b) ((a) > (b) ? (a) : (b))
/* |D|_max times this is E_U; norm is |A_0|_1. */
#define CLRAD_VOLUME_SCALE(norm, edge_size) \
  (((norm) + (edge_size)) * ((edge_size)*CLRAD_VOLUME_ERROR) + CLRAD_VOLUME_FLOOR)
#define CLRAD_SIDE_BOUND(norm, normal_size) ((norm) * ((normal_size)*CLRAD_SIDE_ERROR) + CLRAD_SIDE_FLOOR)

/* CLRAD_MISS, CLRAD_HIT or CLRAD_UNDECIDED, without a branch. */
static inline int clrad_fast_test(clrad_segment s, clrad_triangle t, clrad_facet f) {
  float dx = CLRAD_DIFFERENCE(s.bx, s.bx_lo, s.ax, s.ax_lo);
  float dy = CLRAD_DIFFERENCE(s.by, s.by_lo, s.ay, s.ay_lo);
  float dz = CLRAD_DIFFERENCE(s.bz, s.bz_lo, s.az, s.az_lo);
  float px = CLRAD_DIFFERENCE(t.x0, t.x0_lo, s.ax, s.ax_lo);
  float py = CLRAD_DIFFERENCE(t.y0, t.y0_lo, s.ay, s.ay_lo);
  float pz = CLRAD_DIFFERENCE(t.z0, t.z0_lo, s.az, s.az_lo);
  float qx = CLRAD_DIFFERENCE(t.x1, t.x1_lo, s.ax, s.ax_lo);
  float qy = CLRAD_DIFFERENCE(t.y1, t.y1_lo, s.ay, s.ay_lo);
  float qz = CLRAD_DIFFERENCE(t.z1, t.z1_lo, s.az, s.az_lo);
  float rx = CLRAD_DIFFERENCE(s.bx, s.bx_lo, t.x0, t.x0_lo);
  float ry = CLRAD_DIFFERENCE(s.by, s.by_lo, t.y0, t.y0_lo);
  float rz = CLRAD_DIFFERENCE(s.bz, s.bz_lo, t.z0, t.z0_lo);

  float u0 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f.e0y, f.e0z, py, pz), CLRAD_CROSS(f.e0z, f.e0x, pz, px),
                       CLRAD_CROSS(f.e0x, f.e0y, px, py));
  float u1 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f.e1y, f.e1z, qy, qz), CLRAD_CROSS(f.e1z, f.e1x, qz, qx),
                       CLRAD_CROSS(f.e1x, f.e1y, qx, qy));
  float u2 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f.e2y, f.e2z, py, pz), CLRAD_CROSS(f.e2z, f.e2x, pz, px),
                       CLRAD_CROSS(f.e2x, f.e2y, px, py));
  float least = CLRAD_MIN(CLRAD_MIN(u0, u1), u2), most = CLRAD_MAX(CLRAD_MAX(u0, u1), u2);

  float norm_a = CLRAD_NORM_1(px, py, pz), norm_b = CLRAD_NORM_1(rx, ry, rz);
  float size = CLRAD_MAX(CLRAD_MAX(fabs(dx), fabs(dy)), fabs(dz));
  float error = size * CLRAD_VOLUME_SCALE(norm_a, f.edge_size);
  float side_a = -CLRAD_DOT(f.nx, f.ny, f.nz, px, py, pz), side_b = CLRAD_DOT(f.nx, f.ny, f.nz, rx, ry, rz);
  float error_a = CLRAD_SIDE_BOUND(norm_a, f.normal_size), error_b = CLRAD_SIDE_BOUND(norm_b, f.normal_size);

  int front_a = side_a > error_a, back_a = side_a < -error_a;
  int front_b = side_b > error_b, back_b = side_b < -error_b;
  int miss = ((least < -error) & (most > error)) | (front_a & front_b) | (back_a & back_b) | clrad_ignores(s, t.plane);
  int hit = ((least > error) | (most < -error)) & ((front_a & back_b) | (back_a & front_b));
  return miss ? CLRAD_MISS : (hit ? CLRAD_HIT : CLRAD_UNDECIDED);
}

/* 1 when the triangle blocks the segment, else 0; *exact grows by one when the floats could not tell. */
static inline int clrad_test(clrad_segment s, clrad_triangle t, clrad_facet f, uint* exact) {
  int verdict = clrad_fast_test(s, t, f);
  if (verdict != CLRAD_UNDECIDED) return verdict;
  *exact += 1;
  return clrad_blocked(s, t);
}

/* Adds n to a 64-bit counter of two words, low first. Integer atomics: the total does not depend on the order. */
static inline void clrad_count(volatile __global uint* counter, uint n) {
  if (n == 0) return;
  const uint before = atomic_add(counter, n);
  if (before + n < before) atomic_inc(counter + 1);
}

/* Where a segment that the triangle blocks meets its plane, from 0 at a to 1 at b: S_a / (S_a - S_b), 0 when that is 0 / 0 (the segment
 * lies in the plane); and, since seen edge-on that says little, no nearer than the triangle's box: what lies behind a box need not be
 * asked for the nearest hit. The one formula of every engine, so that they agree to the bit. */
static inline float clrad_hit_parameter(clrad_segment s, clrad_triangle t, clrad_facet f) {
  float px = CLRAD_DIFFERENCE(s.ax, s.ax_lo, t.x0, t.x0_lo);
  float py = CLRAD_DIFFERENCE(s.ay, s.ay_lo, t.y0, t.y0_lo);
  float pz = CLRAD_DIFFERENCE(s.az, s.az_lo, t.z0, t.z0_lo);
  float rx = CLRAD_DIFFERENCE(s.bx, s.bx_lo, t.x0, t.x0_lo);
  float ry = CLRAD_DIFFERENCE(s.by, s.by_lo, t.y0, t.y0_lo);
  float rz = CLRAD_DIFFERENCE(s.bz, s.bz_lo, t.z0, t.z0_lo);
  float side_a = CLRAD_DOT(f.nx, f.ny, f.nz, px, py, pz), side_b = CLRAD_DOT(f.nx, f.ny, f.nz, rx, ry, rz);
  float where = side_a / (side_a - side_b);
  where = where >= 0.0f ? where : 0.0f;
  const float entry_x =
      entry_along(s.ax, CLRAD_DIFFERENCE(s.bx, s.bx_lo, s.ax, s.ax_lo), lowest(t.x0, t.x0_lo, t.x1, t.x1_lo, t.x2, t.x2_lo),
                  highest(t.x0, t.x0_lo, t.x1, t.x1_lo, t.x2, t.x2_lo));
  const float entry_y =
      entry_along(s.ay, CLRAD_DIFFERENCE(s.by, s.by_lo, s.ay, s.ay_lo), lowest(t.y0, t.y0_lo, t.y1, t.y1_lo, t.y2, t.y2_lo),
                  highest(t.y0, t.y0_lo, t.y1, t.y1_lo, t.y2, t.y2_lo));
  const float entry_z =
      entry_along(s.az, CLRAD_DIFFERENCE(s.bz, s.bz_lo, s.az, s.az_lo), lowest(t.z0, t.z0_lo, t.z1, t.z1_lo, t.z2, t.z2_lo),
                  highest(t.z0, t.z0_lo, t.z1, t.z1_lo, t.z2, t.z2_lo));
  where = CLRAD_MAX(where, entry_x);
  where = CLRAD_MAX(where, entry_y);
  where = CLRAD_MAX(where, entry_z);
  return where <= 1.0f ? where : 1.0f;
}

#endif
