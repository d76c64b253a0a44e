/* A corner, from a point: differences first, then their sum. */
#ifndef CLRAD_CORNER_CL
#define CLRAD_CORNER_CL
#include "shared/math.cl"

static inline clrad_vector corner_from(CLRAD_POINT_T c, CLRAD_POINT_T p) {
  return clrad_make((c.x - p.x) + (c.x_lo - p.x_lo), (c.y - p.y) + (c.y_lo - p.y_lo), (c.z - p.z) + (c.z_lo - p.z_lo));
}

#endif
