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

/* A packet of segments that have nothing in common: origins and inverse directions, a lane each. */
static inline clrad_ints meets_box(const packet* p, clrad_floats ix, clrad_floats iy, clrad_floats iz,
                                   __global const float* node, uint k) {
  const clrad_floats x0 = ((node[k] - PACKET_PAD) - p->ax) * ix, x1 = ((node[3 * WIDE + k] + PACKET_PAD) - p->ax) * ix;
  const clrad_floats y0 = ((node[WIDE + k] - PACKET_PAD) - p->ay) * iy,
                     y1 = ((node[4 * WIDE + k] + PACKET_PAD) - p->ay) * iy;
  const clrad_floats z0 = ((node[2 * WIDE + k] - PACKET_PAD) - p->az) * iz,
                     z1 = ((node[5 * WIDE + k] + PACKET_PAD) - p->az) * iz;
  const clrad_floats near_x = CLRAD_MIN(x0, x1), near_y = CLRAD_MIN(y0, y1), near_z = CLRAD_MIN(z0, z1);
  const clrad_floats far_x = CLRAD_MAX(x0, x1), far_y = CLRAD_MAX(y0, y1), far_z = CLRAD_MAX(z0, z1);
  clrad_floats begin = 0.0f, end = 1.0f;
  begin = CLRAD_MAX(near_x, begin);
  begin = CLRAD_MAX(near_y, begin);
  begin = CLRAD_MAX(near_z, begin);
  end = CLRAD_MIN(far_x, end);
  end = CLRAD_MIN(far_y, end);
  end = CLRAD_MIN(far_z, end);
  return CLRAD_IS(begin <= end);
}

/* A packet's walk: next_leaf gives leaf after leaf, its first triangle and how many there are, and CLRAD_NONE at the end. */
typedef struct packet_walk {
  uint stack[STACK + WIDE];
  uint top;
} packet_walk;

static inline uint next_leaf(packet_walk* w, const packet* p, clrad_floats ix, clrad_floats iy, clrad_floats iz,
                             clrad_ints live, __global const uint* nodes, uint* triangles) {
  while (w->top > 0) {
    const uint code = w->stack[--w->top];
    if (code & 7u) {
      *triangles = code & 7u;
      return code >> 3;
    }
    __global const uint* node = nodes + (ulong)WIDE_WORDS * (code >> 3);
    for (uint k = 0; k < WIDE; ++k) { /* the root is nobody's child: a code of 0 is a child that is not there */
      const uint child = node[6 * WIDE + k];
      if (child && clrad_bits_of_any(meets_box(p, ix, iy, iz, (__global const float*)node, k) & live)) w->stack[w->top++] = child;
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
  const clrad_floats ix = inverse(p.dx), iy = inverse(p.dy), iz = inverse(p.dz);
  clrad_ints live = CLRAD_LOAD(live_lanes), blocked = 0;
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, live, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
      ++asked;
      hit &= live;
      undecided &= live;
      if (clrad_bits_of_any(undecided) != 0) {
        int undecided_lanes[CLRAD_WIDTH];
        CLRAD_STORE(undecided, undecided_lanes);
        for (int lane = 0; lane < CLRAD_WIDTH; ++lane) {
          hits[lane] = 0;
          if (!undecided_lanes[lane]) continue;
          hits[lane] = clrad_blocked(s[lane], triangles[i]) ? -1 : 0;
          ++undecided_count;
        }
        hit |= CLRAD_LOAD(hits);
      }
      blocked |= hit;
      live &= ~hit;
      if (clrad_bits_of_any(live) == 0) w.top = 0;
    }
  CLRAD_STORE(blocked, hits);
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
  clrad_segment s[CLRAD_WIDTH];
  float nearest[CLRAD_WIDTH];
  uint which[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    const ulong r = begin + lane < segment_count ? begin + lane : segment_count - 1;
    s[lane] = clrad_fetch_segment(origins, active, use_active, targets, samples, r);
    nearest[lane] = 1.0f;
    which[lane] = CLRAD_NONE;
  }
  packet p;
  load_packet(s, &p);
  const clrad_floats ix = inverse(p.dx), iy = inverse(p.dy), iz = inverse(p.dz);
  uint undecided_count = 0, asked = 0, in_leaf;
  packet_walk w;
  w.stack[0] = 0;
  w.top = 1;
  for (uint leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf); leaf != CLRAD_NONE;
       leaf = next_leaf(&w, &p, ix, iy, iz, -1, nodes, &in_leaf))
    for (uint i = leaf; i < leaf + in_leaf; ++i) {
      clrad_ints hit, undecided;
      test_packet(&p, triangles + i, facets + i, &hit, &undecided);
      ++asked;
      if (clrad_bits_of_any(hit | undecided) == 0) continue;
      int hits[CLRAD_WIDTH], undecided_lanes[CLRAD_WIDTH];
      CLRAD_STORE(hit, hits);
      CLRAD_STORE(undecided, undecided_lanes);
      for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < segment_count; ++lane) {
        int met = hits[lane];
        if (undecided_lanes[lane]) {
          met = clrad_blocked(s[lane], triangles[i]);
          ++undecided_count;
        }
        if (!met) continue;
        const float where = clrad_hit_parameter(s[lane], triangles[i], facets[i]);
        if (which[lane] == CLRAD_NONE || where < nearest[lane] || (where == nearest[lane] && input_index[i] < which[lane])) {
          nearest[lane] = where;
          which[lane] = input_index[i];
        }
      }
    }
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < segment_count; ++lane) {
    triangle[begin + lane] = which[lane];
    t[begin + lane] = nearest[lane];
  }
  clrad_count(counts, undecided_count);
  clrad_count(counts + 2, asked * CLRAD_WIDTH);
}
