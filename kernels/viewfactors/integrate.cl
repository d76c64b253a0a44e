/* View factors of pairs of convex polygons, with what stands between them: the integral over cells of a receiver of
 * the form factor of each Gauss point to the visible part of the shooter.
 *
 *   A_r F_rs = integral over x in the receiver of F(x -> visible part of the shooter)
 *
 * Visibility is not sampled. Seen from x, an occluder (a polygon or a closed convex body) is a pyramid of half-spaces through x; the shooter minus all
 * pyramids is a few convex pieces (each pyramid's edge cuts off what is beyond it, and what is inside all of them is
 * hidden), whose form factors are summed by Lambert's contour formula (shared/factor.cl). So the integrand is exact at
 * each point, continuous, and smooth but for kinks where edges line up; the host places cells where it is not smooth.
 *
 * Pre: receiver, shooter and occluders of a pair are relative to an origin of the pair's own; the shooter lies wholly in
 * front of the receiver's plane and the receiver in front of the shooter's, and each occluder has been clipped to the
 * front of both planes (host/viewfactors/pairs.cpp), so that the ray from x through an occluder meets it before the
 * shooter. Half-spaces are closed towards the piece: an edge that only touches hides nothing. NaN hides nothing.
 *
 * Source: the area-to-area integral as in Siegel & Howell; shadows cut out of sources: Nishita & Nakamae, SIGGRAPH 1985;
 * the error indicator follows Berntsen, Espelid & Genz, ACM TOMS 17 (1991) 437, with null rules. */
#include "shared/pieces.cl"
#include "viewfactors/tables.cl"

#define NODES 5             /* Gauss points along each side of a cell */
#define CELL_POINTS 25      /* NODES x NODES */
#define PIECE_REALS (1 + 3 * MOST_CORNERS) /* on the stack: corners + 64 * next occluder, corner positions */
#define MOST_NEAR 48        /* occluders of a point looked at once for all pieces */
#define RESULT_REALS 7      /* of a cell, see cell_sums */
#define POINT_REALS 4       /* seen, unsure, rounding, what would be seen without occluders; each times the area that the point
                               stands for */

__constant REAL node_at[NODES] = {CLRAD_R(0.0469100770306680036), CLRAD_R(0.2307653449471584545), CLRAD_R(0.5),
                                  CLRAD_R(0.7692346550528415455), CLRAD_R(0.9530899229693319964)};
__constant REAL node_weight[NODES] = {CLRAD_R(0.1184634425280945438), CLRAD_R(0.2393143352496832340),
                                      CLRAD_R(0.2844444444444444444), CLRAD_R(0.2393143352496832340),
                                      CLRAD_R(0.1184634425280945438)};
/* weight x orthonormal Legendre polynomial of degree 1 to 4 at the nodes: rules that give 0 for constants. */
__constant REAL null_rule[4][NODES] = {
    {CLRAD_R(-0.1859342410113514075), CLRAD_R(-0.2231979993378560220), CLRAD_R(0.0), CLRAD_R(0.2231979993378560220),
     CLRAD_R(0.1859342410113514075)},
    {CLRAD_R(0.1938330593514185093), CLRAD_R(-0.0348237809514334642), CLRAD_R(-0.3180185567999700902),
     CLRAD_R(-0.0348237809514334642), CLRAD_R(0.1938330593514185093)},
    {CLRAD_R(-0.1570355987780476488), CLRAD_R(0.2642722473443249012), CLRAD_R(0.0), CLRAD_R(-0.2642722473443249012),
     CLRAD_R(0.1570355987780476488)},
    {CLRAD_R(0.0873320053068150960), CLRAD_R(-0.2473320053068150960), CLRAD_R(0.32), CLRAD_R(-0.2473320053068150960),
     CLRAD_R(0.0873320053068150960)}};

/* The planes through x, being the origin, and the sides of a piece, normals to the inside; allowed[i]: what rounding leaves
 * of h[i] . c, a part of the largest component of c. */
void pyramid_over(const clrad_vector* p, int n, clrad_vector* h, REAL* allowed) {
  for (int i = 0; i < n; i++) {
    const clrad_vector ahead = p[i + 1 < n ? i + 1 : 0];
    h[i] = clrad_cross(ahead, p[i]);
    /* Corners may coincide: not the size of h. */
    allowed[i] = 16 * CLRAD_EPSILON * clrad_largest(ahead) * clrad_largest(p[i]);
  }
}

/* Whether some side of the pyramid over the piece has all of the occluder beyond it: then it hides nothing. Cheap, and true
 * for most pairs. */
int beyond_pyramid(const clrad_vector* h, const REAL* allowed, int n, __global const REAL* corner, uint corners,
                   clrad_vector x) {
  for (int i = 0; i < n; i++) {
    int inside = 0;
    for (uint e = 0; e < corners && !inside; e++) {
      const clrad_vector c = clrad_minus(load_vector(corner + 3 * e), x);
      inside = clrad_dot(h[i], c) >= -allowed[i] * clrad_largest(c);
    }
    if (!inside) return 1;
  }
  return 0;
}

/* Whether some side of what the occluder shows has all of the piece beyond it: then it hides nothing. */
int beyond_side(const clrad_vector* p, int n, const clrad_vector* side, int sides) {
  REAL largest = 0;
  for (int i = 0; i < n; i++) {
    const REAL l = clrad_largest(p[i]);
    largest = l > largest ? l : largest;
  }
  for (int e = 0; e < sides; e++) {
    const REAL allowed = 16 * CLRAD_EPSILON * clrad_largest(side[e]) * largest;
    int inside = 0;
    for (int i = 0; i < n && !inside; i++) inside = clrad_dot(side[e], p[i]) > allowed;
    if (!inside) return 1;
  }
  return 0;
}

/* F at one point: *seen, what of it no stack or piece had room for (*unsure), a bound of the rounding, and what it would be
 * without occluders (*free). */
void visible_factor(clrad_vector x, clrad_vector normal, __global const uint* pair, __global const uint* list, uint last,
                    __global const uint* occluder, __global const uint* side, __global const REAL* plane,
                    __global const REAL* vertex, __global REAL* stack, uint capacity, REAL* seen, REAL* unsure,
                    REAL* rounding, REAL* free) {
  clrad_vector h[MOST_SIDES], p[MOST_CORNERS + 1], q[MOST_CORNERS + 1], r[MOST_CORNERS + 1], aside[MOST_CORNERS + 1];
  clrad_vector pyramid[MOST_CORNERS];
  REAL allowed[MOST_CORNERS], d[MOST_CORNERS + 1];
  ushort near[MOST_NEAR]; /* places in `list` of those that may hide something of the shooter from x */
  int n = (int)pair[1];
  for (int i = 0; i < n; i++) p[i] = clrad_minus(load_vector(vertex + 3 * (pair[0] + i)), x);
  REAL size = 0, whole = contour_of(p, n, normal, &size);
  /* Worse than 1e-9 in double and 1e-5 in float: the area form instead. */
#ifdef CLRAD_FP64
  const int careful = !(8 * CLRAD_EPSILON * size <= 1e-9 * whole);
#else
  const int careful = !(8 * CLRAD_EPSILON * size <= 1e-5f * whole);
#endif
  REAL sum = 0, lost = 0, terms = 0;
  if (last == 0) {
    sum = careful ? careful_of(p, n, normal) : whole;
    terms = careful ? sum : size;
  } else {
    pyramid_over(p, n, pyramid, allowed);
    uint nears = 0, unread = 0; /* of the list; when `near` is full the rest is read for each piece */
    for (; unread < last && unread < 65536u && nears < MOST_NEAR; unread++) {
      __global const uint* mine = occluder + OCCLUDER_WORDS * list[unread];
      if (!beyond_pyramid(pyramid, allowed, n, vertex + 3 * mine[0], mine[1], x)) near[nears++] = (ushort)unread;
    }
    const uint ends = nears + (last - unread);
    uint depth = 0, next = 0;
    for (int whole_piece = 1;; whole_piece = 0) {
      if (!whole_piece) pyramid_over(p, n, pyramid, allowed);
      while (n > 0 && next < ends) {
        const uint o = list[next < nears ? near[next] : unread + (next - nears)];
        __global const uint* mine = occluder + OCCLUDER_WORDS * o;
        const int tested = whole_piece && next < nears; /* by the filter above */
        next++;
        if (!tested && beyond_pyramid(pyramid, allowed, n, vertex + 3 * mine[0], mine[1], x)) continue;
        REAL products[MOST_SIDES];
        const int sides = shown_sides(occluder, side, plane, vertex, o, x, h, products);
        if (sides < 0 || beyond_side(p, n, h, sides)) continue;
        /* Each side cuts off what is beyond it, to wait on the stack; if nothing is left, nothing was hidden. */
        const uint depth_before = depth;
        const REAL lost_before = lost;
        int m = n, beyond = 0;
        for (int i = 0; i < n; i++) q[i] = p[i];
        for (int e = 0; e < sides && m > 0; e++) {
          const int where = heights_of(q, m, h[e], d);
          if (!(where & 1)) m = 0;
          if (where != 3) continue;
          int k = 0;
          cut_piece(q, m, d, r, &k, aside, &beyond);
          if (beyond > 0) {
            if (beyond > MOST_CORNERS || depth == capacity) {
              REAL ignored = 0;
              lost += careful ? careful_of(aside, beyond, normal) : contour_of(aside, beyond, normal, &ignored);
            } else {
              __global REAL* top = stack + PIECE_REALS * depth++;
              top[0] = (REAL)(64 * next + beyond);
              for (int i = 0; i < beyond; i++) {
                top[3 * i + 1] = aside[i].x;
                top[3 * i + 2] = aside[i].y;
                top[3 * i + 3] = aside[i].z;
              }
            }
          }
          if (k > MOST_CORNERS) {
            REAL ignored = 0;
            lost += careful ? careful_of(r, k, normal) : contour_of(r, k, normal, &ignored);
            k = -1; /* not empty, but given up */
          }
          m = k;
          for (int i = 0; i < m; i++) q[i] = r[i];
        }
        if (m == 0) {
          depth = depth_before;
          lost = lost_before;
          continue;
        }
        n = 0; /* what is left is inside the pyramid */
      }
      if (n > 0) {
        if (careful) {
          const REAL part = careful_of(p, n, normal);
          sum += part;
          terms += part;
        } else {
          sum += contour_of(p, n, normal, &terms);
        }
      }
      if (depth == 0) break;
      __global const REAL* top = stack + PIECE_REALS * --depth;
      const uint packed = (uint)top[0];
      n = (int)(packed & 63u);
      next = packed / 64u;
      for (int i = 0; i < n; i++) p[i] = load_vector(top + 1 + 3 * i);
    }
  }
  const REAL share = 1 / (2 * CLRAD_PI);
  *seen = sum > 0 ? sum * share : 0;
  *unsure = lost > 0 ? lost * share : 0;
  *rounding = 8 * CLRAD_EPSILON * terms * share;
  *free = whole > 0 ? whole * share : 0;
}

/* One work-item a Gauss point; points of cells [first_cell, ...), CELL_POINTS each. */
__kernel void cell_points(__global const uint* cells, uint first_cell, uint count, __global const REAL* quads,
                          __global const uint* pairs, __global const REAL* normals, __global const uint* occluder,
                          __global const uint* side, __global const REAL* plane, __global const REAL* vertex,
                          __global const uint* list, __global REAL* stack, uint capacity, __global REAL* out) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const uint* cell = cells + CELL_WORDS * (first_cell + i / CELL_POINTS);
  const uint node = i % CELL_POINTS, nu = node % NODES, nv = node / NODES;
  __global const REAL* quad = quads + 12 * cell[1];
  const clrad_vector c0 = load_vector(quad), c1 = load_vector(quad + 3), c2 = load_vector(quad + 6),
                     c3 = load_vector(quad + 9);
  const REAL width_u = 1 / (REAL)(1u << cell[4]), width_v = 1 / (REAL)(1u << cell[5]);
  const REAL u = ((REAL)cell[2] + node_at[nu]) * width_u, v = ((REAL)cell[3] + node_at[nv]) * width_v;
  const clrad_vector x = mixed(mixed(c0, c1, u), mixed(c3, c2, u), v);
  const clrad_vector along_u = mixed(clrad_minus(c1, c0), clrad_minus(c2, c3), v);
  const clrad_vector along_v = mixed(clrad_minus(c3, c0), clrad_minus(c2, c1), u);
  const clrad_vector area = clrad_cross(along_u, along_v);
  const REAL jacobian = sqrt(clrad_dot(area, area)) * (width_u * width_v);
  REAL seen, unsure, rounding, free;
  visible_factor(x, load_vector(normals + 3 * cell[0]), pairs + PAIR_WORDS * cell[0], list + cell[6], cell[7],
                 occluder, side, plane, vertex, stack + (ulong)i * capacity * PIECE_REALS, capacity, &seen, &unsure,
                 &rounding, &free);
  out[POINT_REALS * i] = seen * jacobian;
  out[POINT_REALS * i + 1] = unsure * jacobian;
  out[POINT_REALS * i + 2] = rounding * jacobian;
  out[POINT_REALS * i + 3] = free * jacobian;
}

/* What the two highest null rules leave, and how fast they fall, say how wrong Gauss' rule is. The rule is exact to degree
 * 9: for a smooth function whose coefficients fall by rho a degree, high / low is rho^-2 and the error rho^-6 x high; near
 * a kink they hardly fall, and the error is some part of high. least: the least part of high, for where kinks are. The host distrusts it where halving a cell shows more. */
REAL rule_error(REAL high, REAL low, REAL least) {
  if (!(high > 0)) return 0;
  const REAL ratio = high / low; /* inf when low = 0 */
  const REAL fall = ratio < CLRAD_R(0.2) ? ratio * 5 : (REAL)1, smooth = fall * fall * fall;
  return high * (smooth > least ? smooth : least);
}

/* One work-item a cell: results (value, unsure, error along u, along v, how much the integrand varies along u, along v,
 * what would be seen without occluders). `value` counts half of what is unsure. */
__kernel void cell_sums(__global const REAL* points, uint first_cell, uint count, REAL least, __global REAL* results) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const REAL* g = points + (ulong)i * CELL_POINTS * POINT_REALS;
  REAL value = 0, unsure = 0, rounding = 0, free = 0, error[2], varies[2];
  for (uint v = 0; v < NODES; v++)
    for (uint u = 0; u < NODES; u++) {
      const uint at = POINT_REALS * (NODES * v + u);
      const REAL w = node_weight[u] * node_weight[v];
      value += w * g[at];
      unsure += w * g[at + 1];
      rounding += w * g[at + 2];
      free += w * g[at + 3];
    }
  for (uint side = 0; side < 2; side++) {
    REAL high = 0, low = 0;
    for (uint line = 0; line < NODES; line++) {
      REAL c[4];
      for (uint k = 0; k < 4; k++) {
        c[k] = 0;
        for (uint node = 0; node < NODES; node++)
          c[k] += null_rule[k][node] * g[POINT_REALS * (side ? NODES * node + line : NODES * line + node)];
      }
      high += node_weight[line] * sqrt(c[3] * c[3] + c[2] * c[2]);
      low += node_weight[line] * sqrt(c[1] * c[1] + c[0] * c[0]);
    }
    error[side] = rule_error(high, low, least);
    varies[side] = high + low;
  }
  __global REAL* result = results + RESULT_REALS * (ulong)(first_cell + i);
  result[0] = value + unsure / 2;
  result[1] = unsure / 2;
  result[2] = error[0] + rounding;
  result[3] = error[1];
  result[4] = varies[0];
  result[5] = varies[1];
  result[6] = free;
}
