/* The exact predicate and the fast test on their own, one segment and one triangle a work-item: what the tests compare
 * with integers of unlimited size. */
#include "shared/triangle.cl"

/* Segment i joins origin i and target i and meets triangle i. post: verdicts[i] = the fast test's answer (CLRAD_MISS, _HIT
 * or _UNDECIDED) + 4 if the triangle blocks the segment, t[i] = clrad_hit_parameter. */
__kernel void predicate_pairs(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets, uint count,
                              __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                              __global uint* verdicts, __global float* t) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const clrad_segment s = clrad_make_segment(origins + i, targets + i);
  const uint fast = (uint)clrad_fast_test(s, triangles[i], facets[i]);
  verdicts[i] = fast + (clrad_blocked(s, triangles[i]) ? 4u : 0u);
  t[i] = clrad_hit_parameter(s, triangles[i], facets[i]);
}
