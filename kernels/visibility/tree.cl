/* A tree of boxes over the occluders by parallel locally-ordered clustering (Meister & Bittner, "Parallel Locally-Ordered
 * Clustering for Bounding Volume Hierarchy Construction", 2018): triangles in Morton order are clusters; again and again
 * each cluster finds, among its RADIUS neighbours on either side, the one with which it makes the smallest box, and pairs
 * that choose each other become one. The host scans and compacts between the kernels, which is all that they need.
 *
 * Nodes 0 .. n-1 are the triangles in Morton order, n .. 2n-2 the pairs as they are made; the last is the root.
 * Boxes are conservative (shared/box.cl).
 */
#ifndef CLRAD_TREE_CL
#define CLRAD_TREE_CL
#include "shared/box.cl"
#include "shared/spread.cl"
#include "shared/types.h"

#define RADIUS 8      /* clusters looked at on either side: one vector each */
#define FAR 1e18f     /* corners of the boxes beside the first and the last cluster: nothing joins those */
#define NODE_COST 1.0f     /* to test the boxes of a node's two children... */
#define TRIANGLE_COST 2.0f /* ... and to test a triangle */
#define LEAF_TRIANGLES 4   /* at most in a leaf */

/* Box of each triangle, and the Morton code of its middle in the box from `origin` with 1024 / cell a side.
 * post: box[6 i ..] = low, high; keys[i] < 2^30; values[i] = i. */
__kernel void tree_leaves(__global const clrad_triangle* triangles, uint n, float origin_x, float origin_y,
                          float origin_z, float cells_x, float cells_y, float cells_z, __global float* box,
                          __global uint* keys, __global uint* values) {
  const uint i = get_global_id(0);
  if (i >= n) return;
  __global const clrad_triangle* t = triangles + i;
  const float lx = lowest(t->x0, t->x0_lo, t->x1, t->x1_lo, t->x2, t->x2_lo);
  const float ly = lowest(t->y0, t->y0_lo, t->y1, t->y1_lo, t->y2, t->y2_lo);
  const float lz = lowest(t->z0, t->z0_lo, t->z1, t->z1_lo, t->z2, t->z2_lo);
  const float hx = highest(t->x0, t->x0_lo, t->x1, t->x1_lo, t->x2, t->x2_lo);
  const float hy = highest(t->y0, t->y0_lo, t->y1, t->y1_lo, t->y2, t->y2_lo);
  const float hz = highest(t->z0, t->z0_lo, t->z1, t->z1_lo, t->z2, t->z2_lo);
  box[6 * i] = lx;
  box[6 * i + 1] = ly;
  box[6 * i + 2] = lz;
  box[6 * i + 3] = hx;
  box[6 * i + 4] = hy;
  box[6 * i + 5] = hz;
  const float x = clamp((0.5f * (lx + hx) - origin_x) * cells_x, 0.0f, 1023.0f);
  const float y = clamp((0.5f * (ly + hy) - origin_y) * cells_y, 0.0f, 1023.0f);
  const float z = clamp((0.5f * (lz + hz) - origin_z) * cells_z, 0.0f, 1023.0f);
  keys[i] = spread_bits((uint)x) | spread_bits((uint)y) << 1 | spread_bits((uint)z) << 2;
  values[i] = i;
}

/* Coordinate c of the boxes of clusters, beside each other; RADIUS boxes far away on either side of the `room` ones. */
#define CLUSTERS(boxes, c, room) ((boxes) + (ulong)(c) * ((room) + 2 * RADIUS) + RADIUS)

/* The clusters to begin with: the triangles in Morton order. A node: box (6), children (2), triangles below, inner nodes
 * below and itself, cost, depth: 12 words. Work-item RADIUS + i; those beyond either end put the far boxes there. */
#define NODE_WORDS 12

static inline void put_far(__global float* boxes, uint room, int i) {
  for (int c = 0; c < 6; ++c) CLUSTERS(boxes, c, room)[i] = c < 3 ? -FAR : FAR;
}

__kernel void tree_start(uint n, __global const uint* values, __global const float* box, __global uint* nodes,
                         __global float* boxes, __global uint* clusters) {
  const int i = (int)get_global_id(0) - RADIUS;
  if (i >= (int)n + RADIUS) return;
  if (i < 0 || i >= (int)n) {
    put_far(boxes, n, i);
    return;
  }
  __global const float* from = box + 6 * values[i];
  __global uint* node = nodes + (ulong)NODE_WORDS * i;
  for (int c = 0; c < 6; ++c) {
    node[c] = as_uint(from[c]);
    CLUSTERS(boxes, c, n)[i] = from[c];
  }
  const float dx = from[3] - from[0], dy = from[4] - from[1], dz = from[5] - from[2];
  node[6] = values[i];
  node[7] = CLRAD_NONE;
  node[8] = 1;
  node[9] = 0;
  node[10] = as_uint(TRIANGLE_COST * (dx * dy + dy * dz + dz * dx));
  node[11] = 1;
  clusters[i] = i;
}

#define LEAST(a, b) ((a) < (b) ? (a) : (b))
#define GREATEST(a, b) ((a) > (b) ? (a) : (b))

/* Half the surface of the box around cluster i and each of eight beside it; as int, for positive floats have that order. */
static inline int8 joint(__global const float* boxes, uint room, int i, int first) {
  const float8 lx = vload8(0, CLUSTERS(boxes, 0, room) + first), ly = vload8(0, CLUSTERS(boxes, 1, room) + first),
               lz = vload8(0, CLUSTERS(boxes, 2, room) + first), hx = vload8(0, CLUSTERS(boxes, 3, room) + first),
               hy = vload8(0, CLUSTERS(boxes, 4, room) + first), hz = vload8(0, CLUSTERS(boxes, 5, room) + first);
  const float8 ax = CLUSTERS(boxes, 0, room)[i], ay = CLUSTERS(boxes, 1, room)[i], az = CLUSTERS(boxes, 2, room)[i],
               bx = CLUSTERS(boxes, 3, room)[i], by = CLUSTERS(boxes, 4, room)[i], bz = CLUSTERS(boxes, 5, room)[i];
  const float8 dx = GREATEST(hx, bx) - LEAST(lx, ax), dy = GREATEST(hy, by) - LEAST(ly, ay),
               dz = GREATEST(hz, bz) - LEAST(lz, az);
  return as_int8((dx * dy + dy * dz) + dz * dx);
}

static inline int least_of(int8 v) {
  const int4 a = LEAST(v.lo, v.hi);
  const int2 b = LEAST(a.lo, a.hi);
  return LEAST(b.x, b.y);
}

/* nearest[i]: the cluster that makes the smallest box with i. Of equal boxes the one whose number differs from i's in the
 * lower bits: a rule that both sides of a pair see alike, so that the best pair is always mutual and the work ends, and
 * under which equal triangles pair up by twos. With `plain` all boxes count as equal: a balanced tree. */
__kernel void tree_nearest(uint count, uint room, uint plain, __global const float* boxes, __global uint* nearest) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const int8 lanes = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
  const int8 before = lanes + ((int)i - RADIUS), after = lanes + ((int)i + 1);
  int8 p = plain ? (int8)(0) : joint(boxes, room, (int)i, (int)i - RADIUS);
  int8 q = plain ? (int8)(0) : joint(boxes, room, (int)i, (int)i + 1);
  /* A box that overflowed is no reason to pair with what is not there. */
  p = before < 0 ? (int8)(0x7fffffff) : p;
  q = after >= (int)count ? (int8)(0x7fffffff) : q;
  const int least = least_of(LEAST(p, q));
  const int8 x = ((p == least) & (before >= 0)) ? before ^ (int)i : (int8)(0x7fffffff);
  const int8 y = ((q == least) & (after < (int)count)) ? after ^ (int)i : (int8)(0x7fffffff);
  nearest[i] = (uint)(least_of(LEAST(x, y)) ^ (int)i);
}

/* stays[i]: 0 when i becomes part of a pair with a lower number; makes[i]: 1 when it becomes a pair with a higher one. */
__kernel void tree_pair(uint count, __global const uint* nearest, __global uint* stays, __global uint* makes) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const uint j = nearest[i];
  const uint mutual = nearest[j] == i;
  stays[i] = !(mutual && j < i);
  makes[i] = mutual && i < j;
}

/* The clusters of the next round. position and made: exclusive sums of stays and makes; left = how many stay. */
__kernel void tree_merge(uint count, uint room, uint first_node, uint left, __global const uint* nearest,
                         __global const uint* stays, __global const uint* makes, __global const uint* position,
                         __global const uint* made, __global const uint* clusters, __global const float* boxes,
                         __global uint* nodes, __global uint* next_clusters, __global float* next_boxes) {
  const int i = (int)get_global_id(0) - RADIUS;
  if (i >= (int)count + RADIUS) return;
  if (i < 0) put_far(next_boxes, room, i);
  if (i >= (int)left && i < (int)left + RADIUS) put_far(next_boxes, room, i);
  if (i < 0 || i >= (int)count || !stays[i]) return;
  const uint at = position[i];
  uint id = clusters[i];
  float b[6];
  for (int c = 0; c < 6; ++c) b[c] = CLUSTERS(boxes, c, room)[i];
  if (makes[i]) {
    const uint j = nearest[i];
    __global const uint* one = nodes + (ulong)NODE_WORDS * id;
    __global const uint* two = nodes + (ulong)NODE_WORDS * clusters[j];
    for (int c = 0; c < 6; ++c) {
      const float other = CLUSTERS(boxes, c, room)[j];
      b[c] = c < 3 ? LEAST(b[c], other) : GREATEST(b[c], other);
    }
    const float dx = b[3] - b[0], dy = b[4] - b[1], dz = b[5] - b[2], area = dx * dy + dy * dz + dz * dx;
    const uint triangles = one[8] + two[8];
    const float split = NODE_COST * area + as_float(one[10]) + as_float(two[10]);
    const float leaf = TRIANGLE_COST * area * convert_float(triangles);
    const int is_leaf = triangles <= LEAF_TRIANGLES && leaf <= split;
    const uint depth = 1 + (one[11] > two[11] ? one[11] : two[11]);
    __global uint* node = nodes + (ulong)NODE_WORDS * (first_node + made[i]);
    for (int c = 0; c < 6; ++c) node[c] = as_uint(b[c]);
    node[6] = id;
    node[7] = clusters[j];
    node[8] = triangles;
    node[9] = is_leaf ? 0 : 1 + one[9] + two[9];
    node[10] = as_uint(is_leaf ? leaf : split);
    node[11] = depth;
    id = first_node + made[i];
  }
  next_clusters[at] = id;
  for (int c = 0; c < 6; ++c) CLUSTERS(next_boxes, c, room)[at] = b[c];
}

/* The first triangle below each of the nodes [first, first + count), whose own is known: later ones come before earlier ones.
 * order[k]: which triangle is the k-th, depth first. */
__kernel void tree_begin(uint first, uint count, uint n, __global const uint* nodes, __global uint* begin,
                         __global uint* order) {
  if (get_global_id(0) >= count) return;
  const uint i = first + get_global_id(0);
  uint triangle = begin[i];
  for (uint k = 0; k < 2; ++k) {
    const uint child = nodes[(ulong)NODE_WORDS * i + 6 + k];
    __global const uint* c = nodes + (ulong)NODE_WORDS * child;
    if (child < n) order[triangle] = c[6];
    begin[child] = triangle;
    triangle += c[8];
  }
}

/* The tree as it is walked: WIDE children a node, so that one vector tests their boxes. A node: six rows of WIDE coordinates (low x
 * y z, high x y z), then a code for each child: an inner node's place << 3, or a leaf's first triangle << 3 | how many; a child
 * that is not there has its box inside out and the code 0. Eight spare words fill the cache lines. */
#define WIDE 8
#define WIDE_WORDS 64

static inline int is_leaf(__global const uint* nodes, uint n, uint i) {
  return i < n || nodes[(ulong)NODE_WORDS * i + 9] == 0;
}

static inline float area_of(__global const uint* node) {
  const float dx = as_float(node[3]) - as_float(node[0]), dy = as_float(node[4]) - as_float(node[1]),
              dz = as_float(node[5]) - as_float(node[2]);
  return dx * dy + dy * dz + dz * dx;
}

/* One level of wide nodes: node first + i stands for the pair level[i]. Its two children give way to theirs, the largest box first,
 * until there are WIDE of them or only leaves. child[WIDE i ..]: what they are; inner[i]: how many are no leaves. */
__kernel void tree_widen(uint count, uint n, uint first, __global const uint* level, __global const uint* nodes,
                         __global const uint* begin, __global uint* wide, __global uint* child, __global uint* inner) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const uint* top = nodes + (ulong)NODE_WORDS * level[i];
  uint chosen[WIDE], many = 2;
  chosen[0] = top[6];
  chosen[1] = top[7];
  while (many < WIDE) {
    uint largest = WIDE;
    float area = -1.0f;
    for (uint k = 0; k < many; ++k) {
      if (is_leaf(nodes, n, chosen[k])) continue;
      const float mine = area_of(nodes + (ulong)NODE_WORDS * chosen[k]);
      if (largest == WIDE || mine > area) {
        area = mine;
        largest = k;
      }
    }
    if (largest == WIDE) break;
    __global const uint* split = nodes + (ulong)NODE_WORDS * chosen[largest];
    chosen[largest] = split[6];
    chosen[many++] = split[7];
  }
  __global uint* w = wide + (ulong)WIDE_WORDS * (first + i);
  uint inner_ones = 0;
  for (uint k = 0; k < WIDE; ++k) {
    const int there = k < many;
    const uint c = there ? chosen[k] : CLRAD_NONE;
    __global const uint* node = nodes + (ulong)NODE_WORDS * (there ? c : 0);
    for (uint a = 0; a < 6; ++a) w[WIDE * a + k] = there ? node[a] : as_uint(a < 3 ? FAR : -FAR);
    const int leaf = there && is_leaf(nodes, n, c);
    w[7 * WIDE + k] = 0;
    w[6 * WIDE + k] = leaf ? begin[c] << 3 | node[8] : 0;
    inner_ones += there && !leaf;
    child[WIDE * i + k] = there && !leaf ? c : CLRAD_NONE;
  }
  inner[i] = inner_ones;
}

/* Codes of the inner children of a level, which are the next level from node `next` on; offsets: exclusive sums of inner. */
__kernel void tree_link(uint count, uint first, uint next, __global const uint* child, __global const uint* offsets,
                        __global uint* wide, __global uint* next_level) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  uint at = offsets[i];
  for (uint k = 0; k < WIDE; ++k) {
    const uint c = child[WIDE * i + k];
    if (c == CLRAD_NONE) continue;
    wide[(ulong)WIDE_WORDS * (first + i) + 6 * WIDE + k] = (next + at) << 3;
    next_level[at++] = c;
  }
}

/* Triangles and their facets in the tree's order. index: which of the input's triangles each is. */
__kernel void tree_triangles(uint n, __global const uint* order, __global const uint* triangles,
                             __global const uint* facets, __global const uint* input_index, __global uint* to_triangles,
                             __global uint* to_facets, __global uint* index) {
  const uint k = get_global_id(0);
  if (k >= n) return;
  const uint i = order[k];
  const uint triangle_words = sizeof(clrad_triangle) / 4, facet_words = sizeof(clrad_facet) / 4;
  for (uint w = 0; w < triangle_words; ++w) to_triangles[(ulong)triangle_words * k + w] = triangles[(ulong)triangle_words * i + w];
  for (uint w = 0; w < facet_words; ++w) to_facets[(ulong)facet_words * k + w] = facets[(ulong)facet_words * i + w];
  index[k] = input_index[i];
}

#endif
