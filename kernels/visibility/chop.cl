/* The nearest hit by chopping rays into voxels, ray by ray: object-parallel and ray-parallel (section 1.3.2 of the
 * paper, figure 1.2). Occlusion alone, which may stop at any hit, is bundle.cl's.
 *
 *   per ray                cut to the grid's box, count the x planes crossed      -> allocate
 *   per (ray, x slab)      piece of the ray in it, count the y planes crossed     -> allocate
 *   per (..., y slab)      the same along z                                       -> allocate
 *   per (ray, voxel)       triangles in the voxel: 0 drops the piece              -> allocate
 *   per (ray, candidates)  intersect
 *   per ray                the nearest (segmented min)
 *
 * Candidates come in blocks of CLRAD_WIDTH triangles of one voxel, laid out for vectors: a work-item tests
 * one ray against one block. With width 1 that is the paper's one processor per ray and candidate. Axes with
 * a single cell are not cut. Where a ray crosses plane i is one function of i (shared/voxel.cl): neighbouring
 * pieces share that number, nothing is accumulated along a ray, and the pieces of a ray follow each other
 * from its origin to its target.
 *
 * A piece is (ray, cell, t0, t1); cell = x | y << 10 | z << 20.
 */
#include "shared/block.cl"
#include "shared/cut.cl"


/* ends[i] = point first + i of the list, snapped. */
__kernel void chop_ends(uint n, uint first, __global const CLRAD_POINT_T* points, __global const uint* active,
                        uint use_active, __global uint* ends) {
  uint i = get_global_id(0);
  if (i >= n) return;
  __global const CLRAD_POINT_T* point = points + (use_active ? active[first + i] : first + i);
  const clrad_end end = clrad_snap_point(point);
  __global uint* e = ends + i * END_WORDS;
  e[0] = as_uint(end.x);
  e[1] = as_uint(end.y);
  e[2] = as_uint(end.z);
  e[3] = as_uint(end.x_lo);
  e[4] = as_uint(end.y_lo);
  e[5] = as_uint(end.z_lo);
  e[6] = end.plane;
  e[7] = 0;
}

__kernel void chop_packets(uint lanes, __global const uint* triangle,
                           __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                           __global float* packets, __global uint* plane) {
  uint i = get_global_id(0);
  if (i >= lanes) return;
  __global float* p = packets + i / CLRAD_WIDTH * (PACKET_FLOATS * CLRAD_WIDTH) + i % CLRAD_WIDTH;
  uint k = triangle[i];
  if (k == CLRAD_NONE) {
    /* A point far below the frame in a horizontal plane: every ray is on one side of it, surely. */
    for (int f = 0; f < PACKET_FLOATS; ++f) p[f * CLRAD_WIDTH] = 0.0f;
    p[2 * CLRAD_WIDTH] = -100.0f;
    p[14 * CLRAD_WIDTH] = 1.0f;
    plane[i] = CLRAD_NONE;
    return;
  }
  clrad_triangle t = triangles[k];
  clrad_facet f = facets[k];
  plane[i] = t.plane;
  put_lane(t, f, packets, i);
}

/* ---- cutting */

/* Cuts `rays` rays to the box; counts[r] = pieces along `axis`, 0 for rays that miss it. */
__kernel void chop_rays(uint rays, __global const uint* from, __global const uint* to, uint run, uint pairs,
                        __global const float* frame, __global const uint* first_block, uint axis,
                        __global uint* piece_ray, __global uint* piece_cell, __global float* piece_t0,
                        __global float* piece_t1, __global uint* counts) {
  uint r = get_global_id(0);
  if (r >= rays) return;
  ray_ends ray = ends_of(from, to, run, pairs, r);
  float t0, t1;
  int meets = clip(ray, frame, &t0, &t1);
  uint count = pieces_ahead(axis, ray, t0, t1, 0, frame, first_block);
  piece_ray[r] = r;
  piece_cell[r] = 0;
  piece_t0[r] = t0;
  piece_t1[r] = t1;
  counts[r] = meets ? count : 0u;
}

/* One cut: slot s is piece rank[s], along `axis`, of the piece owner[s]; counts[s] = what it asks for along
 * `next`. */
__kernel void chop_cut(uint slots, uint axis, uint next, __global const uint* offsets,
                       __global const uint* owner, __global const uint* rank, __global const float* frame,
                       __global const uint* first_block, __global const uint* from, __global const uint* to,
                       uint run, uint pairs, __global const uint* in_ray, __global const uint* in_cell, __global const float* in_t0,
                       __global const float* in_t1, __global uint* out_ray, __global uint* out_cell,
                       __global float* out_t0, __global float* out_t1, __global uint* counts) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  uint p = owner[s], r = in_ray[p];
  int k = (int)rank[s], last = (int)(offsets[p + 1] - offsets[p]) - 1;
  ray_ends ray = ends_of(from, to, run, pairs, r);
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis), t0 = in_t0[p], t1 = in_t1[p];
  int step = d < 0.0f ? -1 : 1;
  int i = clrad_cell(frame, axis, o + t0 * d, 0, convert_int(frame[9 + axis]) - 1) + step * k;
  float entry = clrad_crossing(frame, axis, i + (step < 0 ? 1 : 0), o, d);
  entry = entry > t0 ? entry : t0;
  entry = entry < t1 ? entry : t1;
  float begin = k > 0 ? entry : t0;
  float leave = clrad_crossing(frame, axis, i + (step > 0 ? 1 : 0), o, d);
  leave = leave > t0 ? leave : t0;
  leave = leave < t1 ? leave : t1;
  float end = k < last ? leave : t1;
  uint cell = in_cell[p] | (uint)i << (10 * axis);
  out_ray[s] = r;
  out_cell[s] = cell;
  out_t0[s] = begin;
  out_t1[s] = end;
  counts[s] = pieces_ahead(next, ray, begin, end, cell, frame, first_block);
}

/* ---- testing */

/* Slot s: a ray against a block of its candidates. slot_t[s], slot_triangle[s]: the nearest of those that floats are sure
 * of, INFINITY and CLRAD_NONE without one. Of equal t the lower triangle: lanes are in ascending order. doubt[s]: lanes
 * that need the exact predicate. */
__kernel void chop_test_nearest(uint slots, __global const uint* owner, __global const uint* rank,
                                __global const uint* piece_ray, __global const uint* piece_cell,
                                __global const float* frame, __global const uint* first_block,
                                __global const float* packets, __global const uint* triangle,
                                __global const uint* plane, __global const clrad_triangle* triangles,
                                __global const clrad_facet* facets, __global const uint* from,
                                __global const uint* to, uint run, uint pairs, __global float* slot_t,
                                __global uint* slot_triangle, __global uint* doubt) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  uint p = owner[s], r = piece_ray[p], cell = piece_cell[p];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  uint block = first_block[v] + rank[s];
  clrad_ints hit, undecided;
  test_block(load_ray(ends_of(from, to, run, pairs, r)), block, packets, plane, &hit, &undecided);
  uint hits = (uint)clrad_bits_of_any(hit & CLRAD_LANE_BITS(0));
  doubt[s] = (uint)clrad_bits_of_any(undecided & CLRAD_LANE_BITS(0));
  float best = INFINITY;
  uint which = CLRAD_NONE;
  if (hits) {
    clrad_segment segment = whole_segment(ends_of(from, to, run, pairs, r));
    for (uint l = 0; l < CLRAD_WIDTH; ++l) {
      if (!(hits >> l & 1u)) continue;
      uint k = triangle[block * CLRAD_WIDTH + l];
      float t = clrad_hit_parameter(segment, triangles[k], facets[k]);
      if (t < best) {
        best = t;
        which = k;
      }
    }
  }
  slot_t[s] = best;
  slot_triangle[s] = which;
}

/* The undecided lanes of the slots in `list`, exactly. */
__kernel void chop_exact_nearest(uint n, __global const uint* list, __global const uint* owner,
                                 __global const uint* rank, __global const uint* piece_ray,
                                 __global const uint* piece_cell, __global const float* frame,
                                 __global const uint* first_block, __global const uint* triangle,
                                 __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                 __global const uint* from, __global const uint* to, uint run, uint pairs,
                                 __global const uint* doubt, __global float* slot_t,
                                 __global uint* slot_triangle) {
  uint i = get_global_id(0);
  if (i >= n) return;
  uint s = list[i], p = owner[s], r = piece_ray[p], cell = piece_cell[p], lanes = doubt[s];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  uint first = (first_block[v] + rank[s]) * CLRAD_WIDTH;
  clrad_segment segment = whole_segment(ends_of(from, to, run, pairs, r));
  float best = slot_t[s];
  uint which = slot_triangle[s];
  for (uint l = 0; l < CLRAD_WIDTH; ++l) {
    if (!(lanes >> l & 1u)) continue;
    uint k = triangle[first + l];
    if (!clrad_blocked(segment, triangles[k])) continue;
    float t = clrad_hit_parameter(segment, triangles[k], facets[k]);
    if (t < best || (t == best && k < which)) {
      best = t;
      which = k;
    }
  }
  slot_t[s] = best;
  slot_triangle[s] = which;
}

/* ---- results */

/* positions[i] = offsets[positions[i]]: from slots of one allocation to slots of the next. */
__kernel void chop_follow(uint n, __global const uint* offsets, __global uint* positions) {
  uint i = get_global_id(0);
  if (i < n) positions[i] = offsets[positions[i]];
}

/* Takes the segmented min over into the rays: at[r] is the first slot of the nearest t; a later slot may hold a lower
 * triangle at the same t. */
__kernel void chop_nearest(uint rays, __global const uint* offsets, __global const float* least, __global const uint* at,
                           __global const float* slot_t, __global const uint* slot_triangle, __global float* ray_t,
                           __global uint* ray_triangle) {
  uint r = get_global_id(0);
  if (r >= rays || at[r] == CLRAD_NONE || least[r] == INFINITY) return;
  float t = least[r];
  uint which = CLRAD_NONE;
  for (uint s = at[r]; s < offsets[r + 1]; ++s)
    if (slot_t[s] == t && slot_triangle[s] < which) which = slot_triangle[s];
  ray_t[r] = t;
  ray_triangle[r] = which;
}

/* Results of the batch, from segment `first` on; triangles by their number in the input, t = 1 without a hit.
 */
__kernel void chop_results(uint rays, ulong first, __global const float* ray_t,
                           __global const uint* ray_triangle, __global const uint* input_index,
                           __global uint* triangle, __global float* t) {
  uint r = get_global_id(0);
  if (r >= rays) return;
  uint k = ray_triangle[r];
  triangle[first + r] = CLRAD_NONE;
  t[first + r] = 1.0f;
  if (k != CLRAD_NONE) {
    triangle[first + r] = input_index[k];
    t[first + r] = ray_t[r];
  }
}

/* ---- counts */

/* sums: `items` counts of candidates, as many of exact tests, and of pieces. Work-item i adds its share of the pieces. A
 * ray that misses the grid asks for no pieces, or, where nothing is cut, is one with t0 > t1. */
__kernel void chop_tally_candidates(uint items, uint pieces, __global const uint* piece_cell,
                                    __global const float* t0, __global const float* t1,
                                    __global const uint* counts, __global const float* frame,
                                    __global const uint* held, __global ulong* sums) {
  uint i = get_global_id(0);
  if (i >= items) return;
  uint begin = (uint)((ulong)pieces * i / items), end = (uint)((ulong)pieces * (i + 1) / items);
  ulong sum = 0, there = 0;
  for (uint p = begin; p < end; ++p) {
    uint cell = piece_cell[p];
    uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
    sum += counts[p] ? held[v] : 0u;
    there += t0[p] <= t1[p] ? 1u : 0u;
  }
  sums[i] += sum;
  sums[2 * items + i] += there;
}

__kernel void chop_tally_exact(uint items, uint n, __global const uint* list, __global const uint* doubt,
                               __global ulong* sums) {
  uint i = get_global_id(0);
  if (i >= items) return;
  uint begin = (uint)((ulong)n * i / items), end = (uint)((ulong)n * (i + 1) / items);
  ulong sum = 0;
  for (uint p = begin; p < end; ++p) sum += popcount(doubt[list[p]]);
  sums[items + i] += sum;
}

__kernel void chop_fold(uint n, __global const ulong* from, __global ulong* to) {
  uint i = get_global_id(0);
  if (i < n) to[i] += from[i];
}
