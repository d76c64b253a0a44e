/* Segments, one a lane, against the boxes of the tree: slabs (Kay & Kajiya 1986).
 * Boxes are padded by BOX_PAD: an origin is off by 2^-23 (its low part), a direction by 2u of at most 8, a crossing (a coordinate
 * and the origin, at most 4 each and rounded, times 1 / D, their sum rounded) by what moves the plane by 20u. Together that is
 * 2.3e-6 at most, and the pad 3.8e-6. */
#ifndef CLRAD_SLABS_CL
#define CLRAD_SLABS_CL
#include "shared/box.cl"
#include "shared/hull.cl"

typedef struct slabs {
  clrad_floats ix, iy, iz, low_x, low_y, low_z, high_x, high_y, high_z; /* crossings: coordinate * i + low or high */
} slabs;

/* inverse_of_one, lane by lane. */
static inline clrad_floats inverse(clrad_floats d) {
  const clrad_floats none = 1e30f, one = 1.0f / d;
  return CLRAD_IS(d == 0.0f) ? none : one;
}

static inline slabs slabs_of(clrad_floats x, clrad_floats y, clrad_floats z, clrad_floats dx, clrad_floats dy,
                             clrad_floats dz) {
  slabs s;
  s.ix = inverse(dx);
  s.iy = inverse(dy);
  s.iz = inverse(dz);
  s.low_x = -(x + BOX_PAD) * s.ix;
  s.low_y = -(y + BOX_PAD) * s.iy;
  s.low_z = -(z + BOX_PAD) * s.iz;
  s.high_x = -(x - BOX_PAD) * s.ix;
  s.high_y = -(y - BOX_PAD) * s.iy;
  s.high_z = -(z - BOX_PAD) * s.iz;
  return s;
}

/* Lanes whose segment may meet child k's box before `until`, and where it enters. */
static inline clrad_ints meets(const slabs* s, __global const float* node, uint k, clrad_floats until, clrad_floats* entry) {
  const clrad_floats x0 = node[k] * s->ix + s->low_x, x1 = node[3 * WIDE + k] * s->ix + s->high_x;
  const clrad_floats y0 = node[WIDE + k] * s->iy + s->low_y, y1 = node[4 * WIDE + k] * s->iy + s->high_y;
  const clrad_floats z0 = node[2 * WIDE + k] * s->iz + s->low_z, z1 = node[5 * WIDE + k] * s->iz + s->high_z;
  const clrad_floats near_x = CLRAD_MIN(x0, x1), near_y = CLRAD_MIN(y0, y1), near_z = CLRAD_MIN(z0, z1);
  const clrad_floats far_x = CLRAD_MAX(x0, x1), far_y = CLRAD_MAX(y0, y1), far_z = CLRAD_MAX(z0, z1);
  clrad_floats begin = 0.0f, end = until;
  begin = CLRAD_MAX(near_x, begin);
  begin = CLRAD_MAX(near_y, begin);
  begin = CLRAD_MAX(near_z, begin);
  end = CLRAD_MIN(far_x, end);
  end = CLRAD_MIN(far_y, end);
  end = CLRAD_MIN(far_z, end);
  *entry = begin;
  return CLRAD_IS(begin <= end);
}

#endif
