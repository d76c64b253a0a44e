/* Which segments of CLRAD_WIDTH receivers and a run of samples a triangle blocks, the samples held against it as a whole first.
 *
 * With a the receiver and b a sample, the volumes U_i = D . (e_i x A_i) of shared/triangle.cl are linear in b: over the samples' box
 * each is its value at the middle +- sum_k |(e_i x A_i)_k| h_k, h the half sides. Its error is below twice E_U with |D|_max the
 * greatest of any sample: 10u of the middle and the box, and 3u more for the reach's own rounding, of |e|_1 |A|_1 each. The samples'
 * side of the plane likewise. */
#ifndef CLRAD_QUESTION_CL
#define CLRAD_QUESTION_CL
#include "shared/packet.cl"
#include "shared/triangle.cl"

/* What a run of samples shares: their box as middle and half sides, one plane if it is all of theirs, else CLRAD_NONE. */
typedef struct sample_box {
  float x, y, z, hx, hy, hz;
  uint plane;
} sample_box;

/* CLRAD_WIDTH receivers, one a lane, and a word of 32 samples; bits of `todo` are samples not known to be blocked. */
typedef struct question {
  clrad_floats ax, ay, az, ax_lo, ay_lo, az_lo;
  clrad_ints a_plane, todo;
  __global const uint *a, *b; /* ends of the tile and of the word, see shaft_ends */
  clrad_floats dx[32], dy[32], dz[32], size[32]; /* to each sample of the word, where have_directions */
  uint have_directions, undecided_count, loops;
  /* For accounts: nodes visited, boxes of their children held against each lane, triangles that the shaft and that packets asked. */
  uint nodes, boxes, asked, asked_alone;
} question;

#define END_WORDS 7
#define RECEIVER(q, c, lane) as_float((q)->a[(c)*CLRAD_WIDTH + (lane)])
#define RECEIVER_PLANE(q, lane) ((q)->a[6 * CLRAD_WIDTH + (lane)])
#define SAMPLE(q, c, k) as_float((q)->b[(c)*32 + (k)])
#define SAMPLE_PLANE(q, k) ((q)->b[6 * 32 + (k)])

static inline clrad_segment segment_of(const question* q, uint lane, uint k) {
  const clrad_segment s = {RECEIVER(q, 0, lane), RECEIVER(q, 1, lane), RECEIVER(q, 2, lane), RECEIVER(q, 3, lane),    RECEIVER(q, 4, lane),
                           RECEIVER(q, 5, lane), SAMPLE(q, 0, k),    SAMPLE(q, 1, k),    SAMPLE(q, 2, k),       SAMPLE(q, 3, k),
                           SAMPLE(q, 4, k),    SAMPLE(q, 5, k),    RECEIVER_PLANE(q, lane), SAMPLE_PLANE(q, k)};
  return s;
}

/* Neighbouring samples [begin, end) of the word, and their box as the receivers see it. */
typedef struct run {
  sample_box box;
  clrad_floats dx, dy, dz, size; /* to the box's middle; size: the greatest |component| of any sample's */
  uint begin, end;
} run;

static inline void direct(question* q, uint begin, uint end) {
  if (q->have_directions) return;
  q->have_directions = 1;
  for (uint k = begin; k < end; ++k) {
    q->dx[k] = CLRAD_DIFFERENCE(SAMPLE(q, 0, k), SAMPLE(q, 3, k), q->ax, q->ax_lo);
    q->dy[k] = CLRAD_DIFFERENCE(SAMPLE(q, 1, k), SAMPLE(q, 4, k), q->ay, q->ay_lo);
    q->dz[k] = CLRAD_DIFFERENCE(SAMPLE(q, 2, k), SAMPLE(q, 5, k), q->az, q->az_lo);
    const clrad_floats mx = fabs(q->dx[k]), my = fabs(q->dy[k]), mz = fabs(q->dz[k]), mxy = CLRAD_MAX(mx, my);
    q->size[k] = CLRAD_MAX(mxy, mz);
  }
}

/* The ends of a packet of receivers and of a word of samples, as shaft_ends makes them; nothing asked of them yet. */
static inline void begin_question(question* q, __global const uint* receivers, __global const uint* samples) {
  q->a = receivers;
  q->b = samples;
  __global const float* a = (__global const float*)receivers;
  q->ax = CLRAD_LOAD(a);
  q->ay = CLRAD_LOAD(a + CLRAD_WIDTH);
  q->az = CLRAD_LOAD(a + 2 * CLRAD_WIDTH);
  q->ax_lo = CLRAD_LOAD(a + 3 * CLRAD_WIDTH);
  q->ay_lo = CLRAD_LOAD(a + 4 * CLRAD_WIDTH);
  q->az_lo = CLRAD_LOAD(a + 5 * CLRAD_WIDTH);
  q->a_plane = CLRAD_LOAD((__global const int*)receivers + 6 * CLRAD_WIDTH);
  q->have_directions = q->undecided_count = q->loops = 0;
  q->nodes = q->boxes = q->asked = q->asked_alone = 0;
}

/* e_i x A_i of the triangle's edges, whose products with a direction are its volumes U_i. */
typedef struct edge_crosses {
  clrad_floats x0, y0, z0, x1, y1, z1, x2, y2, z2;
} edge_crosses;

/* p: A_0, from each receiver to the triangle's first corner. */
static inline edge_crosses crosses_of(const question* q, __global const clrad_triangle* t, __global const clrad_facet* f,
                                      clrad_floats px, clrad_floats py, clrad_floats pz) {
  const clrad_floats qx = CLRAD_DIFFERENCE(t->x1, t->x1_lo, q->ax, q->ax_lo);
  const clrad_floats qy = CLRAD_DIFFERENCE(t->y1, t->y1_lo, q->ay, q->ay_lo);
  const clrad_floats qz = CLRAD_DIFFERENCE(t->z1, t->z1_lo, q->az, q->az_lo);
  const edge_crosses c = {CLRAD_CROSS(f->e0y, f->e0z, py, pz), CLRAD_CROSS(f->e0z, f->e0x, pz, px), CLRAD_CROSS(f->e0x, f->e0y, px, py),
                          CLRAD_CROSS(f->e1y, f->e1z, qy, qz), CLRAD_CROSS(f->e1z, f->e1x, qz, qx), CLRAD_CROSS(f->e1x, f->e1y, qx, qy),
                          CLRAD_CROSS(f->e2y, f->e2z, py, pz), CLRAD_CROSS(f->e2z, f->e2x, pz, px), CLRAD_CROSS(f->e2x, f->e2y, px, py)};
  return c;
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
      for (uint k = r->begin; k < r->end; ++k) open &= plane == SAMPLE_PLANE(q, k) ? ~(1 << k) : -1;
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

  const edge_crosses c = crosses_of(q, t, f, px, py, pz);
  const clrad_floats scale = CLRAD_VOLUME_SCALE(norm_a, f->edge_size);

  if (r->end - r->begin > 1) {
    /* A hit needs all volumes >= 0 where the receiver is in front, all <= 0 where it is behind: the sum of the three is minus the
     * normal times the direction. Over the box each is its value at the middle +- its reach. */
    const float hx = r->box.hx, hy = r->box.hy, hz = r->box.hz;
    const clrad_floats error = r->size * (2.0f * scale);
    const clrad_floats u0 = CLRAD_DOT(r->dx, r->dy, r->dz, c.x0, c.y0, c.z0), u1 = CLRAD_DOT(r->dx, r->dy, r->dz, c.x1, c.y1, c.z1),
                       u2 = CLRAD_DOT(r->dx, r->dy, r->dz, c.x2, c.y2, c.z2);
    const clrad_floats w0 = ((fabs(c.x0) * hx + fabs(c.y0) * hy) + fabs(c.z0) * hz) + error;
    const clrad_floats w1 = ((fabs(c.x1) * hx + fabs(c.y1) * hy) + fabs(c.z1) * hz) + error;
    const clrad_floats w2 = ((fabs(c.x2) * hx + fabs(c.y2) * hy) + fabs(c.z2) * hz) + error;
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
    const clrad_floats u0 = CLRAD_DOT(dx, dy, dz, c.x0, c.y0, c.z0), u1 = CLRAD_DOT(dx, dy, dz, c.x1, c.y1, c.z1),
                       u2 = CLRAD_DOT(dx, dy, dz, c.x2, c.y2, c.z2);
    const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
    const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
    const clrad_floats error = q->size[k] * scale;
    clrad_ints miss = CLRAD_IS(least < -error) & CLRAD_IS(most > error);
    clrad_ints hit = CLRAD_IS(least > error) | CLRAD_IS(most < -error);
    if (ask_sides) {
      const float rx = CLRAD_DIFFERENCE(SAMPLE(q, 0, k), SAMPLE(q, 3, k), t->x0, t->x0_lo);
      const float ry = CLRAD_DIFFERENCE(SAMPLE(q, 1, k), SAMPLE(q, 4, k), t->y0, t->y0_lo);
      const float rz = CLRAD_DIFFERENCE(SAMPLE(q, 2, k), SAMPLE(q, 5, k), t->z0, t->z0_lo);
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

/* The box of the samples [begin, end) of the word whose ends are at b: low x y z, their plane, high x y z, 0. */
static inline float8 box_of_samples(__global const uint* b, uint begin, uint end) {
  float low[3], high[3];
  uint plane = b[6 * 32 + begin];
  for (uint c = 0; c < 3; ++c) low[c] = high[c] = as_float(b[c * 32 + begin]);
  for (uint k = begin + 1; k < end; ++k) {
    for (uint c = 0; c < 3; ++c) {
      const float x = as_float(b[c * 32 + k]);
      low[c] = CLRAD_MIN(low[c], x);
      high[c] = CLRAD_MAX(high[c], x);
    }
    plane = plane == b[6 * 32 + k] ? plane : CLRAD_NONE;
  }
  return (float8)(low[0], low[1], low[2], as_float(plane), high[0], high[1], high[2], 0);
}

/* Samples [begin, end) of the word, whose box is `there`. */
static inline void run_in(const question* q, float8 there, uint begin, uint end, run* r) {
  const float low[3] = {there.s0, there.s1, there.s2}, high[3] = {there.s4, there.s5, there.s6};
  float middle[3], half_side[3];
  for (uint c = 0; c < 3; ++c) {
    /* Low parts are below 2^-24 |hi|; the middle and the half are rounded once each. */
    middle[c] = 0.5f * (low[c] + high[c]);
    half_side[c] = 0.5f * (high[c] - low[c]) + 0x1p-22f * (fabs(low[c]) + fabs(high[c])) + 0x1p-100f;
  }
  const sample_box box = {middle[0], middle[1], middle[2], half_side[0], half_side[1], half_side[2], as_uint(there.s3)};
  r->box = box;
  r->begin = begin;
  r->end = end;
  r->dx = (middle[0] - q->ax) - q->ax_lo;
  r->dy = (middle[1] - q->ay) - q->ay_lo;
  r->dz = (middle[2] - q->az) - q->az_lo;
  const clrad_floats mx = fabs(r->dx) + box.hx, my = fabs(r->dy) + box.hy, mz = fabs(r->dz) + box.hz, mxy = CLRAD_MAX(mx, my);
  r->size = CLRAD_MAX(mxy, mz);
}

#endif
