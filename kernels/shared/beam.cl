/* Beams: all segments from a receiver to any point of a box, one receiver a lane, against the boxes of the tree. The hull of a packet
 * (shared/hull.cl) is wide where its receivers lie far apart; its beams are where the segments are.
 *
 * With a the receiver and D = b - a between d - h and d + h on an axis, the beam at t has all from a + t (d - h) to a + t (d + h). It
 * meets a box where, for one t of [0, 1] and on every axis, a + t up >= low and a + t down <= high: a bound of t each, from below or
 * from above as up and down have their signs. Where up > 0 > down both are from below: the beam widens to both sides.
 *
 * BEAM_WIDER covers what up and down are off by: 2u of |D| <= 8 and a rounding of at most u (8 + 8), 32u = 2^-19 in all. What the
 * origin's low part and the roundings of a crossing are off by is covered by BOX_PAD as in shared/slabs.cl. */
#ifndef CLRAD_BEAM_CL
#define CLRAD_BEAM_CL
#include "shared/question.cl"
#include "shared/slabs.cl"

#define BEAM_WIDER 0x1p-19f

typedef struct beam_axis {
  clrad_floats up, down, low, high; /* crossings: low coordinate * up + low, high coordinate * down + high */
  clrad_ints widens;
} beam_axis;

typedef struct beams {
  beam_axis x, y, z;
} beams;

static inline beam_axis beams_along(clrad_floats a, clrad_floats d, float h) {
  /* Where a bound does not move: so steep that it is far outside [0, 1] on the side that is right for a beam that widens. */
  const clrad_floats up = d + (h + BEAM_WIDER), down = d - (h + BEAM_WIDER), steep_up = 1e30f, steep_down = -1e30f;
  const clrad_floats one_up = 1.0f / up, one_down = 1.0f / down;
  beam_axis b;
  b.up = CLRAD_IS(up == 0.0f) ? steep_up : one_up;
  b.down = CLRAD_IS(down == 0.0f) ? steep_down : one_down;
  b.low = -(a + BOX_PAD) * b.up;
  b.high = -(a - BOX_PAD) * b.down;
  b.widens = CLRAD_IS(up >= 0.0f) & CLRAD_IS(down <= 0.0f);
  return b;
}

static inline beams beams_to(const question* q, const run* r) {
  beams b;
  b.x = beams_along(q->ax, r->dx, r->box.hx);
  b.y = beams_along(q->ay, r->dy, r->box.hy);
  b.z = beams_along(q->az, r->dz, r->box.hz);
  return b;
}

/* Narrows [begin, end] to where the beam is between low and high. */
static inline void narrow(const beam_axis* b, float low, float high, clrad_floats* begin, clrad_floats* end) {
  const clrad_floats t0 = low * b->up + b->low, t1 = high * b->down + b->high, never = 1e30f;
  const clrad_floats least = CLRAD_MIN(t0, t1), most = CLRAD_MAX(t0, t1);
  const clrad_floats from = b->widens ? most : least, to = b->widens ? never : most;
  *begin = CLRAD_MAX(from, *begin);
  *end = CLRAD_MIN(to, *end);
}

/* Lanes whose beam may meet child k's box. */
static inline clrad_ints meets_beams(const beams* b, __global const float* node, uint k) {
  clrad_floats begin = 0.0f, end = 1.0f;
  narrow(&b->x, node[k], node[3 * WIDE + k], &begin, &end);
  narrow(&b->y, node[WIDE + k], node[4 * WIDE + k], &begin, &end);
  narrow(&b->z, node[2 * WIDE + k], node[5 * WIDE + k], &begin, &end);
  return CLRAD_IS(begin <= end);
}

#endif
