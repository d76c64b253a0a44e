/* Where a ray meets the grid: its part inside the box, its pieces along an axis, its waves. Crossings come from
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

/* The cells of an axis that a wave may use, packed with the axis. All cells of all axes: axis 3. */
#define ANY_CELLS (3u << 20)

static inline int first_cell(uint cells, uint axis) {
  return cells >> 20 == axis ? (int)(cells & 1023u) : 0;
}
static inline int last_cell(uint cells, uint axis, __global const float* frame) {
  return cells >> 20 == axis ? (int)(cells >> 10 & 1023u) : convert_int(frame[9 + axis]) - 1;
}

/* How many pieces [t0, t1] of the ray has along the axis; for axis 3: how many blocks the voxel's list has.
 */
static inline uint pieces_ahead(uint axis, ray_ends ray, float t0, float t1, uint cell, uint cells,
                                __global const float* frame, __global const uint* first_block) {
  if (axis == 3) {
    uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
    return first_block[v + 1] - first_block[v];
  }
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis);
  int low = first_cell(cells, axis), high = last_cell(cells, axis, frame);
  int i = clrad_cell(frame, axis, o + t0 * d, low, high), j = clrad_cell(frame, axis, o + t1 * d, low, high);
  return (uint)abs(j - i) + 1u;
}

/* Wave `wave` of a ray: narrows [t0, t1] and gives the cells it may use. *more: the ray goes on after this
 * wave. */
static inline uint wave_cells(ray_ends ray, __global const float* frame, uint wave, uint slab, float* t0,
                              float* t1, uint* more) {
  uint axis = 0;
  int from = 0, to = 0;
  for (uint a = 0; a < 3; ++a) {
    float o = ray_origin(ray, a), d = ray_direction(ray, a);
    int n = convert_int(frame[9 + a]);
    int i = clrad_cell(frame, a, o + *t0 * d, 0, n - 1), j = clrad_cell(frame, a, o + *t1 * d, 0, n - 1);
    if (a == 0 || abs(j - i) > abs(to - from)) {
      axis = a;
      from = i;
      to = j;
    }
  }
  int step = to < from ? -1 : 1, count = abs(to - from) + 1;
  int begin = (int)(wave * slab), end = begin + (int)slab;
  *more = end < count;
  end = end < count ? end : count;
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis), t_begin = *t0, t_end = *t1;
  if (begin > 0) {
    float t = clrad_crossing(frame, axis, from + step * begin + (step < 0), o, d);
    t = t > *t0 ? t : *t0;
    t_begin = t < *t1 ? t : *t1;
  }
  if (end < count) {
    float t = clrad_crossing(frame, axis, from + step * end + (step < 0), o, d);
    t = t > *t0 ? t : *t0;
    t_end = t < *t1 ? t : *t1;
  }
  *t0 = t_begin;
  *t1 = t_end;
  int a = from + step * begin, b = from + step * (end - 1);
  return axis << 20 | (uint)(a < b ? b : a) << 10 | (uint)(a < b ? a : b);
}

#endif
