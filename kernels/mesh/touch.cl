/* Vertices that touch other surfaces, as those of a floor at the foot of a wall: moved to the front of what they touch.
 *
 * Visibility counts a point on a triangle's plane as in front of it and a touch as a hit, so that nothing leaks
 * (shared/predicate.cl). At the corner of a block both of its sides touch the vertex, each hides what is behind its plane, and
 * a quarter of the surroundings is seen where it should be three quarters. A little in front of both it is as it should be. */
#include "shared/box.cl"
#include "shared/hull.cl"

#define MOST_TOUCHED 8   /* planes of a vertex */
#define LEAST_ALONG 0.1f /* of a unit normal along the vertex's own surface: flatter ones cannot be evaded */
#define LEAST_RISE 0.05f /* off every plane, a unit direction being 1: else they face each other */

/* Whether the triangle is within `reach` of the point, from whose corners p, q, s lead to it. */
static inline int touches(float3 p, float3 q, float3 s, float3 n, float reach) {
  const float size = length(n), rounding = CLRAD_SIDE_BOUND(CLRAD_NORM_1(p.x, p.y, p.z), size);
  if (!(fabs(dot(n, p)) <= reach * size + rounding)) return 0;
  const float3 corner[3] = {p, q, s};
  for (uint k = 0; k < 3; ++k) {
    const float3 a = corner[k], inner = cross(n, corner[k == 2 ? 0 : k + 1] - a);
    if (!(-dot(inner, a) >= -reach * length(inner))) return 0;
  }
  return 1;
}

/* Work-item: vertex i. move[3 i ..]: the sum of unit directions along its surface off what is within reach[i]; 0 where that is
 * nothing, or cannot be evaded. */
__kernel void find_touched(__global const CLRAD_POINT_T* receivers, uint count, __global const float* reach,
                           __global const uint* nodes, __global const clrad_triangle* triangles,
                           __global const clrad_facet* facets, __global float* move) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const float near = reach[i];
  const CLRAD_POINT_T at = receivers[i];
  float x, y, z, x_lo, y_lo, z_lo;
  clrad_split_point(receivers + i, &x, &y, &z, &x_lo, &y_lo, &z_lo);
  const float3 own = (float3)((float)at.nx, (float)at.ny, (float)at.nz);
  const float pad = near + BOX_PAD;
  float3 normal[MOST_TOUCHED], sum = 0.0f;
  uint planes[MOST_TOUCHED], found = 0, stack[STACK], top = 1;
  stack[0] = 0;
  while (top > 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    __global const float* box = (__global const float*)node;
    uint met = bits_of((vload8(0, box) <= x + pad) & (vload8(3, box) >= x - pad) & (vload8(1, box) <= y + pad) &
                       (vload8(4, box) >= y - pad) & (vload8(2, box) <= z + pad) & (vload8(5, box) >= z - pad));
    for (; met; met &= met - 1) {
      const uint code = node[6 * WIDE + lowest_bit(met)], in_leaf = code & 7u, begin = code >> 3;
      if (in_leaf == 0) {
        stack[top++] = begin;
        continue;
      }
      for (uint k = begin; k < begin + in_leaf; ++k) {
        const clrad_triangle t = triangles[k];
        uint known = 0;
        while (known < found && planes[known] != t.plane) ++known;
        if (t.plane == at.plane || known < found || found == MOST_TOUCHED) continue;
        const float3 p = (float3)(CLRAD_DIFFERENCE(t.x0, t.x0_lo, x, x_lo), CLRAD_DIFFERENCE(t.y0, t.y0_lo, y, y_lo),
                                  CLRAD_DIFFERENCE(t.z0, t.z0_lo, z, z_lo));
        const float3 q = (float3)(CLRAD_DIFFERENCE(t.x1, t.x1_lo, x, x_lo), CLRAD_DIFFERENCE(t.y1, t.y1_lo, y, y_lo),
                                  CLRAD_DIFFERENCE(t.z1, t.z1_lo, z, z_lo));
        const float3 s = (float3)(CLRAD_DIFFERENCE(t.x2, t.x2_lo, x, x_lo), CLRAD_DIFFERENCE(t.y2, t.y2_lo, y, y_lo),
                                  CLRAD_DIFFERENCE(t.z2, t.z2_lo, z, z_lo));
        const float3 n = (float3)(facets[k].nx, facets[k].ny, facets[k].nz);
        if (!touches(p, q, s, n, near)) continue;
        const float3 unit = n / length(n), along = unit - dot(unit, own) * own;
        if (!(length(along) >= LEAST_ALONG)) continue;
        normal[found] = unit;
        planes[found++] = t.plane;
        sum += along / length(along);
      }
    }
  }
  for (uint k = 0; k < found; ++k)
    if (!(dot(normal[k], sum) >= LEAST_RISE)) sum = 0.0f;
  move[3 * i] = sum.x;
  move[3 * i + 1] = sum.y;
  move[3 * i + 2] = sum.z;
}
