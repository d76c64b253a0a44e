/* Visibility by shafts through a tree of boxes: a work-item takes CLRAD_WIDTH neighbouring receivers, one a lane, and a run
 * of samples of one shooter, and walks the tree with the hull of both boxes (Haines & Wallace, "Shaft Culling for Efficient
 * Ray-Traced Radiosity", 1991). What lies outside the hull is met by no segment; a triangle inside it is first held against
 * the samples' box as a whole: along the box its three volumes (shared/triangle.cl) are linear, so that their middle and
 * their reach say of each receiver that all samples are blocked, that none is, or that they must be asked one by one. What
 * floats cannot tell goes to the exact predicate. An empty hull leaves everything visible, and no ray was traced.
 *
 * Bits are those of `serial`: a segment meets a triangle only where the hull is, and every test has a bound of its error.
 */
#include "shared/hull.cl"
#include "shared/packet_test.cl"
#include "shared/question.cl"
#include "shared/sample_packet.cl"

/* Walks the tree for one run of samples; ends early when all of its bits are known. 0 when that would take more than `budget`
 * triangles: the bits known by then are true all the same. */
static inline int walk(question* q, const run* r, const shaft* s, uint budget, __global const uint* nodes,
                       __global const clrad_triangle* triangles, __global const clrad_facet* facets) {
  uint stack[STACK];
  uint top = 1;
  stack[0] = 0;
  while (top > 0) {
    __global const uint* node = nodes + (ulong)WIDE_WORDS * stack[--top];
    uint met = children_met(s, (__global const float*)node);
    for (; met; met &= met - 1) {
      const uint code = node[6 * WIDE + lowest_bit(met)], in_leaf = code & 7u, first = code >> 3;
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

/* Ends on the visibility grid, once for all the work-items that read them: in groups of `size`, END_WORDS runs of that many words
 * each (x y z, their low parts, plane); the last group is filled up with the last end. Work-item: an end. */
__kernel void shaft_ends(__global const CLRAD_POINT_T* points, __global const uint* active, uint use_active, uint count,
                         uint size, __global uint* ends) {
  const uint i = get_global_id(0);
  if (i >= (count + size - 1) / size * size) return;
  const uint chosen = min(i, count - 1);
  __global const CLRAD_POINT_T* p = points + (use_active ? active[chosen] : chosen);
  const clrad_end s = clrad_snap_point(p);
  __global uint* e = ends + (ulong)(i / size) * END_WORDS * size + i % size;
  e[0] = as_uint(s.x);
  e[size] = as_uint(s.y);
  e[2 * size] = as_uint(s.z);
  e[3 * size] = as_uint(s.x_lo);
  e[4 * size] = as_uint(s.y_lo);
  e[5 * size] = as_uint(s.z_lo);
  e[6 * size] = s.plane;
}

/* Occlusion bits of CLRAD_WIDTH origins against 32 samples; work-item = (tile of origins, word of samples), for the tiles whose
 * numbers are from `from` to below `to` modulo PERIOD. Each run of at most `run_length` samples has a shaft of its own; one that
 * meets more than `budget` triangles that need every sample is given up for packets, and with a budget of 0 there are packets only.
 * origins, samples: ends in groups of CLRAD_WIDTH and of 32. counts: exact tests, then pairs of a receiver and a triangle looked at.
 * pre: samples > 0, words = ceil(samples / 32). post: masks[origin * words + word], unused bits 0. */
#define PERIOD 16

__kernel void shaft_occluded(__global const uint* origins, uint origin_count, uint from, uint to,
                             __global const uint* targets, uint samples, uint words, uint run_length, uint budget,
                             __global const uint* nodes,
                             __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                             __global uint* masks, volatile __global uint* counts) {
  const uint tiles = (origin_count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint number = get_global_id(0) / words, word = get_global_id(0) % words;
  const uint tile = number / (to - from) * PERIOD + from + number % (to - from);
  if (tile >= tiles) return;
  question q;
  q.a = origins + (ulong)tile * END_WORDS * CLRAD_WIDTH;
  q.b = targets + (ulong)word * END_WORDS * 32;
  __global const float* a = (__global const float*)q.a;
  q.ax = CLRAD_LOAD(a);
  q.ay = CLRAD_LOAD(a + CLRAD_WIDTH);
  q.az = CLRAD_LOAD(a + 2 * CLRAD_WIDTH);
  q.ax_lo = CLRAD_LOAD(a + 3 * CLRAD_WIDTH);
  q.ay_lo = CLRAD_LOAD(a + 4 * CLRAD_WIDTH);
  q.az_lo = CLRAD_LOAD(a + 5 * CLRAD_WIDTH);
  q.a_plane = CLRAD_LOAD((__global const int*)q.a + 6 * CLRAD_WIDTH);
  q.undecided_count = q.asked = 0;
  const clrad_ints valid = CLRAD_IS(CLRAD_LANES < (int)(origin_count - tile * CLRAD_WIDTH));
  const float8 receivers = box_of_receivers(&q);

  const uint in_word = min(samples - word * 32, 32u);
  clrad_ints result = 0;
  uint recent[RECENT];
  for (uint i = 0; i < RECENT; ++i) recent[i] = CLRAD_NONE;
  for (uint begin = 0; begin < in_word; begin += run_length) {
    const uint end = min(begin + run_length, in_word);
    const clrad_ints asked = valid & (int)((end == 32 ? 0xffffffffu : (1u << end) - 1) & ~((1u << begin) - 1));
    q.todo = asked;
    q.have_directions = q.loops = 0;
    int done = 0;
    if (budget > 0) {
      run r;
      const float8 there = run_of_samples(&q, begin, end, &r);
      const shaft s = shaft_between(receivers, there);
      done = walk(&q, &r, &s, budget, nodes, triangles, facets);
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
  clrad_count(counts, q.undecided_count);
  clrad_count(counts + 2, q.asked * CLRAD_WIDTH);
}

/* A packet's walk: next_leaf gives leaf after leaf, its first triangle and how many there are, and CLRAD_NONE at the end. */
typedef struct packet_walk {
  slabs lanes;
  uint stack[STACK + WIDE];
  uint top;
} packet_walk;

static inline packet_walk walk_of(const packet* p) {
  packet_walk w;
  w.lanes = slabs_of(p->ax, p->ay, p->az, p->dx, p->dy, p->dz);
  w.stack[0] = 0;
  w.top = 1;
  return w;
}

static inline uint next_leaf(packet_walk* w, clrad_ints live, __global const uint* nodes, uint* triangles) {
  while (w->top > 0) {
    const uint code = w->stack[--w->top];
    if (code & 7u) {
      *triangles = code & 7u;
      return code >> 3;
    }
    __global const uint* node = nodes + (ulong)WIDE_WORDS * (code >> 3);
    for (uint k = 0; k < WIDE; ++k) { /* the root is nobody's child: a code of 0 is a child that is not there */
      const uint child = node[6 * WIDE + k];
      if (child && clrad_bits_of_any(meets_padded(&w->lanes, (__global const float*)node, k) & live)) w->stack[w->top++] = child;
    }
  }
  return CLRAD_NONE;
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
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w = walk_of(&p);
  for (uint leaf = next_leaf(&w, live, nodes, &in_leaf); leaf != CLRAD_NONE && clrad_bits_of_any(live) != 0;
       leaf = next_leaf(&w, live, nodes, &in_leaf)) {
    for (uint i = leaf; i < leaf + in_leaf; ++i) live &= ~packet_blocked(s, &p, triangles + i, facets + i, live, &undecided_count);
    asked += in_leaf;
  }
  CLRAD_STORE(chosen & ~live, hits);
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < origin_count; ++lane) masks[begin + lane] = hits[lane] & 1;
  clrad_count(counts, undecided_count);
  clrad_count(counts + 2, asked * CLRAD_WIDTH);
}

/* The nearest hit of each segment by (t, triangle); work-item = CLRAD_WIDTH consecutive segments of any form. Nothing ends
 * early: how near a hit is to say is one float formula for every engine (clrad_hit_parameter), and for a triangle seen edge-on
 * it may call one nearer that lies behind.
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
  uint asked = 0, in_leaf;
  packet_walk w = walk_of(&n.p);
  const clrad_ints all = -1;
  for (uint leaf = next_leaf(&w, all, nodes, &in_leaf); leaf != CLRAD_NONE; leaf = next_leaf(&w, all, nodes, &in_leaf)) {
    for (uint i = leaf; i < leaf + in_leaf; ++i) meet(&n, triangles + i, facets + i, input_index[i]);
    asked += in_leaf;
  }
  store_nearest(&n, begin, triangle, t);
  clrad_count(counts, n.exact);
  clrad_count(counts + 2, asked * CLRAD_WIDTH);
}
