/* The exact form factor of one receiver and one shooter (3 or 4 corners, planar, convex), unoccluded.
 *
 *   F = 1/pi integral over the shooter, above the receiver's horizon, of cos cos / r^2                       (area form)
 *     = 1/(2 pi) sum over the edges of angle_i * (n . unit(E_i x R_i))                                    (contour form)
 *
 * R_i: corner minus receiver, E_i = R_(i+1) - R_i, angle_i between R_i and R_(i+1); Lambert 1760, as used by Baum,
 * Rushmeier & Winget, SIGGRAPH 1989. Corners run counter-clockwise seen from the front, so each E_i x R_i points to
 * the polygon's outside.
 *
 * The contour form loses digits by cancellation when the shooter looks small or is seen at a grazing angle; the area
 * form never does (its terms are positive), but needs cells that are small against their distance. Which is used:
 *   1. far (centre at least 3 times the longest edge away): Gauss rule on the whole shooter, or on what the horizon
 *      leaves of it, with distances from the two planes in pairs where the view is grazing;
 *      Not quite as far, nor grazing: the same on its four quarters;
 *   2. else, no corner below the horizon: contour form, plain, with a running error bound; taken when the bound is small;
 *   3. else, carefully: all in pairs (twice the digits). Contour form unless all but some ten-millionth of its
 *      terms cancel, else Gauss rule on bisected cells, each far in the sense of 1.
 *
 * Accuracy (tests/solve/form_factor_test.cpp): 1e-5 relative in float, 1e-12 in double, as far as the positions' own
 * rounding allows. Ties: a corner on the horizon belongs to the visible part; a receiver in or behind the
 * shooter's plane gets 0, also on the shooter's edge. NaN anywhere gives 0: every test is written so that it fails. */
#ifndef CLRAD_FACTOR_CL
#define CLRAD_FACTOR_CL
#include "shared/math.cl"

/* What a kernel knows of the shooter, an array of REAL filled by the host. A triangle repeats its last corner. */
#define CLRAD_SHOOTER_HI 0      /* corners, x y z of each of 4, rounded to float in either precision */
#define CLRAD_SHOOTER_LO 12     /* their second halves */
#define CLRAD_SHOOTER_EDGE 24   /* E_i, rounded once */
#define CLRAD_SHOOTER_EDGE2 36  /* |E_i|^2 */
#define CLRAD_SHOOTER_NORMAL 40 /* unit, to the front; x y z as float, then what that leaves */
#define CLRAD_SHOOTER_AREA 46
#define CLRAD_SHOOTER_JACOBIAN 47 /* area per parameter area at corners 0..3 of the bilinear map */
#define CLRAD_SHOOTER_FAR2 51     /* (3 x longest edge)^2 */
#define CLRAD_SHOOTER_SIZE 52

/* Gauss-Legendre on [0, 1]. Over a segment of half-length 1 at distance K from its middle, the worst relative error for
 * 1/r^4 is 6e-7 with 4 points and 9e-15 with 8 at K = 6; cells have K >= 6 (centre at 3 edge lengths). The points of the
 * product rule are taken sixteen at a time, in explicit vectors whatever the packet width is: one order of sums. */
#ifdef CLRAD_FP64
#define CLRAD_GAUSS_BLOCKS 4
#define CLRAD_8_TIMES(x) x, x, x, x, x, x, x, x
#define CLRAD_AT_1 0.019855071751231884158
#define CLRAD_AT_2 0.1016667612931866302
#define CLRAD_AT_3 0.23723379504183550709
#define CLRAD_AT_4 0.40828267875217509753
#define CLRAD_AT_ALL \
  CLRAD_AT_1, CLRAD_AT_2, CLRAD_AT_3, CLRAD_AT_4, 1 - CLRAD_AT_4, 1 - CLRAD_AT_3, 1 - CLRAD_AT_2, 1 - CLRAD_AT_1
#define CLRAD_WEIGHT_1 0.050614268145188129576
#define CLRAD_WEIGHT_2 0.11119051722668723527
#define CLRAD_WEIGHT_3 0.15685332293894364367
#define CLRAD_WEIGHT_4 0.18134189168918099148
#define CLRAD_WEIGHTS(w)                                                                                  \
  w* CLRAD_WEIGHT_1, w* CLRAD_WEIGHT_2, w* CLRAD_WEIGHT_3, w* CLRAD_WEIGHT_4, w* CLRAD_WEIGHT_4, w* CLRAD_WEIGHT_3, \
      w* CLRAD_WEIGHT_2, w* CLRAD_WEIGHT_1
__constant REAL clrad_gauss_u[64] = {
    CLRAD_8_TIMES(CLRAD_AT_1),     CLRAD_8_TIMES(CLRAD_AT_2),     CLRAD_8_TIMES(CLRAD_AT_3),
    CLRAD_8_TIMES(CLRAD_AT_4),     CLRAD_8_TIMES(1 - CLRAD_AT_4), CLRAD_8_TIMES(1 - CLRAD_AT_3),
    CLRAD_8_TIMES(1 - CLRAD_AT_2), CLRAD_8_TIMES(1 - CLRAD_AT_1)};
__constant REAL clrad_gauss_v[64] = {CLRAD_AT_ALL, CLRAD_AT_ALL, CLRAD_AT_ALL, CLRAD_AT_ALL,
                                     CLRAD_AT_ALL, CLRAD_AT_ALL, CLRAD_AT_ALL, CLRAD_AT_ALL};
__constant REAL clrad_gauss_weight[64] = {CLRAD_WEIGHTS(CLRAD_WEIGHT_1), CLRAD_WEIGHTS(CLRAD_WEIGHT_2),
                                          CLRAD_WEIGHTS(CLRAD_WEIGHT_3), CLRAD_WEIGHTS(CLRAD_WEIGHT_4),
                                          CLRAD_WEIGHTS(CLRAD_WEIGHT_4), CLRAD_WEIGHTS(CLRAD_WEIGHT_3),
                                          CLRAD_WEIGHTS(CLRAD_WEIGHT_2), CLRAD_WEIGHTS(CLRAD_WEIGHT_1)};
#define CLRAD_FACTOR_TOLERANCE 5e-13
#else
#define CLRAD_GAUSS_BLOCKS 1
__constant REAL clrad_gauss_u[16] = {0.0694318442f, 0.0694318442f, 0.0694318442f, 0.0694318442f,
                                     0.3300094782f, 0.3300094782f, 0.3300094782f, 0.3300094782f,
                                     0.6699905218f, 0.6699905218f, 0.6699905218f, 0.6699905218f,
                                     0.9305681558f, 0.9305681558f, 0.9305681558f, 0.9305681558f};
__constant REAL clrad_gauss_v[16] = {0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f,
                                     0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f,
                                     0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f,
                                     0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f};
__constant REAL clrad_gauss_weight[16] = {0.0302507483f, 0.0567129630f, 0.0567129630f, 0.0302507483f,
                                          0.0567129630f, 0.1063233258f, 0.1063233258f, 0.0567129630f,
                                          0.0567129630f, 0.1063233258f, 0.1063233258f, 0.0567129630f,
                                          0.0302507483f, 0.0567129630f, 0.0567129630f, 0.0302507483f};
#define CLRAD_FACTOR_TOLERANCE 5e-6f
#endif

#ifndef CLRAD_HOST_COMPILED
#include "shared/lanes.cl"
#ifdef CLRAD_FP64
typedef double16 clrad_many;
#else
typedef float16 clrad_many;
#endif
static inline REAL clrad_lanes_sum(clrad_many x) {
#ifdef CLRAD_FP64
  const double8 a = x.lo + UPPER_WIDE(x);
  const double4 b = a.lo + a.hi;
  const double2 c = b.lo + b.hi;
#else
  const float8 a = x.lo + UPPER(x);
  const float4 b = a.lo + a.hi;
  const float2 c = b.lo + b.hi;
#endif
  return c.x + c.y;
}
#endif

#define CLRAD_CELL_LEVELS 24u /* a coordinate of a cell in units of 2^-24 is exact in float */

/* Sum of weight z J / r^4 over the Gauss points of a bilinear cell; r, z and J given at its corners (z and J are
 * bilinear, too). Only sums of products of positive numbers in z and J, so that neither loses digits. */
REAL clrad_cell_sum(const clrad_vector* r, const REAL* z, const REAL* jacobian) {
  REAL sum = 0;
  for (int block = 0; block < CLRAD_GAUSS_BLOCKS; block++) {
    const clrad_many u = vload16(block, clrad_gauss_u), v = vload16(block, clrad_gauss_v);
    const clrad_many u_ = 1 - u, v_ = 1 - v;
    const clrad_many c0 = u_ * v_, c1 = u * v_, c2 = u * v, c3 = u_ * v;
    const clrad_many x = r[0].x * c0 + r[1].x * c1 + r[2].x * c2 + r[3].x * c3;
    const clrad_many y = r[0].y * c0 + r[1].y * c1 + r[2].y * c2 + r[3].y * c3;
    const clrad_many w = r[0].z * c0 + r[1].z * c1 + r[2].z * c2 + r[3].z * c3;
    const clrad_many above = z[0] * c0 + z[1] * c1 + z[2] * c2 + z[3] * c3;
    const clrad_many area = jacobian[0] * c0 + jacobian[1] * c1 + jacobian[2] * c2 + jacobian[3] * c3;
    const clrad_many per = 1 / (x * x + y * y + w * w); /* not 1 / r^4: a float ends at r = 1e-10 of the frame */
    sum += clrad_lanes_sum(vload16(block, clrad_gauss_weight) * (above * per) * (area * per));
  }
  return sum;
}

REAL clrad_mean(const REAL* x, int i, int k) { return (x[i] + x[k]) * CLRAD_R(0.5); }
clrad_vector clrad_midpoint(const clrad_vector* r, int i, int k) {
  return clrad_scaled(clrad_plus(r[i], r[k]), CLRAD_R(0.5));
}

/* The same sum over the four quarters of a bilinear cell; corner k of a quarter is where the cell's corner k lies. */
REAL clrad_quartered_sum(const clrad_vector* r, const REAL* z, const REAL* jacobian) {
  REAL sum = 0;
  for (int q = 0; q < 4; q++) {
    const int next = (q + 1) & 3, previous = (q + 3) & 3, opposite = q ^ 2;
    clrad_vector quarter[4];
    REAL quarter_z[4], quarter_j[4];
    quarter[q] = r[q];
    quarter_z[q] = z[q];
    quarter_j[q] = jacobian[q];
    quarter[next] = clrad_midpoint(r, q, next);
    quarter_z[next] = clrad_mean(z, q, next);
    quarter_j[next] = clrad_mean(jacobian, q, next);
    quarter[previous] = clrad_midpoint(r, q, previous);
    quarter_z[previous] = clrad_mean(z, q, previous);
    quarter_j[previous] = clrad_mean(jacobian, q, previous);
    const clrad_vector far_edge = clrad_midpoint(r, next, opposite);
    quarter[opposite] = clrad_scaled(clrad_plus(far_edge, clrad_midpoint(r, q, previous)), CLRAD_R(0.5));
    quarter_z[opposite] = (clrad_mean(z, next, opposite) + clrad_mean(z, q, previous)) * CLRAD_R(0.5);
    quarter_j[opposite] = (clrad_mean(jacobian, next, opposite) + clrad_mean(jacobian, q, previous)) * CLRAD_R(0.5);
    sum += clrad_cell_sum(quarter, quarter_z, quarter_j);
  }
  return sum * CLRAD_R(0.25); /* a quarter of the parameter area each */
}

/* ---- the careful way ---------------------------------------------------------------------------------------------- */

/* The value at (u, v), exact in REAL, of the bilinear function with value c, slopes along u and v and twist there. */
REAL clrad_bilinear(clrad_pair c, clrad_pair along_u, clrad_pair along_v, clrad_pair twist, REAL u, REAL v) {
  const clrad_pair a = clrad_pair_add(c, clrad_pair_times(along_u, u));
  const clrad_pair b = clrad_pair_add(along_v, clrad_pair_times(twist, u));
  return clrad_pair_add(a, clrad_pair_times(b, v)).hi;
}

/* pi F by the area form. r: a convex quadrilateral (or triangle with its last corner repeated) above the horizon,
 * z = n . r at its corners. Cells are bisected until far; a dyadic cell knows its parent, so no stack is needed.
 * A cell's first corner is taken in pairs, as it may be near the receiver; the others lie a plain step from it, and steps
 * of a far cell are short against its distance. */
REAL clrad_area_form(const clrad_pair_vector* r, const clrad_pair* z) {
  const clrad_pair_vector e01 = clrad_pair_vector_sub(r[1], r[0]), e12 = clrad_pair_vector_sub(r[2], r[1]);
  const clrad_pair_vector e03 = clrad_pair_vector_sub(r[3], r[0]), e32 = clrad_pair_vector_sub(r[2], r[3]);
  clrad_pair_vector normal = clrad_pair_cross(clrad_pair_vector_sub(r[2], r[0]), clrad_pair_vector_sub(r[3], r[1]));
  const REAL unit = clrad_power_of_two(clrad_largest(clrad_rounded(normal)));
  if (!(unit > 0)) return 0; /* no area */
  normal = clrad_pair_vector_scaled(normal, 1 / unit);
  int nearest = 0;
  REAL nearest2 = 0;
  for (int i = 0; i < 4; i++) {
    const REAL r2 = clrad_dot(clrad_rounded(r[i]), clrad_rounded(r[i]));
    if (i == 0 || r2 < nearest2) {
      nearest = i;
      nearest2 = r2;
    }
  }
  const REAL height = -clrad_pair_dot(normal, r[nearest]).hi;
  if (!(height > 0)) return 0;
  const clrad_vector n = clrad_rounded(normal);
  const clrad_pair_vector bend = clrad_pair_vector_sub(e12, e03);
  const clrad_vector along_u = clrad_rounded(e01), along_v = clrad_rounded(e03), twist = clrad_rounded(bend);
  REAL j[4];
  j[0] = clrad_pair_dot(normal, clrad_pair_cross(e01, e03)).hi;
  j[1] = clrad_pair_dot(normal, clrad_pair_cross(e01, e12)).hi;
  j[2] = clrad_pair_dot(normal, clrad_pair_cross(e32, e12)).hi;
  j[3] = clrad_pair_dot(normal, clrad_pair_cross(e32, e03)).hi;

  clrad_pair sum = clrad_two_sum(0, 0);
  uint at_u = 0, at_v = 0, level_u = 0, level_v = 0;
  ulong split_in_v = 0; /* bit l: the split at depth l went across v */
  for (;;) {
    const REAL width_u = (REAL)1 / (REAL)(1u << level_u), width_v = (REAL)1 / (REAL)(1u << level_v);
    const REAL u0 = (REAL)at_u * width_u, v0 = (REAL)at_v * width_v;
    clrad_vector cell[4];
    cell[0] = clrad_make(clrad_bilinear(r[0].x, e01.x, e03.x, bend.x, u0, v0),
                         clrad_bilinear(r[0].y, e01.y, e03.y, bend.y, u0, v0),
                         clrad_bilinear(r[0].z, e01.z, e03.z, bend.z, u0, v0));
    cell[1] = clrad_plus(cell[0], clrad_scaled(clrad_plus(along_u, clrad_scaled(twist, v0)), width_u));
    cell[3] = clrad_plus(cell[0], clrad_scaled(clrad_plus(along_v, clrad_scaled(twist, u0)), width_v));
    cell[2] = clrad_plus(cell[1], clrad_scaled(clrad_plus(along_v, clrad_scaled(twist, u0 + width_u)), width_v));
    const clrad_vector a = clrad_minus(cell[1], cell[0]), b = clrad_minus(cell[2], cell[3]);
    const clrad_vector c = clrad_minus(cell[3], cell[0]), d = clrad_minus(cell[2], cell[1]);
    const REAL a2 = clrad_dot(a, a), b2 = clrad_dot(b, b), c2 = clrad_dot(c, c), d2 = clrad_dot(d, d);
    const REAL edge_u2 = a2 > b2 ? a2 : b2, edge_v2 = c2 > d2 ? c2 : d2;
    const clrad_vector middle =
        clrad_scaled(clrad_plus(clrad_plus(cell[0], cell[1]), clrad_plus(cell[2], cell[3])), CLRAD_R(0.25));
    const REAL edge2 = edge_u2 > edge_v2 ? edge_u2 : edge_v2;
    const int across_v = edge_v2 > edge_u2;
    const uint level = across_v ? level_v : level_u;
    if (9 * edge2 > clrad_dot(middle, middle) && level < CLRAD_CELL_LEVELS) {
      const ulong bit = (ulong)1 << (level_u + level_v);
      split_in_v = across_v ? split_in_v | bit : split_in_v & ~bit;
      if (across_v) {
        level_v++;
        at_v *= 2;
      } else {
        level_u++;
        at_u *= 2;
      }
      continue;
    }
    REAL cell_z[4], cell_j[4];
    for (int i = 0; i < 4; i++) {
      const REAL u = i == 1 || i == 2 ? u0 + width_u : u0, v = i >= 2 ? v0 + width_v : v0;
      cell_z[i] = (1 - v) * ((1 - u) * z[0].hi + u * z[1].hi) + v * ((1 - u) * z[3].hi + u * z[2].hi);
      cell_j[i] = (1 - v) * ((1 - u) * j[0] + u * j[1]) + v * ((1 - u) * j[3] + u * j[2]);
    }
    const clrad_pair grown = clrad_two_sum(sum.hi, clrad_cell_sum(cell, cell_z, cell_j) * (width_u * width_v));
    sum.hi = grown.hi;
    sum.lo += grown.lo;
    for (;;) { /* to the sibling, or up until there is one */
      if (level_u + level_v == 0) return (sum.hi + sum.lo) * (height / clrad_dot(n, n));
      if (split_in_v >> (level_u + level_v - 1) & 1) {
        if ((at_v++ & 1) == 0) break;
        at_v = (at_v - 1) / 2;
        level_v--;
      } else {
        if ((at_u++ & 1) == 0) break;
        at_u = (at_u - 1) / 2;
        level_u--;
      }
    }
  }
}

/* 2 pi F by the contour form in pairs; `allowed`: whether cancellation left it accurate. A term is off by its angle's
 * error, all else by some squares of a rounding. pre: no corner below the horizon; then n has no more than d along an edge that passes at a
 * distance of d, and there c / |c| is off by a square of a rounding over d along the edge. */
REAL clrad_contour_form(const clrad_pair_vector* r, int corners, clrad_vector n, int* allowed) {
  clrad_pair sum = clrad_two_sum(0, 0);
  REAL size = 0;
  const clrad_pair_vector normal = clrad_pair_of(n);
  for (int i = 0; i < corners; i++) {
    const int next = i + 1 < corners ? i + 1 : 0;
    const clrad_vector a = clrad_rounded(r[i]), b = clrad_rounded(r[next]);
    clrad_pair_vector c =
        clrad_pair_cross(clrad_pair_vector_sub(r[next], r[i]), clrad_dot(a, a) < clrad_dot(b, b) ? r[i] : r[next]);
    const REAL unit = clrad_power_of_two(clrad_largest(clrad_rounded(c)));
    if (!(unit > 0)) continue; /* no edge, or seen from its own line */
    c = clrad_pair_vector_scaled(c, 1 / unit);
    const clrad_pair length = clrad_pair_sqrt(clrad_pair_dot(c, c));
    const clrad_pair angle = clrad_pair_atan2(clrad_pair_scaled(length, unit), clrad_pair_dot(r[i], r[next]));
    const clrad_pair term = clrad_pair_mul(angle, clrad_pair_div(clrad_pair_dot(normal, c), length));
    sum = clrad_pair_add(sum, term);
    size += term.hi < 0 ? -term.hi : term.hi;
  }
  *allowed = CLRAD_PAIR_ATAN2_ERROR * size <= CLRAD_FACTOR_TOLERANCE * sum.hi;
  return sum.hi;
}

/* (n + n_lo) . (corner - p), in pairs. */
REAL clrad_corner_height(__global const REAL* shooter, uint corner, clrad_vector n, clrad_vector n_lo, clrad_vector p,
                         clrad_vector p_lo) {
  __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * corner;
  __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * corner;
  clrad_pair_vector r, normal;
  r.x = clrad_pair_add(clrad_two_sum(hi[0], -p.x), clrad_two_sum(lo[0], -p_lo.x));
  r.y = clrad_pair_add(clrad_two_sum(hi[1], -p.y), clrad_two_sum(lo[1], -p_lo.y));
  r.z = clrad_pair_add(clrad_two_sum(hi[2], -p.z), clrad_two_sum(lo[2], -p_lo.z));
  normal.x = clrad_fast_two_sum(n.x, n_lo.x);
  normal.y = clrad_fast_two_sum(n.y, n_lo.y);
  normal.z = clrad_fast_two_sum(n.z, n_lo.z);
  return clrad_pair_dot(normal, r).hi;
}

/* Whether that height is positive. A plain dot product tells unless it is small against the distance: the difference, the
 * normal, the products and the sum make fewer than 8 roundings of |n| |r|. */
int clrad_corner_above(__global const REAL* shooter, uint corner, clrad_vector n, clrad_vector n_lo, clrad_vector p,
                       clrad_vector p_lo) {
  __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * corner;
  __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * corner;
  const clrad_vector r = clrad_make((hi[0] - p.x) + (lo[0] - p_lo.x), (hi[1] - p.y) + (lo[1] - p_lo.y),
                                    (hi[2] - p.z) + (lo[2] - p_lo.z));
  const REAL height = clrad_dot(clrad_plus(n, n_lo), r), least = 16 * CLRAD_EPSILON;
  if (height * height > least * least * clrad_dot(r, r)) return height > 0;
  return clrad_corner_height(shooter, corner, n, n_lo, p, p_lo) > 0;
}

/* Distance of p from the shooter's plane, positive in front, in pairs: its absolute error is 2^-46 of the distance to the
 * shooter's first corner in float. */
REAL clrad_height(__global const REAL* shooter, clrad_vector p, clrad_vector p_lo) {
  __global const REAL* n = shooter + CLRAD_SHOOTER_NORMAL;
  return -clrad_corner_height(shooter, 0, clrad_make(n[0], n[1], n[2]), clrad_make(n[3], n[4], n[5]), p, p_lo);
}

/* The shooter seen from the receiver and clipped at its horizon: r relative to the receiver, in units that make the
 * largest coordinate about 1; z = n . r, 0 for corners on the horizon. Returns the number of corners, 0 when nothing is
 * above the horizon. *unit: what one unit of r is in the frame. */
int clrad_clipped_shooter(__global const REAL* shooter, clrad_vector p, clrad_vector p_lo, clrad_vector n,
                          clrad_pair_vector* r, clrad_pair* z, REAL* unit) {
  clrad_pair_vector q[4];
  clrad_pair height[4];
  const clrad_pair_vector normal = clrad_pair_of(n);
  REAL largest = 0;
  for (int i = 0; i < 4; i++) {
    __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * i;
    __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * i;
    q[i].x = clrad_pair_add(clrad_two_sum(hi[0], -p.x), clrad_two_sum(lo[0], -p_lo.x));
    q[i].y = clrad_pair_add(clrad_two_sum(hi[1], -p.y), clrad_two_sum(lo[1], -p_lo.y));
    q[i].z = clrad_pair_add(clrad_two_sum(hi[2], -p.z), clrad_two_sum(lo[2], -p_lo.z));
    const REAL l = clrad_largest(clrad_rounded(q[i]));
    largest = l > largest ? l : largest;
  }
  *unit = clrad_power_of_two(largest);
  if (!(*unit > 0)) return 0;
  int above = 0;
  for (int i = 0; i < 4; i++) {
    q[i] = clrad_pair_vector_scaled(q[i], 1 / *unit);
    height[i] = clrad_pair_dot(normal, q[i]);
    above |= height[i].hi > 0;
  }
  if (!above) return 0;
  const int triangle = shooter[CLRAD_SHOOTER_EDGE2 + 2] == 0;
  int corners = 0;
  for (int i = 0; i < 4 - triangle; i++) {
    const int next = i + 1 < 4 - triangle ? i + 1 : 0;
    if (height[i].hi >= 0) {
      r[corners] = q[i];
      z[corners++] = height[i];
    }
    if (height[i].hi * height[next].hi < 0 || (height[i].hi < 0) != (height[next].hi < 0)) {
      if (height[i].hi == 0 || height[next].hi == 0) continue;
      const clrad_pair t = clrad_pair_div(height[i], clrad_pair_sub(height[i], height[next]));
      r[corners] = clrad_pair_vector_add(q[i], clrad_pair_vector_mul(clrad_pair_vector_sub(q[next], q[i]), t));
      z[corners++] = clrad_two_sum(0, 0);
    }
  }
  return corners >= 3 ? corners : 0;
}

/* Centroid by area of what clrad_clipped_shooter leaves, in the frame; the shooter's first corner when that is nothing. */
clrad_pair_vector clrad_clipped_centroid(__global const REAL* shooter, clrad_vector p, clrad_vector p_lo,
                                         clrad_vector n) {
  clrad_pair_vector r[5], sum;
  clrad_pair z[5];
  REAL unit;
  const int corners = clrad_clipped_shooter(shooter, p, p_lo, n, r, z, &unit);
  REAL area = 0;
  sum = clrad_pair_of(clrad_make(0, 0, 0));
  for (int i = 1; i + 1 < corners; i++) {
    const clrad_pair_vector a = clrad_pair_vector_sub(r[i], r[0]), b = clrad_pair_vector_sub(r[i + 1], r[0]);
    const clrad_vector c = clrad_rounded(clrad_pair_cross(a, b));
    const REAL largest = clrad_largest(c); /* an area up to a factor of 1.5: any inner point will do */
    area += largest;
    sum = clrad_pair_vector_add(sum,
                                clrad_pair_vector_mul(clrad_pair_vector_add(a, b), clrad_two_sum(0, largest)));
  }
  clrad_pair_vector at;
  at.x = clrad_two_sum(p.x, p_lo.x);
  at.y = clrad_two_sum(p.y, p_lo.y);
  at.z = clrad_two_sum(p.z, p_lo.z);
  if (!(area > 0)) {
    at.x = clrad_two_sum(shooter[CLRAD_SHOOTER_HI], shooter[CLRAD_SHOOTER_LO]);
    at.y = clrad_two_sum(shooter[CLRAD_SHOOTER_HI + 1], shooter[CLRAD_SHOOTER_LO + 1]);
    at.z = clrad_two_sum(shooter[CLRAD_SHOOTER_HI + 2], shooter[CLRAD_SHOOTER_LO + 2]);
    return at;
  }
  const clrad_pair share = clrad_pair_div(clrad_two_sum(0, 1), clrad_two_product(3, area));
  const clrad_pair_vector inner = clrad_pair_vector_add(r[0], clrad_pair_vector_mul(sum, share));
  return clrad_pair_vector_add(at, clrad_pair_vector_scaled(inner, unit));
}

REAL clrad_careful_factor(__global const REAL* shooter, clrad_vector p, clrad_vector p_lo, clrad_vector n) {
  clrad_pair_vector r[5];
  clrad_pair z[5];
  REAL unit;
  if (!(clrad_height(shooter, p, p_lo) > 0)) return 0;
  const int corners = clrad_clipped_shooter(shooter, p, p_lo, n, r, z, &unit);
  if (corners == 0) return 0;
  int accurate;
  const REAL contour = clrad_contour_form(r, corners, n, &accurate);
  if (accurate) return contour / (2 * CLRAD_PI);
  if (corners == 3) {
    r[3] = r[2];
    z[3] = z[2];
  }
  REAL area = clrad_area_form(r, z);
  if (corners == 5) { /* the triangle 0 3 4 is left */
    r[1] = r[3];
    z[1] = z[3];
    r[2] = r[3] = r[4];
    z[2] = z[3] = z[4];
    area += clrad_area_form(r, z);
  }
  return area / CLRAD_PI;
}

/* ---- the usual way ------------------------------------------------------------------------------------------------ */

clrad_vector clrad_load(__global const REAL* at) { return clrad_make(at[0], at[1], at[2]); }

/* pi F / height for one quadrilateral of the shooter's plane: r0 + q its corners, z their heights. far: in one cell. */
REAL clrad_far_quad(clrad_vector r0, clrad_vector a, clrad_vector b, clrad_vector c, clrad_vector d, REAL za, REAL zb,
                    REAL zc, REAL zd, clrad_vector front, int far) {
  const clrad_vector ab = clrad_minus(b, a), ad = clrad_minus(d, a), bc = clrad_minus(c, b), dc = clrad_minus(c, d);
  clrad_vector r[4];
  r[0] = clrad_plus(r0, a);
  r[1] = clrad_plus(r0, b);
  r[2] = clrad_plus(r0, c);
  r[3] = clrad_plus(r0, d);
  REAL z[4], j[4];
  z[0] = za;
  z[1] = zb;
  z[2] = zc;
  z[3] = zd;
  j[0] = clrad_dot(front, clrad_cross(ab, ad));
  j[1] = clrad_dot(front, clrad_cross(ab, bc));
  j[2] = clrad_dot(front, clrad_cross(dc, bc));
  j[3] = clrad_dot(front, clrad_cross(dc, ad));
  return far ? clrad_cell_sum(r, z, j) : clrad_quartered_sum(r, z, j);
}

/* The same for a shooter that the horizon cuts; z: heights of its corners, accurate each. Cut corners are measured
 * from corner 0 along the edges, which keeps small differences of far points accurate. */
REAL clrad_far_clipped(__global const REAL* shooter, clrad_vector r0, const REAL* z, clrad_vector front, int far) {
  clrad_vector corner[4], q[5];
  REAL height[5];
  corner[0] = clrad_make(0, 0, 0);
  corner[1] = clrad_load(shooter + CLRAD_SHOOTER_EDGE);
  corner[2] = clrad_plus(corner[1], clrad_load(shooter + CLRAD_SHOOTER_EDGE + 3));
  corner[3] = clrad_scaled(clrad_load(shooter + CLRAD_SHOOTER_EDGE + 9), -1);
  int count = 0;
  for (int i = 0; i < 4; i++) {
    const int next = (i + 1) & 3;
    if (z[i] >= 0) {
      q[count] = corner[i];
      height[count++] = z[i];
    }
    if ((z[i] > 0 && z[next] < 0) || (z[i] < 0 && z[next] > 0)) {
      const clrad_vector edge = clrad_load(shooter + CLRAD_SHOOTER_EDGE + 3 * i);
      q[count] = clrad_plus(corner[i], clrad_scaled(edge, z[i] / (z[i] - z[next])));
      height[count++] = 0;
    }
  }
  if (count < 3) return 0;
  const int last = count == 3 ? 2 : 3;
  REAL sum = clrad_far_quad(r0, q[0], q[1], q[2], q[last], height[0], height[1], height[2], height[last], front, far);
  if (count == 5)
    sum += clrad_far_quad(r0, q[0], q[3], q[4], q[4], height[0], height[3], height[4], height[4], front, far);
  return sum;
}

/* Unoccluded form factor of the receiver at p + p_lo with unit normal n. */
REAL clrad_exact_factor(__global const REAL* shooter, clrad_vector p, clrad_vector p_lo, clrad_vector n) {
  clrad_vector r[4];
  REAL z[4], r2[4];
  REAL nearest2 = CLRAD_R(1e30);
  int steep = 1; /* all corners high above the horizon: z is accurate */
  int above = 1; /* none below it by more than rounding */
  int some_above = 0;
  for (int i = 0; i < 4; i++) {
    r[i] = clrad_plus(clrad_minus(clrad_load(shooter + CLRAD_SHOOTER_HI + 3 * i), p),
                      clrad_minus(clrad_load(shooter + CLRAD_SHOOTER_LO + 3 * i), p_lo));
    z[i] = clrad_dot(n, r[i]);
    r2[i] = clrad_dot(r[i], r[i]);
    nearest2 = r2[i] < nearest2 ? r2[i] : nearest2;
    const REAL z2 = z[i] * z[i], noise2 = (64 * CLRAD_EPSILON * CLRAD_EPSILON) * r2[i];
    steep &= z[i] > 0 && 64 * z2 > r2[i];
    above &= z[i] >= 0 || z2 <= noise2;
    some_above |= z[i] >= 0 || z2 <= noise2;
  }
  /* Nearer than 2^-16 the rounding of r could show (hi and lo cancel). */
  if (!(nearest2 > CLRAD_R(2.5e-10))) return clrad_careful_factor(shooter, p, p_lo, n);
  const clrad_vector middle =
      clrad_scaled(clrad_plus(clrad_plus(r[0], r[1]), clrad_plus(r[2], r[3])), CLRAD_R(0.25));
  const REAL middle2 = clrad_dot(middle, middle);
  const clrad_vector front =
      clrad_plus(clrad_load(shooter + CLRAD_SHOOTER_NORMAL), clrad_load(shooter + CLRAD_SHOOTER_NORMAL + 3));
  const REAL height = -clrad_dot(front, middle);
  const int off_plane = height * height > 64 * CLRAD_EPSILON * CLRAD_EPSILON * middle2; /* its sign is sure */
  if (!some_above || (height < 0 && off_plane)) return 0;

  /* At 1.9 edges the quarters are far: their middles are at most a quarter diagonal, 0.36 edges, nearer, and 1.54 edges
   * are 3 of theirs. */
  if (middle2 >= CLRAD_R(0.4012) * shooter[CLRAD_SHOOTER_FAR2]) {
    /* At grazing angles the distances from the two planes lose digits: those alone are taken in pairs. */
    const REAL h = 64 * height * height > middle2 ? height : clrad_height(shooter, p, p_lo);
    if (!(h > 0)) return 0;
    if (!steep) {
      REAL high = 0, low = 0;
      for (uint i = 0; i < 4; i++) {
        z[i] = clrad_corner_height(shooter, i, n, clrad_make(0, 0, 0), p, p_lo);
        high = z[i] > high ? z[i] : high;
        low = z[i] < low ? z[i] : low;
      }
      steep = !(low < 0);
      /* A sliver of the shooter: its own size is lost in differences of corners. */
      if (high < CLRAD_R(0.125) * (high - low)) return clrad_careful_factor(shooter, p, p_lo, n);
    }
    const int far = middle2 >= shooter[CLRAD_SHOOTER_FAR2];
    if (!steep) return clrad_far_clipped(shooter, r[0], z, front, far) * h / CLRAD_PI;
    REAL j[4];
    for (int i = 0; i < 4; i++) j[i] = shooter[CLRAD_SHOOTER_JACOBIAN + i];
    return (far ? clrad_cell_sum(r, z, j) : clrad_quartered_sum(r, z, j)) * h / CLRAD_PI;
  }
  if (above && off_plane) {
    REAL sum = 0, bound = 0;
    for (int i = 0; i < 4; i++) {
      const int next = (i + 1) & 3;
      const REAL edge2 = shooter[CLRAD_SHOOTER_EDGE2 + i];
      if (edge2 == 0) continue;
      const int here = r2[i] < r2[next];
      const clrad_vector c =
          clrad_cross(clrad_load(shooter + CLRAD_SHOOTER_EDGE + 3 * i), here ? r[i] : r[next]);
      const REAL c2 = clrad_dot(c, c), most2 = (here ? r2[i] : r2[next]) * edge2;
      if (!(c2 > CLRAD_R(1e-6) * most2 && c2 > CLRAD_R(1e-30))) {
        bound = CLRAD_R(1e30);
        break;
      }
      const REAL length = sqrt(c2);
      const REAL each = clrad_atan2(length, clrad_dot(r[i], r[next])) / length;
      sum += each * clrad_dot(n, c);
      bound += each * sqrt(most2);
    }
    /* Each component of c is off by at most 4 roundings of |E||r| (r, E, products, difference), n . c, the angle
     * and the quotient by 6 more of |c| <= |E||r|: 10 roundings of |E||r| angle / |c| an edge. */
    if (10 * CLRAD_EPSILON * bound <= CLRAD_FACTOR_TOLERANCE * sum) return sum / (2 * CLRAD_PI);
  }
  return clrad_careful_factor(shooter, p, p_lo, n);
}
#endif
