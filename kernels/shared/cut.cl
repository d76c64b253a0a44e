/* Where a ray meets the grid: its part inside the box, its pieces along an axis. Crossings come from
 * shared/voxel.cl: one function of the plane's number. */
#ifndef CLRAD_CUT_CL
#define CLRAD_CUT_CL
#include "shared/ends.cl"
#include "shared/voxel.cl"

/* The part [*t0, *t1] of the ray inside the grid's box. 0 when there is none; then t0 > t1. */
static inline int clip(ray_ends ray, __global const float* frame, float* t0, float* t1) {
  float begin = 0.0f, end = 1.0f;
  int inside = 1, moves = 0;
  for (uint a = 0; a < 3; ++a) {
    float o = ray_origin(ray, a), d = ray_direction(ray, a), inverse = 1.0f / d;
    float low = clrad_plane(frame, a, 0), high = clrad_plane(frame, a, convert_int(frame[9 + a]));
    float p = (low - o) * inverse, q = (high - o) * inverse;
    float near = p < q ? p : q, far = p < q ? q : p;
    int along = d == 0.0f; /* with the planes: p and q are infinite or NaN */
    near = along ? 0.0f : near;
    far = along ? 1.0f : far;
    begin = begin > near ? begin : near;
    end = end < far ? end : far;
    inside &= (along ^ 1) | ((o >= low) & (o <= high));
    moves |= along ^ 1;
  }
  int meets = inside & moves & (begin <= end);
  *t0 = meets ? begin : 1.0f;
  *t1 = meets ? end : 0.0f;
  return meets;
}

/* How many pieces [t0, t1] of the ray has along the axis; for axis 3: how many blocks the voxel's list has.
 */
static inline uint pieces_ahead(uint axis, ray_ends ray, float t0, float t1, uint cell, __global const float* frame, __global const uint* first_block) {
  if (axis == 3) {
    uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
    return first_block[v + 1] - first_block[v];
  }
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis);
  int high = convert_int(frame[9 + axis]) - 1;
  int i = clrad_cell(frame, axis, o + t0 * d, 0, high), j = clrad_cell(frame, axis, o + t1 * d, 0, high);
  return (uint)abs(j - i) + 1u;
}

#endif
