/* One sample against the receivers that do not know yet: a packet of segments from it, walked box by box (slabs, Kay & Kajiya
 * 1986) where the lanes are and not where their hull is. What depends on the sample and the triangle alone is scalar: the tests
 * are those of shared/triangle.cl with the sample as a and D = receiver - sample, and the receivers' sides as
 *   S_b = S_a + N . D, off by E_S of both: 8u normal_size (|A|_1 + |D|_1). */
#ifndef CLRAD_SAMPLE_PACKET_CL
#define CLRAD_SAMPLE_PACKET_CL
#include "shared/hull.cl"
#include "shared/question.cl"
#include "shared/slabs.cl"

typedef struct sample_packet {
  float x, y, z, x_lo, y_lo, z_lo;
  clrad_floats dx, dy, dz, size, norm;
  uint plane;
  run alone; /* the sample as a run of one */
} sample_packet;

/* Lanes of `live` that the triangle blocks. */
static inline clrad_ints blocked_of_packet(question* q, const sample_packet* p, uint k, clrad_ints live,
                                           __global const clrad_triangle* t, __global const clrad_facet* f) {
  ++q->asked_alone;
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
  p.x = SAMPLE(q, 0, k);
  p.y = SAMPLE(q, 1, k);
  p.z = SAMPLE(q, 2, k);
  p.x_lo = SAMPLE(q, 3, k);
  p.y_lo = SAMPLE(q, 4, k);
  p.z_lo = SAMPLE(q, 5, k);
  p.dx = -q->dx[k];
  p.dy = -q->dy[k];
  p.dz = -q->dz[k];
  p.size = q->size[k];
  p.norm = CLRAD_NORM_1(p.dx, p.dy, p.dz);
  p.plane = SAMPLE_PLANE(q, k);
  run_in(q, box_of_samples(q->b, k, k + 1), k, k + 1, &p.alone);
  clrad_ints live = asked;
  for (uint i = 0; i < RECENT && recent[i] != CLRAD_NONE; ++i) {
    const clrad_ints hit = blocked_of_packet(q, &p, k, live, triangles + recent[i], facets + recent[i]);
    live &= ~hit;
    if (clrad_bits_of_any(live) == 0) break;
  }
  const clrad_floats x = p.x, y = p.y, z = p.z;
  const slabs lanes = slabs_of(x, y, z, p.dx, p.dy, p.dz);
  const shaft s = shaft_between(receivers, (float8)(p.x, p.y, p.z, 0, p.x, p.y, p.z, 0));
  clrad_floats begin;
  uint stack[STACK];
  uint top = 1;
  stack[0] = 0;
  while (top > 0 && clrad_bits_of_any(live) != 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    __global const float* boxes = (__global const float*)node;
    uint met = children_met(&s, boxes);
    ++q->nodes;
    for (; met; met &= met - 1) {
      ++q->boxes;
      const uint child = lowest_bit(met), code = node[6 * WIDE + child], in_leaf = code & 7u, first = code >> 3;
      if (clrad_bits_of_any(meets(&lanes, boxes, child, 1.0f, &begin) & live) == 0) continue;
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

#endif
