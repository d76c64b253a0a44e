/* Hulls of two boxes against the nodes of the tree of occluders (visibility/tree.cl): what lies outside is met by no segment between
 * the boxes (Haines & Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", 1991). */
#ifndef CLRAD_HULL_CL
#define CLRAD_HULL_CL
#include "shared/packet.cl"
#include "shared/triangle.cl"

#define TREE_DEPTH 64 /* Tree::most_depth */

#define WIDE 8 /* children of a node, see tree.cl */
#define WIDE_WORDS 64
#define STACK (7 * TREE_DEPTH + 1)

/* The hull of two boxes: the box around both, and slanted half-spaces that look along an axis, of which there are two for each axis
 * as a rule. A point is outside when nu p_u + nv p_v > h; of a box that is asked of its coordinate that lies farthest against the
 * half-space's direction: rows u and v of a node. */
typedef struct shaft {
  uint slants;
  uint u[12], v[12];
  float nu[12], nv[12], h[12];
  float low[3], high[3];
} shaft;

/* The box around a packet's positions: low x y z ., high x y z . */
static inline float8 box_of_lanes(clrad_floats x, clrad_floats y, clrad_floats z) {
  return (float8)(least_lane(x), least_lane(y), least_lane(z), 0, greatest_lane(x), greatest_lane(y), greatest_lane(z), 0);
}

/* Lane by lane, the coordinate of a box (low x y z ., high x y z .) that lies farthest in the lane's outward direction: signs are
 * + +, - +, + -, - - in (x, y), (y, z), (z, x). */
#define OUTER_U(b) ((b).s4040515162620000)
#define OUTER_V(b) ((b).s5511662244000000)
/* Positions are within 4 of the frame's middle and off by 2^-22 at most (their low parts), |nu| + |nv| = 1: a value is off by less
 * than 2^-19, and the rounding of nu and nv themselves does not matter. */
#define SHAFT_PAD 0x1p-18f

static inline shaft shaft_between(float8 a, float8 b) {
  const float16 su = (float16)(1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 0, 0, 0, 0);
  const float16 sv = (float16)(1, 1, -1, -1, 1, 1, -1, -1, 1, 1, -1, -1, 0, 0, 0, 0);
  const float16 au = OUTER_U(a), av = OUTER_V(a), bu = OUTER_U(b), bv = OUTER_V(b);
  /* The line through both boxes' corners of the lane's direction bounds them if its normal points that way, too. */
  const float16 du = bu - au, dv = bv - av, mu = fabs(du), mv = fabs(dv), size = (mu + mv) + 0x1p-60f;
  const int16 bounds = (du * su) * (dv * sv) < 0.0f;
  const float16 nu = mv / size * su, nv = mu / size * sv; /* (-dv, du) or its opposite */
  const float16 ha = nu * au + nv * av, hb = nu * bu + nv * bv, h = CLRAD_MAX(ha, hb) + SHAFT_PAD;
  float nus[16], nvs[16], hs[16];
  int there[16];
  vstore16(nu, 0, nus);
  vstore16(nv, 0, nvs);
  vstore16(h, 0, hs);
  vstore16(bounds, 0, there);
  shaft s;
  s.slants = 0;
  for (uint k = 0; k < 12; ++k) {
    if (!there[k]) continue;
    const uint axis = k / 4, next = axis == 2 ? 0 : axis + 1;
    s.u[s.slants] = (axis + (k & 1 ? 3 : 0)) * WIDE; /* outward is up: the low end is the last to leave */
    s.v[s.slants] = (next + (k & 2 ? 3 : 0)) * WIDE;
    s.nu[s.slants] = nus[k];
    s.nv[s.slants] = nvs[k];
    s.h[s.slants++] = hs[k];
  }
  s.low[0] = CLRAD_MIN(a.s0, b.s0) - SHAFT_PAD;
  s.low[1] = CLRAD_MIN(a.s1, b.s1) - SHAFT_PAD;
  s.low[2] = CLRAD_MIN(a.s2, b.s2) - SHAFT_PAD;
  s.high[0] = CLRAD_MAX(a.s4, b.s4) + SHAFT_PAD;
  s.high[1] = CLRAD_MAX(a.s5, b.s5) + SHAFT_PAD;
  s.high[2] = CLRAD_MAX(a.s6, b.s6) + SHAFT_PAD;
  return s;
}

static inline uint bits_of(int8 m) {
  const int8 lanes = m & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
#ifdef CLRAD_REDUCE_OR
  return (uint)__builtin_reduce_or(lanes);
#else
  const int4 a = lanes.lo | lanes.hi;
  const int2 b = a.lo | a.hi;
  return (uint)(b.x | b.y);
#endif
}

/* Bit k: child k of the node may meet the hull. */
static inline uint children_met(const shaft* s, __global const float* node) {
  int8 out = (vload8(0, node) > s->high[0]) | (vload8(3, node) < s->low[0]) | (vload8(1, node) > s->high[1]) |
             (vload8(4, node) < s->low[1]) | (vload8(2, node) > s->high[2]) | (vload8(5, node) < s->low[2]);
  for (uint k = 0; k < s->slants; ++k)
    out |= s->nu[k] * vload8(0, node + s->u[k]) + s->nv[k] * vload8(0, node + s->v[k]) > s->h[k];
  return bits_of(~out);
}

static inline uint lowest_bit(uint m) {
  return 31u - clz(m & (0u - m));
}

#endif
