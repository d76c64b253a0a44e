/* Visibility by shafts through a tree of boxes: a work-item takes CLRAD_WIDTH neighbouring receivers, one a lane, and a run
 * of samples of one shooter, and walks the tree with the hull of both boxes (Haines & Wallace, "Shaft Culling for Efficient
 * Ray-Traced Radiosity", 1991). What lies outside the hull is met by no segment; a triangle inside it is first held against
 * the samples' box as a whole: along the box its three volumes (shared/triangle.cl) are linear, so that their middle and
 * their reach say of each receiver that all samples are blocked, that none is, or that they must be asked one by one. What
 * floats cannot tell goes to the exact predicate. An empty hull leaves everything visible, and no ray was traced.
 *
 * Bits are those of `serial`: a segment meets a triangle only where the hull is, and every test has a bound of its error.
 */
#include "shared/packet.cl"
#include "shared/packet_test.cl"
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

/* Lane by lane, the coordinate of a box (low x y z ., high x y z .) that lies farthest in the lane's outward direction: signs are
 * + +, - +, + -, - - in (x, y), (y, z), (z, x). */
#define OUTER_U(b) (float16)((b).s4040, (b).s5151, (b).s6262, (b).s0000)
#define OUTER_V(b) (float16)((b).s5511, (b).s6622, (b).s4400, (b).s0000)
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

/* What a run of samples shares: their box as middle and half sides, one plane if it is all of theirs, else CLRAD_NONE. */
typedef struct sample_box {
  float x, y, z, hx, hy, hz;
  uint plane;
} sample_box;

/* The answers of two runs of segments that share receivers and samples; bits of `todo` are samples not known to be blocked. */
typedef struct question {
  clrad_floats ax, ay, az, ax_lo, ay_lo, az_lo;
  clrad_ints a_plane, todo;
  __global const uint *a, *b; /* ends of the tile and of the word, see shaft_ends */
  clrad_floats dx[32], dy[32], dz[32], size[32]; /* to each sample of the word, where have_directions */
  uint have_directions, undecided_count, loops, asked;
} question;

#define END_WORDS 7
#define A(q, c, lane) as_float((q)->a[(c)*CLRAD_WIDTH + (lane)])
#define A_PLANE(q, lane) ((q)->a[6 * CLRAD_WIDTH + (lane)])
#define B(q, c, k) as_float((q)->b[(c)*32 + (k)])
#define B_PLANE(q, k) ((q)->b[6 * 32 + (k)])

static inline clrad_segment segment_of(const question* q, uint lane, uint k) {
  const clrad_segment s = {A(q, 0, lane), A(q, 1, lane), A(q, 2, lane), A(q, 3, lane),    A(q, 4, lane),
                           A(q, 5, lane), B(q, 0, k),    B(q, 1, k),    B(q, 2, k),       B(q, 3, k),
                           B(q, 4, k),    B(q, 5, k),    A_PLANE(q, lane), B_PLANE(q, k)};
  return s;
}

/* A shooter's sample as the packets see it: the middle of the box, with lanes for receivers. */
typedef struct run {
  sample_box box;
  clrad_floats dx, dy, dz, size; /* to the box's middle; size: the greatest |component| of any sample's */
  uint begin, end;
} run;

static inline void direct(question* q, uint begin, uint end) {
  if (q->have_directions) return;
  q->have_directions = 1;
  for (uint k = begin; k < end; ++k) {
    q->dx[k] = CLRAD_DIFFERENCE(B(q, 0, k), B(q, 3, k), q->ax, q->ax_lo);
    q->dy[k] = CLRAD_DIFFERENCE(B(q, 1, k), B(q, 4, k), q->ay, q->ay_lo);
    q->dz[k] = CLRAD_DIFFERENCE(B(q, 2, k), B(q, 5, k), q->az, q->az_lo);
    const clrad_floats mx = fabs(q->dx[k]), my = fabs(q->dy[k]), mz = fabs(q->dz[k]), mxy = CLRAD_MAX(mx, my);
    q->size[k] = CLRAD_MAX(mxy, mz);
  }
}

/* Takes from q->todo what the triangle blocks of the samples [begin, end). */
static inline void ask_triangle(question* q, const run* r, __global const clrad_triangle* t, __global const clrad_facet* f) {
  ++q->asked;
  const uint plane = t->plane;
  if (plane != CLRAD_NONE && plane == r->box.plane) return;
  clrad_ints open = q->todo;
  if (plane != CLRAD_NONE) {
    open &= ~CLRAD_IS(q->a_plane == (int)plane);
    if (r->box.plane == CLRAD_NONE)
      for (uint k = r->begin; k < r->end; ++k) open &= plane == B_PLANE(q, k) ? ~(1 << k) : -1;
  }

  /* The samples' sides of the plane, all at once. */
  const float bx = (r->box.x - t->x0) - t->x0_lo, by = (r->box.y - t->y0) - t->y0_lo, bz = (r->box.z - t->z0) - t->z0_lo;
  const float side_b = CLRAD_DOT(f->nx, f->ny, f->nz, bx, by, bz);
  const float reach_b = (fabs(f->nx) * r->box.hx + fabs(f->ny) * r->box.hy) + fabs(f->nz) * r->box.hz;
  const float norm_b = CLRAD_NORM_1(bx, by, bz) + ((r->box.hx + r->box.hy) + r->box.hz);
  const float margin_b = reach_b + 2.0f * CLRAD_SIDE_BOUND(norm_b, f->normal_size);
  const int all_front_b = side_b > margin_b ? -1 : 0, all_back_b = side_b < -margin_b ? -1 : 0;

  const clrad_floats px = CLRAD_DIFFERENCE(t->x0, t->x0_lo, q->ax, q->ax_lo);
  const clrad_floats py = CLRAD_DIFFERENCE(t->y0, t->y0_lo, q->ay, q->ay_lo);
  const clrad_floats pz = CLRAD_DIFFERENCE(t->z0, t->z0_lo, q->az, q->az_lo);
  const clrad_floats norm_a = CLRAD_NORM_1(px, py, pz), error_a = CLRAD_SIDE_BOUND(norm_a, f->normal_size);
  const clrad_floats side_a = -CLRAD_DOT(f->nx, f->ny, f->nz, px, py, pz);
  const clrad_ints front_a = CLRAD_IS(side_a > error_a), back_a = CLRAD_IS(side_a < -error_a);
  open &= ~((front_a & all_front_b) | (back_a & all_back_b));
  if (clrad_bits_of_any(open) == 0) return;
  const clrad_ints crossed = (front_a & all_back_b) | (back_a & all_front_b); /* by every sample */

  const clrad_floats qx = CLRAD_DIFFERENCE(t->x1, t->x1_lo, q->ax, q->ax_lo);
  const clrad_floats qy = CLRAD_DIFFERENCE(t->y1, t->y1_lo, q->ay, q->ay_lo);
  const clrad_floats qz = CLRAD_DIFFERENCE(t->z1, t->z1_lo, q->az, q->az_lo);
  const clrad_floats c0x = CLRAD_CROSS(f->e0y, f->e0z, py, pz), c0y = CLRAD_CROSS(f->e0z, f->e0x, pz, px),
                     c0z = CLRAD_CROSS(f->e0x, f->e0y, px, py);
  const clrad_floats c1x = CLRAD_CROSS(f->e1y, f->e1z, qy, qz), c1y = CLRAD_CROSS(f->e1z, f->e1x, qz, qx),
                     c1z = CLRAD_CROSS(f->e1x, f->e1y, qx, qy);
  const clrad_floats c2x = CLRAD_CROSS(f->e2y, f->e2z, py, pz), c2y = CLRAD_CROSS(f->e2z, f->e2x, pz, px),
                     c2z = CLRAD_CROSS(f->e2x, f->e2y, px, py);
  const clrad_floats scale = CLRAD_VOLUME_SCALE(norm_a, f->edge_size);

  if (r->end - r->begin > 1) {
    /* A hit needs all volumes >= 0 where the receiver is in front, all <= 0 where it is behind: the sum of the three is minus the
     * normal times the direction. Over the box each is its value at the middle +- its reach. */
    const float hx = r->box.hx, hy = r->box.hy, hz = r->box.hz;
    const clrad_floats error = r->size * (2.0f * scale);
    const clrad_floats u0 = CLRAD_DOT(r->dx, r->dy, r->dz, c0x, c0y, c0z), u1 = CLRAD_DOT(r->dx, r->dy, r->dz, c1x, c1y, c1z),
                       u2 = CLRAD_DOT(r->dx, r->dy, r->dz, c2x, c2y, c2z);
    const clrad_floats w0 = ((fabs(c0x) * hx + fabs(c0y) * hy) + fabs(c0z) * hz) + error;
    const clrad_floats w1 = ((fabs(c1x) * hx + fabs(c1y) * hy) + fabs(c1z) * hz) + error;
    const clrad_floats w2 = ((fabs(c2x) * hx + fabs(c2y) * hy) + fabs(c2z) * hz) + error;
    const clrad_floats v0 = front_a ? u0 : -u0, v1 = front_a ? u1 : -u1, v2 = front_a ? u2 : -u2;
    const clrad_ints missed = (CLRAD_IS(v0 < -w0) | CLRAD_IS(v1 < -w1) | CLRAD_IS(v2 < -w2)) & (front_a | back_a);
    const clrad_ints blocked = CLRAD_IS(v0 > w0) & CLRAD_IS(v1 > w1) & CLRAD_IS(v2 > w2) & crossed & open;
    q->todo &= ~blocked;
    open &= ~(missed | blocked);
    if (clrad_bits_of_any(open) == 0) return;
  }

  ++q->loops;
  direct(q, r->begin, r->end);
  const int ask_sides = clrad_bits_of_any(open & ~crossed) != 0;
  const int needed = clrad_bits_of_any(open);
  clrad_ints blocked = 0, undecided = 0;
  for (uint k = r->begin; k < r->end; ++k) {
    const int bit = 1 << k;
    if ((needed & bit) == 0) continue;
    const clrad_floats dx = q->dx[k], dy = q->dy[k], dz = q->dz[k];
    const clrad_floats u0 = CLRAD_DOT(dx, dy, dz, c0x, c0y, c0z), u1 = CLRAD_DOT(dx, dy, dz, c1x, c1y, c1z),
                       u2 = CLRAD_DOT(dx, dy, dz, c2x, c2y, c2z);
    const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
    const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
    const clrad_floats error = q->size[k] * scale;
    clrad_ints miss = CLRAD_IS(least < -error) & CLRAD_IS(most > error);
    clrad_ints hit = CLRAD_IS(least > error) | CLRAD_IS(most < -error);
    if (ask_sides) {
      const float rx = CLRAD_DIFFERENCE(B(q, 0, k), B(q, 3, k), t->x0, t->x0_lo);
      const float ry = CLRAD_DIFFERENCE(B(q, 1, k), B(q, 4, k), t->y0, t->y0_lo);
      const float rz = CLRAD_DIFFERENCE(B(q, 2, k), B(q, 5, k), t->z0, t->z0_lo);
      const float norm = CLRAD_NORM_1(rx, ry, rz), bound = CLRAD_SIDE_BOUND(norm, f->normal_size);
      const float side = CLRAD_DOT(f->nx, f->ny, f->nz, rx, ry, rz);
      const int front = side > bound ? -1 : 0, back = side < -bound ? -1 : 0;
      miss |= (front_a & front) | (back_a & back);
      hit &= (front_a & back) | (back_a & front);
    }
    blocked |= hit & ~miss & bit;
    undecided |= ~(hit | miss) & bit;
  }
  blocked &= open;
  undecided &= open;
  if (clrad_bits_of_any(undecided) != 0) {
    int undecided_lanes[CLRAD_WIDTH], blocked_lanes[CLRAD_WIDTH];
    CLRAD_STORE(undecided, undecided_lanes);
    for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
      blocked_lanes[lane] = 0;
      if (undecided_lanes[lane] == 0) continue;
      for (uint k = r->begin; k < r->end; ++k) {
        if ((undecided_lanes[lane] & (1 << k)) == 0) continue;
        if (clrad_blocked(segment_of(q, lane, k), *t)) blocked_lanes[lane] |= 1 << k;
        ++q->undecided_count;
      }
    }
    blocked |= CLRAD_LOAD(blocked_lanes);
  }
  q->todo &= ~blocked;
}

static inline float8 box_of_receivers(const question* q) {
  float low[3], high[3];
  for (uint c = 0; c < 3; ++c) {
    low[c] = high[c] = A(q, c, 0);
    for (uint lane = 1; lane < CLRAD_WIDTH; ++lane) {
      low[c] = CLRAD_MIN(low[c], A(q, c, lane));
      high[c] = CLRAD_MAX(high[c], A(q, c, lane));
    }
  }
  return (float8)(low[0], low[1], low[2], 0, high[0], high[1], high[2], 0);
}

static inline float8 run_of_samples(const question* q, uint begin, uint end, run* r) {
  float low[3], high[3];
  uint plane = B_PLANE(q, begin);
  for (uint c = 0; c < 3; ++c) low[c] = high[c] = B(q, c, begin);
  for (uint k = begin + 1; k < end; ++k) {
    for (uint c = 0; c < 3; ++c) {
      low[c] = CLRAD_MIN(low[c], B(q, c, k));
      high[c] = CLRAD_MAX(high[c], B(q, c, k));
    }
    plane = plane == B_PLANE(q, k) ? plane : CLRAD_NONE;
  }
  float middle[3], half_side[3];
  for (uint c = 0; c < 3; ++c) {
    /* Low parts are below 2^-24 |hi|; the middle and the half are rounded once each. */
    middle[c] = 0.5f * (low[c] + high[c]);
    half_side[c] = 0.5f * (high[c] - low[c]) + 0x1p-22f * (fabs(low[c]) + fabs(high[c])) + 0x1p-100f;
  }
  const sample_box box = {middle[0], middle[1], middle[2], half_side[0], half_side[1], half_side[2], plane};
  r->box = box;
  r->begin = begin;
  r->end = end;
  r->dx = (middle[0] - q->ax) - q->ax_lo;
  r->dy = (middle[1] - q->ay) - q->ay_lo;
  r->dz = (middle[2] - q->az) - q->az_lo;
  const clrad_floats mx = fabs(r->dx) + box.hx, my = fabs(r->dy) + box.hy, mz = fabs(r->dz) + box.hz, mxy = CLRAD_MAX(mx, my);
  r->size = CLRAD_MAX(mxy, mz);
  return (float8)(low[0], low[1], low[2], 0, high[0], high[1], high[2], 0);
}

/* Walks the tree for one run of samples; ends early when all of its bits are known. 0 when that would take more than `budget`
 * triangles: the bits known by then are true all the same. */
static inline int walk(question* q, const run* r, const shaft* s, uint budget, __global const uint* nodes,
                       __global const clrad_triangle* triangles, __global const clrad_facet* facets) {
  uint stack[STACK];
  uint top = 1;
  stack[0] = 0;
  while (top > 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    uint met = children_met(s, (__global const float*)node);
    for (; met; met &= met - 1) {
      const uint code = node[6 * WIDE + lowest_bit(met)], in_leaf = code & 7u, first = code >> 3;
      if (in_leaf == 0) {
        stack[top++] = first;
        continue;
      }
      for (uint i = first; i < first + in_leaf; ++i) ask_triangle(q, r, triangles + i, facets + i);
      if (clrad_bits_of_any(q->todo) == 0) return 1;
      if (q->loops > budget) return 0;
    }
  }
  return 1;
}

/* One sample against the receivers that do not know yet: a packet of segments from it, walked box by box (slabs, Kay & Kajiya
 * 1986) where the lanes are and not where their hull is. What depends on the sample and the triangle alone is scalar: the tests
 * are those of shared/triangle.cl with the sample as a and D = receiver - sample, and the receivers' sides as
 *   S_b = S_a + N . D, off by E_S of both: 8u normal_size (|A|_1 + |D|_1).
 * Boxes are padded by PACKET_PAD: an origin is off by 2^-23 (its low part), a direction by 2u of at most 8, a crossing (a coordinate
 * and the origin, at most 4 each and rounded, times 1 / D, their sum rounded) by what moves the plane by 20u. Together that is
 * 2.3e-6 at most, and the pad 3.8e-6. */
#define PACKET_PAD 0x1p-18f

typedef struct sample_packet {
  float x, y, z, x_lo, y_lo, z_lo;
  clrad_floats dx, dy, dz, size, norm;
  uint plane;
  run alone; /* the sample as a run of one */
} sample_packet;

/* Lanes of `live` that the triangle blocks. */
static inline clrad_ints blocked_of_packet(question* q, const sample_packet* p, uint k, clrad_ints live,
                                           __global const clrad_triangle* t, __global const clrad_facet* f) {
  ++q->asked;
  const uint plane = t->plane;
  if (plane != CLRAD_NONE) {
    if (plane == p->plane) return 0;
    live &= ~CLRAD_IS(q->a_plane == (int)plane);
  }
  const float px = CLRAD_DIFFERENCE(t->x0, t->x0_lo, p->x, p->x_lo), py = CLRAD_DIFFERENCE(t->y0, t->y0_lo, p->y, p->y_lo),
              pz = CLRAD_DIFFERENCE(t->z0, t->z0_lo, p->z, p->z_lo);
  const float qx = CLRAD_DIFFERENCE(t->x1, t->x1_lo, p->x, p->x_lo), qy = CLRAD_DIFFERENCE(t->y1, t->y1_lo, p->y, p->y_lo),
              qz = CLRAD_DIFFERENCE(t->z1, t->z1_lo, p->z, p->z_lo);
  const float norm = CLRAD_NORM_1(px, py, pz), side_a = -CLRAD_DOT(f->nx, f->ny, f->nz, px, py, pz);
  const float error_a = CLRAD_SIDE_BOUND(norm, f->normal_size);
  const int front_a = side_a > error_a ? -1 : 0, back_a = side_a < -error_a ? -1 : 0;
  const clrad_floats side_b = side_a + CLRAD_DOT(f->nx, f->ny, f->nz, p->dx, p->dy, p->dz);
  const clrad_floats norm_b = p->norm + norm, error_b = CLRAD_SIDE_BOUND(norm_b, f->normal_size);
  const clrad_ints front_b = CLRAD_IS(side_b > error_b), back_b = CLRAD_IS(side_b < -error_b);
  live &= ~((front_b & front_a) | (back_b & back_a));

  const float c0x = CLRAD_CROSS(f->e0y, f->e0z, py, pz), c0y = CLRAD_CROSS(f->e0z, f->e0x, pz, px),
              c0z = CLRAD_CROSS(f->e0x, f->e0y, px, py);
  const float c1x = CLRAD_CROSS(f->e1y, f->e1z, qy, qz), c1y = CLRAD_CROSS(f->e1z, f->e1x, qz, qx),
              c1z = CLRAD_CROSS(f->e1x, f->e1y, qx, qy);
  const float c2x = CLRAD_CROSS(f->e2y, f->e2z, py, pz), c2y = CLRAD_CROSS(f->e2z, f->e2x, pz, px),
              c2z = CLRAD_CROSS(f->e2x, f->e2y, px, py);
  const clrad_floats u0 = CLRAD_DOT(p->dx, p->dy, p->dz, c0x, c0y, c0z), u1 = CLRAD_DOT(p->dx, p->dy, p->dz, c1x, c1y, c1z),
                     u2 = CLRAD_DOT(p->dx, p->dy, p->dz, c2x, c2y, c2z);
  const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
  const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
  const float scale = CLRAD_VOLUME_SCALE(norm, f->edge_size);
  const clrad_floats error = p->size * scale;
  live &= ~(CLRAD_IS(least < -error) & CLRAD_IS(most > error));
  if (clrad_bits_of_any(live) == 0) return 0;
  clrad_ints hit = (CLRAD_IS(least > error) | CLRAD_IS(most < -error)) & ((front_b & back_a) | (back_b & front_a)) & live;
  const clrad_ints undecided = live & ~hit;
  if (clrad_bits_of_any(undecided) != 0) {
    /* A triangle beside the receiver is told better from there: the bound grows with the distance. */
    const clrad_ints others = q->todo, bit = 1 << k;
    q->todo = undecided & bit;
    ask_triangle(q, &p->alone, t, f);
    hit |= undecided & CLRAD_IS((q->todo & bit) == 0);
    q->todo = others;
  }
  return hit;
}

/* Lanes whose segment may meet child k's box. */
typedef struct slabs {
  clrad_floats ix, iy, iz, low_x, low_y, low_z, high_x, high_y, high_z; /* crossings: coordinate * i + low or high */
} slabs;

/* 1 / d; where a segment does not move along the axis, so much that both crossings are far outside it unless it lies between
 * them, and no infinity whose difference would be none. Other components are 2^-38 at least. */
static inline clrad_floats inverse(clrad_floats d) {
  const clrad_floats none = 1e30f, one = 1.0f / d;
  return CLRAD_IS(d == 0.0f) ? none : one;
}

static inline slabs slabs_of(const sample_packet* p) {
  slabs s;
  s.ix = inverse(p->dx);
  s.iy = inverse(p->dy);
  s.iz = inverse(p->dz);
  s.low_x = -(p->x + PACKET_PAD) * s.ix;
  s.low_y = -(p->y + PACKET_PAD) * s.iy;
  s.low_z = -(p->z + PACKET_PAD) * s.iz;
  s.high_x = -(p->x - PACKET_PAD) * s.ix;
  s.high_y = -(p->y - PACKET_PAD) * s.iy;
  s.high_z = -(p->z - PACKET_PAD) * s.iz;
  return s;
}

static inline clrad_ints meets_padded(const slabs* s, __global const float* node, uint k) {
  const clrad_floats x0 = node[k] * s->ix + s->low_x, x1 = node[3 * WIDE + k] * s->ix + s->high_x;
  const clrad_floats y0 = node[WIDE + k] * s->iy + s->low_y, y1 = node[4 * WIDE + k] * s->iy + s->high_y;
  const clrad_floats z0 = node[2 * WIDE + k] * s->iz + s->low_z, z1 = node[5 * WIDE + k] * s->iz + s->high_z;
  const clrad_floats near_x = CLRAD_MIN(x0, x1), near_y = CLRAD_MIN(y0, y1), near_z = CLRAD_MIN(z0, z1);
  const clrad_floats far_x = CLRAD_MAX(x0, x1), far_y = CLRAD_MAX(y0, y1), far_z = CLRAD_MAX(z0, z1);
  clrad_floats begin = 0.0f, end = 1.0f;
  begin = CLRAD_MAX(near_x, begin);
  begin = CLRAD_MAX(near_y, begin);
  begin = CLRAD_MAX(near_z, begin);
  end = CLRAD_MIN(far_x, end);
  end = CLRAD_MIN(far_y, end);
  end = CLRAD_MIN(far_z, end);
  return CLRAD_IS(begin <= end);
}

/* Triangles that blocked some segment most recently, the last first: they are tried first, for neighbours are blocked by the same. */
#define RECENT 4

static inline void remember(uint* recent, uint triangle) {
  uint k = 0;
  while (k < RECENT - 1 && recent[k] != triangle) ++k;
  for (; k > 0; --k) recent[k] = recent[k - 1];
  recent[0] = triangle;
}

/* Asks sample k of the receivers that have its bit in todo. */
static inline void walk_packet(question* q, uint k, float8 receivers, uint* recent, __global const uint* nodes,
                               __global const clrad_triangle* triangles, __global const clrad_facet* facets) {
  const clrad_ints asked = CLRAD_IS((q->todo & (1 << k)) != 0);
  if (clrad_bits_of_any(asked) == 0) return;
  sample_packet p;
  p.x = B(q, 0, k);
  p.y = B(q, 1, k);
  p.z = B(q, 2, k);
  p.x_lo = B(q, 3, k);
  p.y_lo = B(q, 4, k);
  p.z_lo = B(q, 5, k);
  p.dx = -q->dx[k];
  p.dy = -q->dy[k];
  p.dz = -q->dz[k];
  p.size = q->size[k];
  p.norm = CLRAD_NORM_1(p.dx, p.dy, p.dz);
  p.plane = B_PLANE(q, k);
  run_of_samples(q, k, k + 1, &p.alone);
  clrad_ints live = asked;
  for (uint i = 0; i < RECENT && recent[i] != CLRAD_NONE; ++i) {
    const clrad_ints hit = blocked_of_packet(q, &p, k, live, triangles + recent[i], facets + recent[i]);
    live &= ~hit;
    if (clrad_bits_of_any(live) == 0) break;
  }
  const slabs lanes = slabs_of(&p);
  const shaft s = shaft_between(receivers, (float8)(p.x, p.y, p.z, 0, p.x, p.y, p.z, 0));
  uint stack[STACK];
  uint top = 1;
  stack[0] = 0;
  while (top > 0 && clrad_bits_of_any(live) != 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    __global const float* boxes = (__global const float*)node;
    uint met = children_met(&s, boxes);
    for (; met; met &= met - 1) {
      const uint child = lowest_bit(met), code = node[6 * WIDE + child], in_leaf = code & 7u, first = code >> 3;
      if (clrad_bits_of_any(meets_padded(&lanes, boxes, child) & live) == 0) continue;
      if (in_leaf == 0) {
        stack[top++] = first;
        continue;
      }
      for (uint i = first; i < first + in_leaf; ++i) {
        const clrad_ints hit = blocked_of_packet(q, &p, k, live, triangles + i, facets + i);
        if (clrad_bits_of_any(hit) == 0) continue;
        live &= ~hit;
        remember(recent, i);
      }
    }
  }
  q->todo &= ~(asked & ~live & (1 << k));
}

/* Ends on the visibility grid, once for all the work-items that read them: in groups of `size`, END_WORDS runs of that many words
 * each (x y z, their low parts, plane); the last group is filled up with the last end. Work-item: an end. */
__kernel void shaft_ends(__global const CLRAD_POINT_T* points, __global const uint* active, uint use_active, uint count,
                         uint size, __global uint* ends) {
  const uint i = get_global_id(0);
  if (i >= (count + size - 1) / size * size) return;
  const uint chosen = min(i, count - 1);
  __global const CLRAD_POINT_T* p = points + (use_active ? active[chosen] : chosen);
  const clrad_end s = clrad_snap_point(p);
  __global uint* e = ends + (ulong)(i / size) * END_WORDS * size + i % size;
  e[0] = as_uint(s.x);
  e[size] = as_uint(s.y);
  e[2 * size] = as_uint(s.z);
  e[3 * size] = as_uint(s.x_lo);
  e[4 * size] = as_uint(s.y_lo);
  e[5 * size] = as_uint(s.z_lo);
  e[6 * size] = s.plane;
}

/* Occlusion bits of CLRAD_WIDTH origins against 32 samples; work-item = (tile of origins, word of samples), for the tiles whose
 * numbers are from `from` to below `to` modulo PERIOD. Each run of at most `run_length` samples has a shaft of its own; one that
 * meets more than `budget` triangles that need every sample is given up for packets, and with a budget of 0 there are packets only.
 * origins, samples: ends in groups of CLRAD_WIDTH and of 32. counts: exact tests, then pairs of a receiver and a triangle looked at.
 * pre: samples > 0, words = ceil(samples / 32). post: masks[origin * words + word], unused bits 0. */
#define PERIOD 16

__kernel void shaft_occluded(__global const uint* origins, uint origin_count, uint from, uint to,
                             __global const uint* targets, uint samples, uint words, uint run_length, uint budget,
                             __global const uint* nodes,
                             __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                             __global uint* masks, volatile __global uint* counts) {
  const uint tiles = (origin_count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint number = get_global_id(0) / words, word = get_global_id(0) % words;
  const uint tile = number / (to - from) * PERIOD + from + number % (to - from);
  if (tile >= tiles) return;
  question q;
  q.a = origins + (ulong)tile * END_WORDS * CLRAD_WIDTH;
  q.b = targets + (ulong)word * END_WORDS * 32;
  __global const float* a = (__global const float*)q.a;
  q.ax = CLRAD_LOAD(a);
  q.ay = CLRAD_LOAD(a + CLRAD_WIDTH);
  q.az = CLRAD_LOAD(a + 2 * CLRAD_WIDTH);
  q.ax_lo = CLRAD_LOAD(a + 3 * CLRAD_WIDTH);
  q.ay_lo = CLRAD_LOAD(a + 4 * CLRAD_WIDTH);
  q.az_lo = CLRAD_LOAD(a + 5 * CLRAD_WIDTH);
  q.a_plane = CLRAD_LOAD((__global const int*)q.a + 6 * CLRAD_WIDTH);
  q.undecided_count = q.asked = 0;
  const clrad_ints valid = CLRAD_IS(CLRAD_LANES < (int)(origin_count - tile * CLRAD_WIDTH));
  const float8 receivers = box_of_receivers(&q);

  const uint in_word = min(samples - word * 32, 32u);
  clrad_ints result = 0;
  uint recent[RECENT];
  for (uint i = 0; i < RECENT; ++i) recent[i] = CLRAD_NONE;
  for (uint begin = 0; begin < in_word; begin += run_length) {
    const uint end = min(begin + run_length, in_word);
    const clrad_ints asked = valid & (int)((end == 32 ? 0xffffffffu : (1u << end) - 1) & ~((1u << begin) - 1));
    q.todo = asked;
    q.have_directions = q.loops = 0;
    int done = 0;
    if (budget > 0) {
      run r;
      const float8 there = run_of_samples(&q, begin, end, &r);
      const shaft s = shaft_between(receivers, there);
      done = walk(&q, &r, &s, budget, nodes, triangles, facets);
    }
    if (!done) {
      direct(&q, begin, end);
      for (uint k = begin; k < end; ++k) walk_packet(&q, k, receivers, recent, nodes, triangles, facets);
    }
    result |= asked & ~q.todo;
  }

  int words_of_lanes[CLRAD_WIDTH];
  CLRAD_STORE(result, words_of_lanes);
  for (uint lane = 0; lane < CLRAD_WIDTH && tile * CLRAD_WIDTH + lane < origin_count; ++lane)
    masks[((ulong)tile * CLRAD_WIDTH + lane) * words + word] = (uint)words_of_lanes[lane];
  clrad_count(counts, q.undecided_count);
  clrad_count(counts + 2, q.asked * CLRAD_WIDTH);
}

/* A packet of segments that have nothing in common: origins and inverse directions, a lane each. */
static inline clrad_ints meets_box(const packet* p, clrad_floats ix, clrad_floats iy, clrad_floats iz,
                                   __global const float* node, uint k) {
  const clrad_floats x0 = ((node[k] - PACKET_PAD) - p->ax) * ix, x1 = ((node[3 * WIDE + k] + PACKET_PAD) - p->ax) * ix;
  const clrad_floats y0 = ((node[WIDE + k] - PACKET_PAD) - p->ay) * iy,
                     y1 = ((node[4 * WIDE + k] + PACKET_PAD) - p->ay) * iy;
  const clrad_floats z0 = ((node[2 * WIDE + k] - PACKET_PAD) - p->az) * iz,
                     z1 = ((node[5 * WIDE + k] + PACKET_PAD) - p->az) * iz;
  const clrad_floats near_x = CLRAD_MIN(x0, x1), near_y = CLRAD_MIN(y0, y1), near_z = CLRAD_MIN(z0, z1);
  const clrad_floats far_x = CLRAD_MAX(x0, x1), far_y = CLRAD_MAX(y0, y1), far_z = CLRAD_MAX(z0, z1);
  clrad_floats begin = 0.0f, end = 1.0f;
  begin = CLRAD_MAX(near_x, begin);
  begin = CLRAD_MAX(near_y, begin);
  begin = CLRAD_MAX(near_z, begin);
  end = CLRAD_MIN(far_x, end);
  end = CLRAD_MIN(far_y, end);
  end = CLRAD_MIN(far_z, end);
  return CLRAD_IS(begin <= end);
}

/* A packet's walk: next_leaf gives leaf after leaf, its first triangle and how many there are, and CLRAD_NONE at the end. */
typedef struct packet_walk {
  uint stack[STACK + WIDE];
  uint top;
} packet_walk;

static inline uint next_leaf(packet_walk* w, const packet* p, clrad_floats ix, clrad_floats iy, clrad_floats iz,
                             clrad_ints live, __global const uint* nodes, uint* triangles) {
  while (w->top > 0) {
    const uint code = w->stack[--w->top];
    if (code & 7u) {
      *triangles = code & 7u;
      return code >> 3;
    }
    __global const uint* node = nodes + (ulong)WIDE_WORDS * (code >> 3);
    for (uint k = 0; k < WIDE; ++k) { /* the root is nobody's child: a code of 0 is a child that is not there */
      const uint child = node[6 * WIDE + k];
      if (child && clrad_bits_of_any(meets_box(p, ix, iy, iz, (__global const float*)node, k) & live)) w->stack[w->top++] = child;
    }
  }
  return CLRAD_NONE;
}

/* Occlusion of pairs (Segments::samples == 0): origin i against target i; work-item = CLRAD_WIDTH segments.
 * post: masks[i] is 1 or 0. */
__kernel void shaft_occluded_pairs(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                                   uint origin_count, __global const CLRAD_POINT_T* targets, __global const uint* nodes,
                                   __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                   __global uint* masks, volatile __global uint* counts) {
  const uint begin = get_global_id(0) * CLRAD_WIDTH;
  if (begin >= origin_count) return;
  clrad_segment s[CLRAD_WIDTH];
  int live_lanes[CLRAD_WIDTH], hits[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    s[lane] = clrad_fetch_segment(origins, active, use_active, targets, 0, min(begin + lane, origin_count - 1));
    live_lanes[lane] = begin + lane < origin_count ? -1 : 0;
  }
  packet p;
  load_packet(s, &p);
  const clrad_floats ix = inverse(p.dx), iy = inverse(p.dy), iz = inverse(p.dz);
  clrad_ints live = CLRAD_LOAD(live_lanes), blocked = 0;
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
      ++asked;
      hit &= live;
      undecided &= live;
      if (clrad_bits_of_any(undecided) != 0) {
        int undecided_lanes[CLRAD_WIDTH];
        CLRAD_STORE(undecided, undecided_lanes);
        for (int lane = 0; lane < CLRAD_WIDTH; ++lane) {
          hits[lane] = 0;
          if (!undecided_lanes[lane]) continue;
          hits[lane] = clrad_blocked(s[lane], triangles[i]) ? -1 : 0;
          ++undecided_count;
        }
        hit |= CLRAD_LOAD(hits);
      }
      blocked |= hit;
      live &= ~hit;
      if (clrad_bits_of_any(live) == 0) w.top = 0;
    }
  CLRAD_STORE(blocked, hits);
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < origin_count; ++lane) masks[begin + lane] = hits[lane] & 1;
  clrad_count(counts, undecided_count);
  clrad_count(counts + 2, asked * CLRAD_WIDTH);
}

/* The nearest hit of each segment by (t, triangle); work-item = CLRAD_WIDTH consecutive segments of any form. Nothing ends
 * early: how near a hit is to say is one float formula for every engine (clrad_hit_parameter), and for a triangle seen edge-on
 * it may call one nearer that lies behind.
 * post: triangle[r] indexes the input triangles or is CLRAD_NONE, t[r] in [0, 1] (1 where there is none). */
__kernel void shaft_closest(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                            ulong segment_count, __global const CLRAD_POINT_T* targets, uint samples, __global const uint* nodes,
                            __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                            __global const uint* input_index, __global uint* triangle, __global float* t,
                            volatile __global uint* counts) {
  const ulong begin = (ulong)get_global_id(0) * CLRAD_WIDTH;
  if (begin >= segment_count) return;
  clrad_segment s[CLRAD_WIDTH];
  float nearest[CLRAD_WIDTH];
  uint which[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    const ulong r = begin + lane < segment_count ? begin + lane : segment_count - 1;
    s[lane] = clrad_fetch_segment(origins, active, use_active, targets, samples, r);
    nearest[lane] = 1.0f;
    which[lane] = CLRAD_NONE;
  }
  packet p;
  load_packet(s, &p);
  const clrad_floats ix = inverse(p.dx), iy = inverse(p.dy), iz = inverse(p.dz);
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
      ++asked;
      if (clrad_bits_of_any(hit | undecided) == 0) continue;
      int hits[CLRAD_WIDTH], undecided_lanes[CLRAD_WIDTH];
      CLRAD_STORE(hit, hits);
      CLRAD_STORE(undecided, undecided_lanes);
      for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < segment_count; ++lane) {
        int met = hits[lane];
        if (undecided_lanes[lane]) {
          met = clrad_blocked(s[lane], triangles[i]);
          ++undecided_count;
        }
        if (!met) continue;
        const float where = clrad_hit_parameter(s[lane], triangles[i], facets[i]);
        if (which[lane] == CLRAD_NONE || where < nearest[lane] || (where == nearest[lane] && input_index[i] < which[lane])) {
          nearest[lane] = where;
          which[lane] = input_index[i];
        }
      }
    }
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < segment_count; ++lane) {
    triangle[begin + lane] = which[lane];
    t[begin + lane] = nearest[lane];
  }
  clrad_count(counts, undecided_count);
  clrad_count(counts + 2, asked * CLRAD_WIDTH);
}
