/* Visibility by shafts through a tree of boxes: a work-item takes CLRAD_WIDTH neighbouring receivers, one a lane, and a run
 * of samples of one shooter, and walks the tree with the hull of both boxes (Haines & Wallace, "Shaft Culling for Efficient
 * Ray-Traced Radiosity", 1991) and with each receiver's beam (shared/beam.cl). What lies outside is met by no segment; a
 * triangle inside is first held against the samples' box as a whole: along the box its three volumes (shared/triangle.cl)
 * are linear, so that their middle and their reach say of each receiver that all samples are blocked, that none is, or that
 * they must be asked one by one. What floats cannot tell goes to the exact predicate. An empty hull leaves everything
 * visible, and no ray was traced.
 *
 * Bits are those of `serial`: a segment meets a triangle only where hull and beam are, and every test has a bound of its error.
 */
#include "shared/beam.cl"
#include "shared/hull.cl"
#include "shared/packet_test.cl"
#include "shared/packet_walk.cl"
#include "shared/question.cl"
#include "shared/sample_packet.cl"

/* Counts at COUNT_PLACES places, a cache line each: at a single one the work-items would wait for each other. Two words each: exact
 * tests, pairs of a receiver and a triangle looked at, runs of samples whose shaft was given up, then nodes, boxes and triangles of
 * shafts and of packets, as in a question. */
#define COUNT_PLACES 64
#define COUNT_WORDS 16

static inline volatile __global uint* count(volatile __global uint* counts, uint exact, uint triangles) {
  volatile __global uint* place = counts + get_global_id(0) % COUNT_PLACES * COUNT_WORDS;
  clrad_count(place, exact);
  clrad_count(place + 2, triangles * CLRAD_WIDTH);
  return place;
}

/* Walks the tree for one run of samples; ends early when all of its bits are known. 0 when that would take more than `budget`
 * triangles: the bits known by then are true all the same. */
static inline int walk(question* q, const run* r, const shaft* s, uint budget, __global const uint* nodes,
                       __global const clrad_triangle* triangles, __global const clrad_facet* facets) {
  beams lanes; /* made when the hull meets anything */
  int have_beams = 0;
  uint stack[STACK];
  uint top = 1;
  stack[0] = 0;
  while (top > 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    uint met = children_met(s, (__global const float*)node);
    ++q->nodes;
    if (met && !have_beams) {
      lanes = beams_to(q, r);
      have_beams = 1;
    }
    for (; met; met &= met - 1) {
      ++q->boxes;
      const uint child = lowest_bit(met), code = node[6 * WIDE + child], in_leaf = code & 7u, first = code >> 3;
      if (clrad_bits_of_any(meets_beams(&lanes, (__global const float*)node, child) & CLRAD_IS(q->todo != 0)) == 0) continue;
      if (in_leaf == 0) {
        stack[top++] = first;
        continue;
      }
      for (uint i = first; i < first + in_leaf; ++i) ask_triangle(q, r, triangles + i, facets + i);
      if (clrad_bits_of_any(q->todo) == 0) return 1;
      if (q->loops > budget) return 0;
    }
  }
  return 1;
}

static inline clrad_floats rint_of_lanes(clrad_floats x) {
  const clrad_floats up = 0x1p23f, down = -0x1p23f, large = CLRAD_IS(x < 0.0f) ? down : up;
  return CLRAD_IS(fabs(x) < 0x1p23f) ? (x + large) - large : x;
}

/* clrad_snap (shared/segment.cl), a coordinate a lane. */
static inline void snap_lanes(const float* hi, const float* lo, __global uint* snapped, __global uint* snapped_lo) {
  const clrad_floats h = CLRAD_LOAD(hi) * CLRAD_GRID_STEPS, l = CLRAD_LOAD(lo) * CLRAD_GRID_STEPS;
  const clrad_floats h_whole = rint_of_lanes(h), l_whole = rint_of_lanes(l);
  const clrad_floats rest = l_whole + rint_of_lanes((h - h_whole) + (l - l_whole));
  const clrad_floats sum = h_whole + rest, part = sum - h_whole;
  const clrad_floats error = (h_whole - (sum - part)) + (rest - part);
  CLRAD_STORE(sum * CLRAD_GRID_STEP, (__global float*)snapped);
  CLRAD_STORE(error * CLRAD_GRID_STEP, (__global float*)snapped_lo);
}

/* Ends on the visibility grid, once for all the work-items that read them: in groups of `size`, END_WORDS runs of that many words
 * each (x y z, their low parts, plane); the last group is filled up with the last end. Work-item: CLRAD_WIDTH ends, of which `size`
 * is a multiple. */
__kernel void shaft_ends(__global const CLRAD_POINT_T* points, __global const uint* active, uint use_active, uint count,
                         uint size, __global uint* ends) {
  const uint first = get_global_id(0) * CLRAD_WIDTH;
  if (first >= (count + size - 1) / size * size) return;
  __global uint* e = ends + (ulong)(first / size) * END_WORDS * size + first % size;
  float hi[3][CLRAD_WIDTH], lo[3][CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    const uint chosen = min(first + lane, count - 1);
    __global const CLRAD_POINT_T* p = points + (use_active ? active[chosen] : chosen);
    clrad_split_point(p, &hi[0][lane], &hi[1][lane], &hi[2][lane], &lo[0][lane], &lo[1][lane], &lo[2][lane]);
    e[6 * size + lane] = p->plane;
  }
  for (uint c = 0; c < 3; ++c) snap_lanes(hi[c], lo[c], e + c * size, e + (3 + c) * size);
}

/* Boxes of the runs of samples that have a shaft of their own; work-item: a run. boxes: runs_per_word for each word of 32 samples, see
 * box_of_samples. */
__kernel void shaft_runs(__global const uint* targets, uint samples, uint run_length, uint runs_per_word, __global float* boxes) {
  const uint i = get_global_id(0), word = i / runs_per_word, begin = i % runs_per_word * run_length;
  if (word * 32 + begin >= samples) return;
  const uint in_word = min(samples - word * 32, 32u), end = min(begin + run_length, in_word);
  vstore8(box_of_samples(targets + (ulong)word * END_WORDS * 32, begin, end), i, boxes);
}

/* Occlusion bits of CLRAD_WIDTH origins against 32 samples; work-item = (tile of origins, word of samples). Each run of at most
 * `run_length` samples has a shaft of its own; one that meets more than `budget` triangles that need every sample is given up for
 * packets. USUAL: half as many as it has samples, for that much it would save, and no more than 8, by when it is lost as a rule; with
 * a budget of 0 there are packets only.
 * origins, samples: ends in groups of CLRAD_WIDTH and of 32; boxes: of the runs. counts: see count().
 * pre: samples > 0, words = ceil(samples / 32). post: masks[origin * words + word], unused bits 0. */
#define USUAL CLRAD_NONE

__kernel void shaft_occluded(__global const uint* origins, uint origin_count, __global const uint* targets,
                             __global const float* boxes, uint samples, uint words, uint run_length, uint budget,
                             __global const uint* nodes, __global const clrad_triangle* triangles,
                             __global const clrad_facet* facets, __global uint* masks, volatile __global uint* counts) {
  const uint tile = get_global_id(0) / words, word = get_global_id(0) % words;
  if (tile * CLRAD_WIDTH >= origin_count) return;
  question q;
  begin_question(&q, origins + (ulong)tile * END_WORDS * CLRAD_WIDTH, targets + (ulong)word * END_WORDS * 32);
  const clrad_ints valid = CLRAD_IS(CLRAD_LANES < (int)(origin_count - tile * CLRAD_WIDTH));
  const float8 receivers = box_of_lanes(q.ax, q.ay, q.az);

  const uint in_word = min(samples - word * 32, 32u);
  clrad_ints result = 0;
  uint given_up = 0, recent[RECENT];
  for (uint i = 0; i < RECENT; ++i) recent[i] = CLRAD_NONE;
  for (uint begin = 0; begin < in_word; begin += run_length) {
    const uint end = min(begin + run_length, in_word);
    const clrad_ints asked = valid & (int)((end == 32 ? 0xffffffffu : (1u << end) - 1) & ~((1u << begin) - 1));
    q.todo = asked;
    q.have_directions = q.loops = 0;
    int done = 0;
    if (budget > 0) {
      run r;
      const float8 there = vload8(word * ((31 + run_length) / run_length) + begin / run_length, boxes);
      run_in(&q, there, begin, end, &r);
      const shaft s = shaft_between(receivers, there);
      const uint usual = clamp((end - begin) / 2, 1u, 8u);
      done = walk(&q, &r, &s, budget == USUAL ? usual : budget, nodes, triangles, facets);
      given_up += !done;
    }
    if (!done) {
      direct(&q, begin, end);
      for (uint k = begin; k < end; ++k) walk_packet(&q, k, receivers, recent, nodes, triangles, facets);
    }
    result |= asked & ~q.todo;
  }

  int words_of_lanes[CLRAD_WIDTH];
  CLRAD_STORE(result, words_of_lanes);
  for (uint lane = 0; lane < CLRAD_WIDTH && tile * CLRAD_WIDTH + lane < origin_count; ++lane)
    masks[((ulong)tile * CLRAD_WIDTH + lane) * words + word] = (uint)words_of_lanes[lane];
  volatile __global uint* place = count(counts, q.undecided_count, q.asked + q.asked_alone);
  clrad_count(place + 4, given_up);
  clrad_count(place + 6, q.nodes);
  clrad_count(place + 8, q.boxes);
  clrad_count(place + 10, q.asked);
  clrad_count(place + 12, q.asked_alone);
}

/* Occlusion of pairs (Segments::samples == 0): origin i against target i; work-item = CLRAD_WIDTH segments.
 * post: masks[i] is 1 or 0. */
__kernel void shaft_occluded_pairs(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                                   uint origin_count, __global const CLRAD_POINT_T* targets, __global const uint* nodes,
                                   __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                   __global uint* masks, volatile __global uint* counts) {
  const uint begin = get_global_id(0) * CLRAD_WIDTH;
  if (begin >= origin_count) return;
  clrad_segment s[CLRAD_WIDTH];
  int live_lanes[CLRAD_WIDTH], hits[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    s[lane] = clrad_fetch_segment(origins, active, use_active, targets, 0, min(begin + lane, origin_count - 1));
    live_lanes[lane] = begin + lane < origin_count ? -1 : 0;
  }
  packet p;
  load_packet(s, &p);
  const clrad_ints chosen = CLRAD_LOAD(live_lanes);
  clrad_ints live = chosen;
  const clrad_floats ends = 1.0f, nowhere = -1.0f;
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w;
  begin_walk(&w, &p);
  for (uint leaf = next_leaf(&w, live ? ends : nowhere, 1.0f, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, live ? ends : nowhere, 1.0f, nodes, &in_leaf)) {
    for (uint i = leaf; i < leaf + in_leaf; ++i) live &= ~packet_blocked(s, &p, triangles + i, facets + i, live, &undecided_count);
    asked += in_leaf;
    if (clrad_bits_of_any(live) == 0) break;
  }
  CLRAD_STORE(chosen & ~live, hits);
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < origin_count; ++lane) masks[begin + lane] = hits[lane] & 1;
  count(counts, undecided_count, asked);
}

/* The nearest hit of each segment by (t, triangle); work-item = CLRAD_WIDTH consecutive segments of any form. What lies behind a hit is
 * left out: no triangle is met nearer than where the segment enters its box, and that of a node, made of the same numbers, no later.
 * post: triangle[r] indexes the input triangles or is CLRAD_NONE, t[r] in [0, 1] (1 where there is none). */
__kernel void shaft_closest(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                            ulong segment_count, __global const CLRAD_POINT_T* targets, uint samples, __global const uint* nodes,
                            __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                            __global const uint* input_index, __global uint* triangle, __global float* t,
                            volatile __global uint* counts) {
  const ulong begin = (ulong)get_global_id(0) * CLRAD_WIDTH;
  if (begin >= segment_count) return;
  nearest_hits n;
  load_nearest(&n, origins, active, use_active, targets, samples, begin, segment_count);
  const clrad_ints there = CLRAD_IS(CLRAD_LANES < (int)n.lanes);
  const clrad_floats nowhere = -1.0f;
  clrad_floats until = there ? CLRAD_LOAD(n.t) : nowhere;
  float last = 1.0f;
  uint asked = 0, in_leaf;
  packet_walk w;
  begin_walk(&w, &n.p);
  for (uint leaf = next_leaf(&w, until, last, nodes, &in_leaf); leaf != CLRAD_NONE; leaf = next_leaf(&w, until, last, nodes, &in_leaf)) {
    int met = 0;
    for (uint i = leaf; i < leaf + in_leaf; ++i) met |= meet(&n, triangles + i, facets + i, input_index[i]);
    asked += in_leaf;
    if (!met) continue;
    until = there ? CLRAD_LOAD(n.t) : nowhere;
    last = greatest_lane(until);
  }
  store_nearest(&n, begin, triangle, t);
  count(counts, n.exact, asked);
}
