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

/* The hull of two boxes: twelve slanted half-spaces, each seen along an axis, in lanes 0..11, and the box around both: x and y
 * in lanes 12..15, z beside. A point is outside when n . p > h. */
typedef struct shaft {
  float16 nu, nv, h;
  float low_z, high_z;
} shaft;

/* Lane by lane, the coordinate of a box (low x y z ., high x y z .) that lies farthest against the lane's outward direction:
 * signs are + +, - +, + -, - - in (x, y), (y, z), (z, x), then +x, -x, +y, -y. */
#define INNER_U(b) (float16)((b).s0404, (b).s1515, (b).s2626, (b).s0415)
#define INNER_V(b) (float16)((b).s1155, (b).s2266, (b).s0044, (b).s0000)
#define OUTER_U(b) (float16)((b).s4040, (b).s5151, (b).s6262, (b).s4051)
#define OUTER_V(b) (float16)((b).s5511, (b).s6622, (b).s4400, (b).s0000)
/* Positions are within 4 of the frame's middle and off by 2^-22 at most (their low parts), slants have length 1: a value n . p is
 * off by less than 2^-19, n's own rounding does not matter. */
#define SHAFT_PAD 0x1p-18f

static inline int any_of(int16 m) {
#ifdef CLRAD_REDUCE_OR
  return __builtin_reduce_or(m);
#else
  const int8 a = m.lo | m.hi;
  const int4 b = a.lo | a.hi;
  const int2 c = b.lo | b.hi;
  return c.x | c.y;
#endif
}

static inline shaft shaft_between(float8 a, float8 b) {
  const float16 su = (float16)(1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1);
  const float16 sv = (float16)(1, 1, -1, -1, 1, 1, -1, -1, 1, 1, -1, -1, 0, 0, 0, 0);
  const float16 au = OUTER_U(a), av = OUTER_V(a), bu = OUTER_U(b), bv = OUTER_V(b);
  /* The line through both boxes' corners of the lane's direction bounds them if its normal points that way, too. */
  const float16 du = bu - au, dv = bv - av, mu = fabs(du), mv = fabs(dv), size = (mu + mv) + 0x1p-60f;
  const float16 nu = mv / size, nv = mu / size; /* |normal|; it is (-dv, du) or its opposite */
  const int16 one = (-dv * su > 0.0f) & (du * sv > 0.0f), other = (dv * su > 0.0f) & (-du * sv > 0.0f);
  const int16 slanted = (int16)(-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0);
  shaft s;
  s.nu = slanted ? ((one | other) ? nu * su : (float16)(0.0f)) : su;
  s.nv = slanted & (one | other) ? nv * sv : (float16)(0.0f);
  const float16 ha = s.nu * au + s.nv * av, hb = s.nu * bu + s.nv * bv;
  s.h = CLRAD_MAX(ha, hb) + SHAFT_PAD;
  s.low_z = CLRAD_MIN(a.s2, b.s2) - SHAFT_PAD;
  s.high_z = CLRAD_MAX(a.s6, b.s6) + SHAFT_PAD;
  return s;
}

static inline int outside(const shaft* s, float8 box) {
  if (box.s2 > s->high_z || box.s6 < s->low_z) return 1;
  return any_of(s->nu * INNER_U(box) + s->nv * INNER_V(box) > s->h) != 0;
}

/* What a run of samples shares: their box as middle and half sides, one plane if it is all of theirs, else CLRAD_NONE. */
typedef struct sample_box {
  float x, y, z, hx, hy, hz;
  uint plane;
} sample_box;

/* The answers of two runs of segments that share receivers and samples; bits of `todo` are samples not known to be blocked. */
typedef struct question {
  clrad_floats ax, ay, az, ax_lo, ay_lo, az_lo;
  clrad_floats dx[32], dy[32], dz[32], size[32]; /* to each sample of the word */
  clrad_ints a_plane, todo;
  float a[6][CLRAD_WIDTH], b[6][32];
  int a_plane_lanes[CLRAD_WIDTH];
  uint b_plane[32];
  uint undecided_count;
} question;

/* A shooter's sample as the packets see it: the middle of the box, with lanes for receivers. */
typedef struct run {
  sample_box box;
  clrad_floats dx, dy, dz, size; /* to the box's middle; size: the greatest |component| of any sample's */
  uint begin, end;
} run;

/* Takes from q->todo what the triangle blocks of the samples [begin, end). */
static inline void ask_triangle(question* q, const run* r, __global const clrad_triangle* t, __global const clrad_facet* f) {
  const uint plane = t->plane;
  if (plane != CLRAD_NONE && plane == r->box.plane) return;
  clrad_ints open = q->todo;
  if (plane != CLRAD_NONE) open &= ~CLRAD_IS(q->a_plane == (int)plane);

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

  const int ask_sides = clrad_bits_of_any(open & ~crossed) != 0;
  const int needed = clrad_bits_of_any(open);
  clrad_ints blocked = 0, undecided = 0;
  for (uint k = r->begin; k < r->end; ++k) {
    const int bit = 1 << k;
    if ((needed & bit) == 0 || (plane != CLRAD_NONE && plane == q->b_plane[k])) continue;
    const clrad_floats dx = q->dx[k], dy = q->dy[k], dz = q->dz[k];
    const clrad_floats u0 = CLRAD_DOT(dx, dy, dz, c0x, c0y, c0z), u1 = CLRAD_DOT(dx, dy, dz, c1x, c1y, c1z),
                       u2 = CLRAD_DOT(dx, dy, dz, c2x, c2y, c2z);
    const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
    const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
    const clrad_floats error = q->size[k] * scale;
    clrad_ints miss = CLRAD_IS(least < -error) & CLRAD_IS(most > error);
    clrad_ints hit = CLRAD_IS(least > error) | CLRAD_IS(most < -error);
    if (ask_sides) {
      const float rx = CLRAD_DIFFERENCE(q->b[0][k], q->b[3][k], t->x0, t->x0_lo);
      const float ry = CLRAD_DIFFERENCE(q->b[1][k], q->b[4][k], t->y0, t->y0_lo);
      const float rz = CLRAD_DIFFERENCE(q->b[2][k], q->b[5][k], t->z0, t->z0_lo);
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
        const clrad_segment s = {q->a[0][lane], q->a[1][lane], q->a[2][lane], q->a[3][lane], q->a[4][lane],
                                 q->a[5][lane], q->b[0][k],    q->b[1][k],    q->b[2][k],    q->b[3][k],
                                 q->b[4][k],    q->b[5][k],    (uint)q->a_plane_lanes[lane], q->b_plane[k]};
        if (clrad_blocked(s, *t)) blocked_lanes[lane] |= 1 << k;
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
    low[c] = high[c] = q->a[c][0];
    for (uint lane = 1; lane < CLRAD_WIDTH; ++lane) {
      low[c] = CLRAD_MIN(low[c], q->a[c][lane]);
      high[c] = CLRAD_MAX(high[c], q->a[c][lane]);
    }
  }
  return (float8)(low[0], low[1], low[2], 0, high[0], high[1], high[2], 0);
}

static inline float8 run_of_samples(const question* q, uint begin, uint end, run* r) {
  float low[3], high[3];
  uint plane = q->b_plane[begin];
  for (uint c = 0; c < 3; ++c) low[c] = high[c] = q->b[c][begin];
  for (uint k = begin + 1; k < end; ++k) {
    for (uint c = 0; c < 3; ++c) {
      low[c] = CLRAD_MIN(low[c], q->b[c][k]);
      high[c] = CLRAD_MAX(high[c], q->b[c][k]);
    }
    plane = plane == q->b_plane[k] ? plane : CLRAD_NONE;
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

/* Walks the tree for one run of samples; ends early when all of its bits are known. */
static inline void walk(question* q, const run* r, const shaft* s, __global const uint* nodes,
                        __global const clrad_triangle* triangles, __global const clrad_facet* facets) {
  uint stack[TREE_DEPTH + 1];
  uint top = 0, node = 0;
  for (;;) {
    const float16 n = vload16(node, (__global const float*)nodes);
    const uint one = nodes[16 * node + 3], two = nodes[16 * node + 11];
    const uint in_one = nodes[16 * node + 7], in_two = nodes[16 * node + 15];
    const int go_one = !outside(s, n.lo), go_two = !outside(s, n.hi);
    if (go_one && in_one)
      for (uint i = one; i < one + in_one; ++i) ask_triangle(q, r, triangles + i, facets + i);
    if (go_two && in_two)
      for (uint i = two; i < two + in_two; ++i) ask_triangle(q, r, triangles + i, facets + i);
    if ((go_one && in_one) || (go_two && in_two)) {
      if (clrad_bits_of_any(q->todo) == 0) return;
    }
    const int down_one = go_one && !in_one, down_two = go_two && !in_two;
    if (down_one) {
      if (down_two) stack[top++] = two;
      node = one;
    } else if (down_two) {
      node = two;
    } else {
      if (top == 0) return;
      node = stack[--top];
    }
  }
}

/* Occlusion bits of CLRAD_WIDTH origins against 32 samples; work-item = (tile of origins, word of samples). Each run of at most
 * `run_length` samples has a shaft of its own.
 * pre: samples > 0, words = ceil(samples / 32). post: masks[origin * words + word], unused bits 0. */
__kernel void shaft_occluded(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                             uint origin_count, __global const CLRAD_POINT_T* targets, uint samples, uint words, uint run_length,
                             __global const uint* nodes, __global const clrad_triangle* triangles,
                             __global const clrad_facet* facets, __global uint* masks, volatile __global uint* exact) {
  const uint tiles = (origin_count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint tile = get_global_id(0) / words, word = get_global_id(0) % words;
  if (tile >= tiles) return;
  question q;
  int valid_lanes[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    uint chosen = tile * CLRAD_WIDTH + lane;
    valid_lanes[lane] = chosen < origin_count ? -1 : 0;
    chosen = chosen < origin_count ? chosen : origin_count - 1;
    __global const CLRAD_POINT_T* p = origins + (use_active ? active[chosen] : chosen);
    const clrad_segment s = clrad_make_segment(p, p);
    q.a[0][lane] = s.ax;
    q.a[1][lane] = s.ay;
    q.a[2][lane] = s.az;
    q.a[3][lane] = s.ax_lo;
    q.a[4][lane] = s.ay_lo;
    q.a[5][lane] = s.az_lo;
    q.a_plane_lanes[lane] = (int)s.a_plane;
  }
  q.ax = CLRAD_LOAD(q.a[0]);
  q.ay = CLRAD_LOAD(q.a[1]);
  q.az = CLRAD_LOAD(q.a[2]);
  q.ax_lo = CLRAD_LOAD(q.a[3]);
  q.ay_lo = CLRAD_LOAD(q.a[4]);
  q.az_lo = CLRAD_LOAD(q.a[5]);
  q.a_plane = CLRAD_LOAD(q.a_plane_lanes);
  q.undecided_count = 0;
  const clrad_ints valid = CLRAD_LOAD(valid_lanes);
  const float8 receivers = box_of_receivers(&q);

  const uint first = word * 32, in_word = min(samples - first, 32u);
  for (uint k = 0; k < in_word; ++k) {
    __global const CLRAD_POINT_T* p = targets + first + k;
    const clrad_segment s = clrad_make_segment(p, p);
    q.b[0][k] = s.ax;
    q.b[1][k] = s.ay;
    q.b[2][k] = s.az;
    q.b[3][k] = s.ax_lo;
    q.b[4][k] = s.ay_lo;
    q.b[5][k] = s.az_lo;
    q.b_plane[k] = s.a_plane;
    q.dx[k] = CLRAD_DIFFERENCE(s.ax, s.ax_lo, q.ax, q.ax_lo);
    q.dy[k] = CLRAD_DIFFERENCE(s.ay, s.ay_lo, q.ay, q.ay_lo);
    q.dz[k] = CLRAD_DIFFERENCE(s.az, s.az_lo, q.az, q.az_lo);
    const clrad_floats mx = fabs(q.dx[k]), my = fabs(q.dy[k]), mz = fabs(q.dz[k]), mxy = CLRAD_MAX(mx, my);
    q.size[k] = CLRAD_MAX(mxy, mz);
  }

  clrad_ints result = 0;
  for (uint begin = 0; begin < in_word; begin += run_length) {
    const uint end = min(begin + run_length, in_word);
    run r;
    const float8 there = run_of_samples(&q, begin, end, &r);
    const shaft s = shaft_between(receivers, there);
    const clrad_ints asked = valid & (int)((end == 32 ? 0xffffffffu : (1u << end) - 1) & ~((1u << begin) - 1));
    q.todo = asked;
    walk(&q, &r, &s, nodes, triangles, facets);
    result |= asked & ~q.todo;
  }

  int words_of_lanes[CLRAD_WIDTH];
  CLRAD_STORE(result, words_of_lanes);
  for (uint lane = 0; lane < CLRAD_WIDTH && tile * CLRAD_WIDTH + lane < origin_count; ++lane)
    masks[((ulong)tile * CLRAD_WIDTH + lane) * words + word] = (uint)words_of_lanes[lane];
  clrad_count(exact, q.undecided_count);
}

/* A packet of segments against boxes: origins and inverse directions, a lane each. Boxes are padded by PACKET_PAD: a ray's
 * origin is off by 2^-23 (its low part), its direction by 2u of at most 8, a crossing by 3u of the same. */
#define PACKET_PAD 0x1p-18f

static inline clrad_ints meets_box(const packet* p, clrad_floats ix, clrad_floats iy, clrad_floats iz, clrad_floats last,
                                   float8 box) {
  /* NaN, where a segment moves along a face, loses every comparison: that axis then says nothing. */
  const clrad_floats x0 = ((box.s0 - PACKET_PAD) - p->ax) * ix, x1 = ((box.s4 + PACKET_PAD) - p->ax) * ix;
  const clrad_floats y0 = ((box.s1 - PACKET_PAD) - p->ay) * iy, y1 = ((box.s5 + PACKET_PAD) - p->ay) * iy;
  const clrad_floats z0 = ((box.s2 - PACKET_PAD) - p->az) * iz, z1 = ((box.s6 + PACKET_PAD) - p->az) * iz;
  const clrad_floats near_x = CLRAD_MIN(x0, x1), near_y = CLRAD_MIN(y0, y1), near_z = CLRAD_MIN(z0, z1);
  const clrad_floats far_x = CLRAD_MAX(x0, x1), far_y = CLRAD_MAX(y0, y1), far_z = CLRAD_MAX(z0, z1);
  clrad_floats begin = 0.0f, end = last;
  begin = CLRAD_MAX(near_x, begin);
  begin = CLRAD_MAX(near_y, begin);
  begin = CLRAD_MAX(near_z, begin);
  end = CLRAD_MIN(far_x, end);
  end = CLRAD_MIN(far_y, end);
  end = CLRAD_MIN(far_z, end);
  return CLRAD_IS(begin <= end);
}

/* The next node of a packet's walk, or CLRAD_NONE at its end. Leaves come back with their triangles. */
typedef struct packet_walk {
  uint stack[2 * TREE_DEPTH + 2];
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
    const uint node = code >> 3;
    const float16 n = vload16(node, (__global const float*)nodes);
    const clrad_floats last = 1.0f;
    if (clrad_bits_of_any(meets_box(p, ix, iy, iz, last, n.hi) & live))
      w->stack[w->top++] = nodes[16 * node + 11] << 3 | nodes[16 * node + 15];
    if (clrad_bits_of_any(meets_box(p, ix, iy, iz, last, n.lo) & live))
      w->stack[w->top++] = nodes[16 * node + 3] << 3 | nodes[16 * node + 7];
  }
  return CLRAD_NONE;
}

/* Occlusion of pairs (Segments::samples == 0): origin i against target i; work-item = CLRAD_WIDTH segments.
 * post: masks[i] is 1 or 0. */
__kernel void shaft_occluded_pairs(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                                   uint origin_count, __global const CLRAD_POINT_T* targets, __global const uint* nodes,
                                   __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                   __global uint* masks, volatile __global uint* exact) {
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
  const clrad_floats ix = 1.0f / p.dx, iy = 1.0f / p.dy, iz = 1.0f / p.dz;
  clrad_ints live = CLRAD_LOAD(live_lanes), blocked = 0;
  uint undecided_count = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
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
  clrad_count(exact, undecided_count);
}

/* The nearest hit of each segment by (t, triangle); work-item = CLRAD_WIDTH consecutive segments of any form. Nothing ends
 * early: how near a hit is to say is one float formula for every engine (clrad_hit_parameter), and for a triangle seen edge-on
 * it may call one nearer that lies behind.
 * post: triangle[r] indexes the input triangles or is CLRAD_NONE, t[r] in [0, 1] (1 where there is none). */
__kernel void shaft_closest(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                            ulong segment_count, __global const CLRAD_POINT_T* targets, uint samples, __global const uint* nodes,
                            __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                            __global const uint* input_index, __global uint* triangle, __global float* t,
                            volatile __global uint* exact) {
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
  const clrad_floats ix = 1.0f / p.dx, iy = 1.0f / p.dy, iz = 1.0f / p.dz;
  uint undecided_count = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
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
  clrad_count(exact, undecided_count);
}
