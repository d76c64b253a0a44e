/* Visible parts of a shooter by clipping instead of samples: form factors without noise (`--visibility-exact`).
 *
 * clip_candidates: CLRAD_WIDTH neighbouring receivers walk the tree of occluders with the hull and the beams of the engine `shaft`,
 * the shooter's corners standing for samples. A triangle's three volumes (shared/triangle.cl) are linear over the shooter, so
 * their values at its corners tell of each receiver: all of it is hidden, nothing is, or a part. Those last are listed.
 *
 * clip_factors: from each receiver, the shooter minus all listed triangles as convex pieces (shared/pieces.cl). Seen from the receiver a
 * triangle, as much of it as is in front of the shooter's plane, is a pyramid; each of its sides cuts off what is beyond it,
 * and what is inside all of them is hidden. The form factor is the sum of the pieces'.
 *
 * A packet of receivers that more than MOST_LISTED triangles hide parts of, a receiver whose pieces find no room, and one that touches a triangle
 * (which then counts as hiding what is behind it) are left to samples: sampled[i] = 1.
 *
 * What rounding may do: an edge is where it is to some 16 roundings of the largest distance; what is hidden or not by that much
 * counts as a touch, which hides nothing. NaN hides nothing. */
#include "shared/beam.cl"
#include "shared/hull.cl"
#include "shared/pieces.cl"
#include "shared/question.cl"

#define MOST_LISTED 128          /* triangles that hide a part of the shooter from some receiver of a packet */
#define TOO_MANY CLRAD_NONE      /* many[packet]: more than that */
#define HIDDEN 1
#define TOUCHED 2
#define SHOOTER_CORNERS 4        /* a triangle's last one stands twice */
#define PIECE_CORNERS 12         /* of a piece, at most */
#define PIECES 32                /* that wait, at most */
#define FAR_EDGES2 CLRAD_R(9.0)  /* (distance / longest edge)^2 from which one Gauss cell does, see shared/factor.cl */
#define NEAR_EDGES2 CLRAD_R(3.6108) /* ... and from which its four quarters do: 0.4012 of that */
#ifdef CLRAD_FP64
#define CONTOUR_TOLERANCE 1e-9
#else
#define CONTOUR_TOLERANCE 1e-5f
#endif

/* Lanes from which the triangle hides a part of the shooter, more or less than all; those from which it hides all leave q->todo.
 * *touching: lanes on its plane, as far as floats tell, and in its box: seen edge-on it hides nothing, but what stands on the receiver counts
 * as hiding what is behind it (shared/predicate.cl), which samples know how to ask. */
static inline clrad_ints hides_part(question* q, const run* r, __global const clrad_triangle* t, __global const clrad_facet* f,
                                    clrad_ints* touching) {
  const uint plane = t->plane;
  if (plane != CLRAD_NONE && plane == r->box.plane) return 0;
  clrad_ints open = q->todo;
  if (plane != CLRAD_NONE) open &= ~CLRAD_IS(q->a_plane == (int)plane);

  int all_front_b = -1, all_back_b = -1, some_front_b = 0, some_back_b = 0;
  for (uint k = r->begin; k < r->end; ++k) {
    const float bx = CLRAD_DIFFERENCE(SAMPLE(q, 0, k), SAMPLE(q, 3, k), t->x0, t->x0_lo),
                by = CLRAD_DIFFERENCE(SAMPLE(q, 1, k), SAMPLE(q, 4, k), t->y0, t->y0_lo),
                bz = CLRAD_DIFFERENCE(SAMPLE(q, 2, k), SAMPLE(q, 5, k), t->z0, t->z0_lo);
    const float side = CLRAD_DOT(f->nx, f->ny, f->nz, bx, by, bz), norm = CLRAD_NORM_1(bx, by, bz);
    const float bound = CLRAD_SIDE_BOUND(norm, f->normal_size);
    const int front = side > bound ? -1 : 0, back = side < -bound ? -1 : 0;
    all_front_b &= front;
    all_back_b &= back;
    some_front_b |= front;
    some_back_b |= back;
  }
  const clrad_floats px = CLRAD_DIFFERENCE(t->x0, t->x0_lo, q->ax, q->ax_lo), py = CLRAD_DIFFERENCE(t->y0, t->y0_lo, q->ay, q->ay_lo),
                     pz = CLRAD_DIFFERENCE(t->z0, t->z0_lo, q->az, q->az_lo);
  const clrad_floats norm_a = CLRAD_NORM_1(px, py, pz), error_a = CLRAD_SIDE_BOUND(norm_a, f->normal_size);
  const clrad_floats side_a = -CLRAD_DOT(f->nx, f->ny, f->nz, px, py, pz);
  const clrad_ints front_a = CLRAD_IS(side_a > error_a), back_a = CLRAD_IS(side_a < -error_a);
  const clrad_ints in_plane = open & ~(front_a | back_a);
  if (clrad_bits_of_any(in_plane) != 0) {
    const float pad = 0x1p-20f;
    const clrad_floats ax = q->ax, ay = q->ay, az = q->az;
    *touching |= in_plane & CLRAD_IS(ax >= lowest(t->x0, t->x0_lo, t->x1, t->x1_lo, t->x2, t->x2_lo) - pad) &
                 CLRAD_IS(ax <= highest(t->x0, t->x0_lo, t->x1, t->x1_lo, t->x2, t->x2_lo) + pad) &
                 CLRAD_IS(ay >= lowest(t->y0, t->y0_lo, t->y1, t->y1_lo, t->y2, t->y2_lo) - pad) &
                 CLRAD_IS(ay <= highest(t->y0, t->y0_lo, t->y1, t->y1_lo, t->y2, t->y2_lo) + pad) &
                 CLRAD_IS(az >= lowest(t->z0, t->z0_lo, t->z1, t->z1_lo, t->z2, t->z2_lo) - pad) &
                 CLRAD_IS(az <= highest(t->z0, t->z0_lo, t->z1, t->z1_lo, t->z2, t->z2_lo) + pad);
  }
  /* What is on the receiver's own side of its plane, or in it, is not hidden. */
  open &= (front_a & some_back_b) | (back_a & some_front_b);
  if (clrad_bits_of_any(open) == 0) return 0;

  const edge_crosses c = crosses_of(q, t, f, px, py, pz);
  const clrad_floats scale = CLRAD_VOLUME_SCALE(norm_a, f->edge_size);
  direct(q, r->begin, r->end);
  clrad_ints inside = -1, beyond_0 = -1, beyond_1 = -1, beyond_2 = -1;
  for (uint k = r->begin; k < r->end; ++k) {
    const clrad_floats dx = q->dx[k], dy = q->dy[k], dz = q->dz[k], error = q->size[k] * scale;
    const clrad_floats u0 = CLRAD_DOT(dx, dy, dz, c.x0, c.y0, c.z0), u1 = CLRAD_DOT(dx, dy, dz, c.x1, c.y1, c.z1),
                       u2 = CLRAD_DOT(dx, dy, dz, c.x2, c.y2, c.z2);
    const clrad_floats v0 = front_a ? u0 : -u0, v1 = front_a ? u1 : -u1, v2 = front_a ? u2 : -u2;
    inside &= CLRAD_IS(v0 > error) & CLRAD_IS(v1 > error) & CLRAD_IS(v2 > error);
    beyond_0 &= CLRAD_IS(v0 <= error);
    beyond_1 &= CLRAD_IS(v1 <= error);
    beyond_2 &= CLRAD_IS(v2 <= error);
  }
  const clrad_ints hidden = inside & open & ((front_a & all_back_b) | (back_a & all_front_b));
  q->todo &= ~hidden;
  return open & ~(beyond_0 | beyond_1 | beyond_2 | hidden);
}

/* The triangles in the order of their numbers, whatever way a walk found them: so each receiver cuts in one order. */
static inline void insert_sorted(uint* list, int* lanes, uint at, uint triangle, int mask) {
  for (; at > 0 && list[at - 1] > triangle; --at) {
    list[at] = list[at - 1];
    lanes[at] = lanes[at - 1];
  }
  list[at] = triangle;
  lanes[at] = mask;
}

/* Work-item: a packet of the `count` chosen receivers. receivers, corners: ends as shaft_ends makes them, in groups of CLRAD_WIDTH and of 32.
 * pre: factors[i] of each, without occluders. post: many[packet] triangles in list[MOST_LISTED packet ...], and for each the receivers it
 * matters to, a bit a lane; hidden[i]: HIDDEN where a triangle hides the whole shooter (its lane's bits do not count then), TOUCHED where one touches the receiver. */
__kernel void clip_candidates(__global const uint* receivers, uint count, __global const uint* corners, __global const REAL* factors,
                              __global const uint* nodes, __global const clrad_triangle* triangles,
                              __global const clrad_facet* facets, __global uint* list, __global uint* lanes_of,
                              __global uint* many, __global uint* hidden) {
  const uint packet = get_global_id(0), first = packet * CLRAD_WIDTH;
  if (first >= count) return;
  int wanted[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) wanted[lane] = first + lane < count && factors[min(first + lane, count - 1)] > 0 ? -1 : 0;
  question q;
  begin_question(&q, receivers + (ulong)packet * END_WORDS * CLRAD_WIDTH, corners);
  q.todo = CLRAD_LOAD(wanted);
  const clrad_ints asked = q.todo;
  clrad_ints touching = 0;
  const float8 there = box_of_samples(q.b, 0, SHOOTER_CORNERS);
  run r;
  run_in(&q, there, 0, SHOOTER_CORNERS, &r);
  const shaft s = shaft_between(box_of_lanes(q.ax, q.ay, q.az), there);
  const beams lanes = beams_to(&q, &r);

  uint found[MOST_LISTED], found_count = 0;
  int found_lanes[MOST_LISTED];
  uint stack[STACK], top = 1;
  stack[0] = 0;
  while (top > 0 && found_count != TOO_MANY && clrad_bits_of_any(q.todo) != 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    uint met = children_met(&s, (__global const float*)node);
    for (; met && found_count != TOO_MANY; met &= met - 1) {
      const uint child = lowest_bit(met), code = node[6 * WIDE + child], in_leaf = code & 7u, begin = code >> 3;
      if (clrad_bits_of_any(meets_beams(&lanes, (__global const float*)node, child) & CLRAD_IS(q.todo != 0)) == 0) continue;
      if (in_leaf == 0) {
        stack[top++] = begin;
        continue;
      }
      for (uint i = begin; i < begin + in_leaf && found_count != TOO_MANY; ++i) {
        const int mask = clrad_bits_of_any(hides_part(&q, &r, triangles + i, facets + i, &touching) & CLRAD_LANE_BITS(0));
        if (mask == 0) continue;
        if (found_count == MOST_LISTED)
          found_count = TOO_MANY;
        else
          insert_sorted(found, found_lanes, found_count++, i, mask);
      }
    }
  }
  CLRAD_STORE((asked & ~q.todo & HIDDEN) | (asked & q.todo & touching & TOUCHED), wanted);
  for (uint lane = 0; lane < CLRAD_WIDTH && first + lane < count; ++lane) hidden[first + lane] = (uint)wanted[lane];
  many[packet] = found_count;
  for (uint k = 0; k < found_count && found_count != TOO_MANY; ++k) {
    list[(ulong)packet * MOST_LISTED + k] = found[k];
    lanes_of[(ulong)packet * MOST_LISTED + k] = (uint)found_lanes[k];
  }
}

/* Form factor of a piece, `height` being the receiver's over the shooter's plane and `front` that plane's unit normal. */
REAL factor_of(const clrad_vector* p, int n, clrad_vector normal, clrad_vector front, REAL height) {
  clrad_vector middle = p[0];
  REAL longest2 = 0;
  for (int i = 1; i < n; i++) {
    const clrad_vector across = clrad_minus(p[i], p[0]), edge = clrad_minus(p[i], p[i - 1]);
    const REAL a2 = clrad_dot(across, across), e2 = clrad_dot(edge, edge);
    longest2 = a2 > longest2 ? a2 : longest2;
    longest2 = e2 > longest2 ? e2 : longest2;
    middle = clrad_plus(middle, p[i]);
  }
  middle = clrad_scaled(middle, 1 / (REAL)n);
  const REAL distance2 = clrad_dot(middle, middle);
  if (distance2 >= NEAR_EDGES2 * longest2) {
    const int far = distance2 >= FAR_EDGES2 * longest2;
    REAL sum = 0, z[PIECE_CORNERS + 1];
    for (int i = 0; i < n; i++) {
      const REAL over = clrad_dot(normal, p[i]);
      z[i] = over > 0 ? over : 0;
    }
    for (int i = 1; i + 1 < n; i += 2) { /* a fan of quads; a triangle may be last */
      const int last = i + 2 < n ? i + 2 : i + 1;
      sum += clrad_far_quad(clrad_make(0, 0, 0), p[0], p[i], p[i + 1], p[last], z[0], z[i], z[i + 1], z[last], front, far);
    }
    return sum * height / CLRAD_PI;
  }
  REAL size = 0;
  const REAL sum = contour_of(p, n, normal, &size);
  return (8 * CLRAD_EPSILON * size <= CONTOUR_TOLERANCE * sum ? sum : careful_of(p, n, normal)) / (2 * CLRAD_PI);
}

/* The pyramid over what of the triangle is in front of the shooter's plane, its sides' normals to the inside; 0 sides where that is
 * nothing. x: the receiver, which clip_candidates has found to be off the triangle's plane; corner: the shooter's first as seen from there. */
static int sides_of(__global const clrad_triangle* t, __global const clrad_facet* f, clrad_vector x, clrad_vector x_lo, clrad_vector corner, clrad_vector front,
                    clrad_vector* h) {
  clrad_vector v[5], kept[5], behind[5], from[3];
  REAL over[5];
  v[0] = clrad_make((t->x0 - x.x) + (t->x0_lo - x_lo.x), (t->y0 - x.y) + (t->y0_lo - x_lo.y), (t->z0 - x.z) + (t->z0_lo - x_lo.z));
  v[1] = clrad_make((t->x1 - x.x) + (t->x1_lo - x_lo.x), (t->y1 - x.y) + (t->y1_lo - x_lo.y), (t->z1 - x.z) + (t->z1_lo - x_lo.z));
  v[2] = clrad_make((t->x2 - x.x) + (t->x2_lo - x_lo.x), (t->y2 - x.y) + (t->y2_lo - x_lo.y), (t->z2 - x.z) + (t->z2_lo - x_lo.z));
  /* From the nearest corner, and by the normal as it is: a volume of corner and edges would lose a long, low wall beside the receiver. */
  int nearest = 0;
  for (int k = 1; k < 3; k++)
    if (clrad_dot(v[k], v[k]) < clrad_dot(v[nearest], v[nearest])) nearest = k;
  const REAL side = clrad_dot(v[nearest], clrad_make(f->nx, f->ny, f->nz));
  for (int k = 0; k < 3; k++) from[k] = clrad_minus(v[k], corner);
  const int where = heights_of(from, 3, front, over);
  int n = 3, behinds;
  if (!(where & 1)) return 0;
  if (where == 3) {
    cut_piece(v, 3, over, kept, &n, behind, &behinds);
    for (int k = 0; k < n; k++) v[k] = kept[k];
  }
  int sides = 0;
  for (int k = 0; k < n; k++) {
    const clrad_vector a = v[k], b = v[k + 1 < n ? k + 1 : 0], along = clrad_minus(b, a);
    const clrad_vector nearer = clrad_dot(a, a) < clrad_dot(b, b) ? a : b;
    h[sides] = side > 0 ? clrad_cross(nearer, along) : clrad_cross(along, nearer);
    sides += clrad_largest(h[sides]) > 0; /* corners of a cut may coincide */
  }
  return sides >= 3 ? sides : 0;
}

/* column[receiver] = form factor of what is visible, but where sampled[i] = 1: those are left as they are. Work-item: a chosen receiver. */
__kernel void clip_factors(__global const REAL* shooter, __global const CLRAD_POINT_T* receivers, __global const uint* active,
                           __global const REAL* factors, __global const uint* list, __global const uint* lanes_of,
                           __global const uint* many, __global const uint* hidden, __global const clrad_triangle* triangles,
                           __global const clrad_facet* facets, __global REAL* column, __global uint* sampled, uint count) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const uint receiver = active[i], packet = i / CLRAD_WIDTH, lane = 1u << i % CLRAD_WIDTH;
  const REAL whole = factors[i];
  sampled[i] = 0;
  if (hidden[i] == HIDDEN || !(whole > 0)) {
    column[receiver] = 0;
    return;
  }
  const uint listed = many[packet];
  if (listed == TOO_MANY || hidden[i] == TOUCHED) {
    sampled[i] = 1;
    return;
  }
  list += (ulong)packet * MOST_LISTED;
  lanes_of += (ulong)packet * MOST_LISTED;
  uint begin = 0;
  while (begin < listed && !(lanes_of[begin] & lane)) begin++;
  if (begin == listed) {
    column[receiver] = whole;
    return;
  }
  const CLRAD_POINT_T at = receivers[receiver];
  const clrad_vector x = clrad_make(at.x, at.y, at.z), x_lo = clrad_make(at.x_lo, at.y_lo, at.z_lo),
                     normal = clrad_make(at.nx, at.ny, at.nz);
  const clrad_vector front =
      clrad_plus(clrad_load(shooter + CLRAD_SHOOTER_NORMAL), clrad_load(shooter + CLRAD_SHOOTER_NORMAL + 3));
  const REAL height = clrad_height(shooter, x, x_lo);
  clrad_vector p[PIECE_CORNERS + 1], q[PIECE_CORNERS + 1], r[PIECE_CORNERS + 1], aside[PIECE_CORNERS + 1];
  clrad_vector waiting[PIECES * PIECE_CORNERS];
  int corners_of[PIECES];
  uint next_of[PIECES], depth = 0, next = begin;
  REAL d[PIECE_CORNERS + 1], sum = 0;
  int n = 0, behind, cut = 0;
  for (int k = 0; k < 4; k++) {
    const clrad_vector c = clrad_plus(clrad_minus(clrad_load(shooter + CLRAD_SHOOTER_HI + 3 * k), x),
                                      clrad_minus(clrad_load(shooter + CLRAD_SHOOTER_LO + 3 * k), x_lo));
    if (k == 3 && c.x == p[2].x && c.y == p[2].y && c.z == p[2].z) break; /* a triangle's last corner, again */
    p[n++] = c;
  }
  const clrad_vector corner = p[0];
  if (heights_of(p, n, normal, d) == 3) { /* the horizon cuts it */
    int m = 0;
    cut_piece(p, n, d, q, &m, aside, &behind);
    for (n = 0; n < m; n++) p[n] = q[n];
  }
  for (;;) {
    while (n > 0 && next < listed) {
      const uint k = next++;
      if (!(lanes_of[k] & lane)) continue;
      clrad_vector h[4];
      const int sides = sides_of(triangles + list[k], facets + list[k], x, x_lo, corner, front, h);
      int meets = sides > 0;
      for (int e = 0; e < sides && meets; e++) meets = heights_of(p, n, h[e], d) & 1;
      if (!meets) continue;
      /* Each side cuts off what is beyond it, to wait; if nothing is left, nothing was hidden. */
      const uint depth_before = depth;
      int m = n;
      for (int j = 0; j < n; j++) q[j] = p[j];
      for (int e = 0; e < sides && m > 0; e++) {
        const int where = heights_of(q, m, h[e], d);
        if (!(where & 1)) m = 0;
        if (where != 3) continue;
        int inside = 0, beyond = 0;
        cut_piece(q, m, d, r, &inside, aside, &beyond);
        if (inside > PIECE_CORNERS || beyond > PIECE_CORNERS || depth == PIECES) {
          sampled[i] = 1;
          return;
        }
        if (beyond > 0) {
          for (int j = 0; j < beyond; j++) waiting[depth * PIECE_CORNERS + j] = aside[j];
          corners_of[depth] = beyond;
          next_of[depth++] = next;
        }
        m = inside;
        for (int j = 0; j < m; j++) q[j] = r[j];
      }
      if (m == 0) {
        depth = depth_before;
        continue;
      }
      cut = 1;
      n = 0; /* what is left is inside the pyramid */
    }
    if (n > 0 && cut) sum += factor_of(p, n, normal, front, height);
    if (depth == 0) break;
    depth--;
    n = corners_of[depth];
    next = next_of[depth];
    for (int j = 0; j < n; j++) p[j] = waiting[depth * PIECE_CORNERS + j];
  }
  column[receiver] = !cut || sum > whole ? whole : sum;
}
