/* The fast test of shared/triangle.cl for CLRAD_WIDTH segments at once. */
#ifndef CLRAD_PACKET_TEST_CL
#define CLRAD_PACKET_TEST_CL
#include "shared/packet.cl"
#include "shared/triangle.cl"

/* CLRAD_WIDTH segments of any form, and what the fast test needs of them. */
typedef struct packet {
  clrad_floats ax, ay, az, ax_lo, ay_lo, az_lo, bx, by, bz, bx_lo, by_lo, bz_lo;
  clrad_floats dx, dy, dz, size;
  clrad_ints a_plane, b_plane;
} packet;

static inline void load_packet(const clrad_segment* s, packet* p) {
  float v[12][CLRAD_WIDTH];
  int planes[2][CLRAD_WIDTH];
  for (int lane = 0; lane < CLRAD_WIDTH; ++lane) {
    v[0][lane] = s[lane].ax;
    v[1][lane] = s[lane].ay;
    v[2][lane] = s[lane].az;
    v[3][lane] = s[lane].ax_lo;
    v[4][lane] = s[lane].ay_lo;
    v[5][lane] = s[lane].az_lo;
    v[6][lane] = s[lane].bx;
    v[7][lane] = s[lane].by;
    v[8][lane] = s[lane].bz;
    v[9][lane] = s[lane].bx_lo;
    v[10][lane] = s[lane].by_lo;
    v[11][lane] = s[lane].bz_lo;
    planes[0][lane] = (int)s[lane].a_plane;
    planes[1][lane] = (int)s[lane].b_plane;
  }
  p->ax = CLRAD_LOAD(v[0]);
  p->ay = CLRAD_LOAD(v[1]);
  p->az = CLRAD_LOAD(v[2]);
  p->ax_lo = CLRAD_LOAD(v[3]);
  p->ay_lo = CLRAD_LOAD(v[4]);
  p->az_lo = CLRAD_LOAD(v[5]);
  p->bx = CLRAD_LOAD(v[6]);
  p->by = CLRAD_LOAD(v[7]);
  p->bz = CLRAD_LOAD(v[8]);
  p->bx_lo = CLRAD_LOAD(v[9]);
  p->by_lo = CLRAD_LOAD(v[10]);
  p->bz_lo = CLRAD_LOAD(v[11]);
  p->a_plane = CLRAD_LOAD(planes[0]);
  p->b_plane = CLRAD_LOAD(planes[1]);
  p->dx = CLRAD_DIFFERENCE(p->bx, p->bx_lo, p->ax, p->ax_lo);
  p->dy = CLRAD_DIFFERENCE(p->by, p->by_lo, p->ay, p->ay_lo);
  p->dz = CLRAD_DIFFERENCE(p->bz, p->bz_lo, p->az, p->az_lo);
  const clrad_floats mx = fabs(p->dx), my = fabs(p->dy), mz = fabs(p->dz), mxy = CLRAD_MAX(mx, my);
  p->size = CLRAD_MAX(mxy, mz);
}

/* clrad_fast_test for a packet: lanes that are surely hit, and lanes that the floats cannot tell. */
static inline void test_packet(const packet* s, __global const clrad_triangle* t, __global const clrad_facet* f,
                               clrad_ints* hit, clrad_ints* undecided) {
  const clrad_floats px = CLRAD_DIFFERENCE(t->x0, t->x0_lo, s->ax, s->ax_lo);
  const clrad_floats py = CLRAD_DIFFERENCE(t->y0, t->y0_lo, s->ay, s->ay_lo);
  const clrad_floats pz = CLRAD_DIFFERENCE(t->z0, t->z0_lo, s->az, s->az_lo);
  const clrad_floats qx = CLRAD_DIFFERENCE(t->x1, t->x1_lo, s->ax, s->ax_lo);
  const clrad_floats qy = CLRAD_DIFFERENCE(t->y1, t->y1_lo, s->ay, s->ay_lo);
  const clrad_floats qz = CLRAD_DIFFERENCE(t->z1, t->z1_lo, s->az, s->az_lo);
  const clrad_floats rx = CLRAD_DIFFERENCE(s->bx, s->bx_lo, t->x0, t->x0_lo);
  const clrad_floats ry = CLRAD_DIFFERENCE(s->by, s->by_lo, t->y0, t->y0_lo);
  const clrad_floats rz = CLRAD_DIFFERENCE(s->bz, s->bz_lo, t->z0, t->z0_lo);
  const clrad_floats dx = s->dx, dy = s->dy, dz = s->dz;

  const clrad_floats u0 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f->e0y, f->e0z, py, pz),
                                    CLRAD_CROSS(f->e0z, f->e0x, pz, px), CLRAD_CROSS(f->e0x, f->e0y, px, py));
  const clrad_floats u1 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f->e1y, f->e1z, qy, qz),
                                    CLRAD_CROSS(f->e1z, f->e1x, qz, qx), CLRAD_CROSS(f->e1x, f->e1y, qx, qy));
  const clrad_floats u2 = CLRAD_DOT(dx, dy, dz, CLRAD_CROSS(f->e2y, f->e2z, py, pz),
                                    CLRAD_CROSS(f->e2z, f->e2x, pz, px), CLRAD_CROSS(f->e2x, f->e2y, px, py));
  const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
  const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);

  const clrad_floats norm_a = CLRAD_NORM_1(px, py, pz), norm_b = CLRAD_NORM_1(rx, ry, rz);
  const clrad_floats error = s->size * CLRAD_VOLUME_SCALE(norm_a, f->edge_size);
  const clrad_floats side_a = -CLRAD_DOT(f->nx, f->ny, f->nz, px, py, pz),
                     side_b = CLRAD_DOT(f->nx, f->ny, f->nz, rx, ry, rz);
  const clrad_floats error_a = CLRAD_SIDE_BOUND(norm_a, f->normal_size), error_b = CLRAD_SIDE_BOUND(norm_b, f->normal_size);
  const clrad_ints front_a = CLRAD_IS(side_a > error_a), back_a = CLRAD_IS(side_a < -error_a);
  const clrad_ints front_b = CLRAD_IS(side_b > error_b), back_b = CLRAD_IS(side_b < -error_b);
  const int plane = (int)t->plane;
  const clrad_ints ignored =
      (CLRAD_IS(s->a_plane == plane) | CLRAD_IS(s->b_plane == plane)) & (t->plane != CLRAD_NONE ? -1 : 0);
  const clrad_ints miss =
      (CLRAD_IS(least < -error) & CLRAD_IS(most > error)) | (front_a & front_b) | (back_a & back_b) | ignored;
  const clrad_ints inside = CLRAD_IS(least > error) | CLRAD_IS(most < -error);
  *hit = inside & ((front_a & back_b) | (back_a & front_b)) & ~miss;
  *undecided = ~(*hit | miss);
}

/* Lanes of `live` that the triangle blocks; s: the packet's segments, for the exact predicate. */
static inline clrad_ints packet_blocked(const clrad_segment* s, const packet* p, __global const clrad_triangle* t,
                                        __global const clrad_facet* f, clrad_ints live, uint* exact) {
  clrad_ints hit, undecided;
  test_packet(p, t, f, &hit, &undecided);
  hit &= live;
  undecided &= live;
  if (clrad_bits_of_any(undecided) == 0) return hit;
  int hits[CLRAD_WIDTH], undecided_lanes[CLRAD_WIDTH];
  CLRAD_STORE(undecided, undecided_lanes);
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    hits[lane] = 0;
    if (!undecided_lanes[lane]) continue;
    hits[lane] = clrad_blocked(s[lane], *t) ? -1 : 0;
    ++*exact;
  }
  return hit | CLRAD_LOAD(hits);
}

/* CLRAD_WIDTH consecutive segments of any form, of which the first `lanes` are there, and the nearest hit of each so far. */
typedef struct nearest_hits {
  clrad_segment s[CLRAD_WIDTH];
  packet p;
  float t[CLRAD_WIDTH];
  uint triangle[CLRAD_WIDTH], lanes, exact;
} nearest_hits;

static inline void load_nearest(nearest_hits* n, __global const CLRAD_POINT_T* origins, __global const uint* active,
                                uint use_active, __global const CLRAD_POINT_T* targets, uint samples, ulong begin,
                                ulong segment_count) {
  n->lanes = segment_count - begin < CLRAD_WIDTH ? (uint)(segment_count - begin) : CLRAD_WIDTH;
  n->exact = 0;
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    n->s[lane] = clrad_fetch_segment(origins, active, use_active, targets, samples, begin + min(lane, n->lanes - 1));
    n->t[lane] = 1.0f;
    n->triangle[lane] = CLRAD_NONE;
  }
  load_packet(n->s, &n->p);
}

/* Takes in the triangle that is number `index` of the input: the nearest by (t, index) stays. Whether some segment met it. */
static inline int meet(nearest_hits* n, __global const clrad_triangle* t, __global const clrad_facet* f, uint index) {
  const clrad_ints hit = packet_blocked(n->s, &n->p, t, f, CLRAD_IS(CLRAD_LANES < (int)n->lanes), &n->exact);
  if (clrad_bits_of_any(hit) == 0) return 0;
  int hits[CLRAD_WIDTH];
  CLRAD_STORE(hit, hits);
  for (uint lane = 0; lane < n->lanes; ++lane) {
    if (!hits[lane]) continue;
    const float where = clrad_hit_parameter(n->s[lane], *t, *f);
    if (n->triangle[lane] == CLRAD_NONE || where < n->t[lane] || (where == n->t[lane] && index < n->triangle[lane])) {
      n->t[lane] = where;
      n->triangle[lane] = index;
    }
  }
  return 1;
}

static inline void store_nearest(const nearest_hits* n, ulong begin, __global uint* triangle, __global float* t) {
  for (uint lane = 0; lane < n->lanes; ++lane) {
    triangle[begin + lane] = n->triangle[lane];
    t[begin + lane] = n->t[lane];
  }
}

#endif
