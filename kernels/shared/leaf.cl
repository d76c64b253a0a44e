/* Which element a point of a polygon lies in, and what a value there is interpolated from: the linear quadtree
 * (Gargantini 1982) read by the path of the point through it. The same as host/mesh/locate.cpp.
 *
 * By vertices alone: bilinear or linear in the element's corners. Where an edge has a T-vertex, what it differs by from the
 * mean of the edge's ends is added as a hat along that edge, falling off to nothing at the other edges. A bend (host/mesh/bend.hpp)
 * is a parabola along its edge, or its half of an edge with a T-vertex, that falls off likewise (Coons 1967). Both sides of
 * every edge have the same values, so there is no crack and no jump between levels.
 *
 * Tables: trees[4 p + ..] = first patch, patches_u, patches_v, corners of polygon p; patch_first[patch] (patches + 1 values);
 * code, level [element]; vertex, middle [4 element + k]; edge [8 element + 2 k + half]. */
#ifndef CLRAD_LEAF_CL
#define CLRAD_LEAF_CL

#define CLRAD_DEPTH 15
#define CLRAD_LEAF_VERTICES 8
#define CLRAD_LEAF_EDGES 8
#define CLRAD_TREE_UINTS 4

/* One level down; at[] is (x, y) in a quad, barycentric in a triangle. Returns the child. */
static inline uint clrad_descend(REAL* at, int quad) {
  if (quad) {
    const int right = at[0] >= (REAL)0.5f, up = at[1] >= (REAL)0.5f;
    at[0] = 2 * at[0] - right;
    at[1] = 2 * at[1] - up;
    return up ? (right ? 2 : 3) : (right ? 1 : 0);
  }
  for (uint k = 0; k < 3; k++)
    if (at[k] >= (REAL)0.5f) {
      for (uint i = 0; i < 3; i++) at[i] = 2 * at[i] - (i == k);
      return k;
    }
  for (uint i = 0; i < 3; i++) at[i] = 1 - 2 * at[i];
  return 3;
}

/* What an edge's values along it weigh: of a T-vertex in its middle the hat, of the bend of the whole edge or of each half
 * the parabola. a and b: distances from its two ends, of sum 1, or a triangle's barycentric coordinates there. On other edges all
 * are 0. A triangle's hat less its half parabolas is a whole one all over, so that quadratic functions are met. */
typedef struct clrad_along_edge {
  REAL hat, whole, half_a, half_b;
} clrad_along_edge;

static inline clrad_along_edge clrad_along(REAL a, REAL b) {
  clrad_along_edge w;
  w.hat = 2 * (a < b ? a : b) * (a + b);
  w.whole = a * b;
  w.half_a = a > b ? 2 * b * (a - b) : 0;
  w.half_b = a > b ? 0 : 2 * a * (b - a);
  return w;
}

static inline REAL clrad_clamped(REAL x, REAL high) { return x > 0 ? (x < high ? x : high) : 0; /* NaN: 0 */ }

/* The element of a patch at at[] (as for clrad_descend; 0 to 1); depth: no level is deeper. vertices and weights, CLRAD_LEAF_VERTICES of each; unused ones
 * have weight 0. bends: weights of the bends of edges, CLRAD_LEAF_EDGES of them. Returns the element. */
static uint clrad_leaf_in_patch(REAL* at, uint depth, uint patch, uint corners, __global const uint* patch_first,
                                __global const uint* codes, __global const uint* levels, __global const uint* vertex,
                                __global const uint* middle, uint* vertices, REAL* weights, REAL* bends) {
  const int quad = corners == 4;
  REAL deepest[3] = {at[0], at[1], at[2]};
  uint code = 0;
  for (uint level = 0; level < depth; level++) code = code << 2 | clrad_descend(deepest, quad);
  code <<= 2 * (CLRAD_DEPTH - depth);
  /* The last leaf whose code is not past the point's: the patch's first has code 0. */
  uint begin = patch_first[patch], end = patch_first[patch + 1];
  while (end - begin > 1) {
    const uint half_way = begin + (end - begin) / 2;
    if (codes[half_way] <= code)
      begin = half_way;
    else
      end = half_way;
  }
  for (uint level = levels[begin]; level > 0; level--) clrad_descend(at, quad);

  REAL from[4], to[4], fall[4] = {1, 1, 1, 0}; /* of each edge: distances from its ends, and how much is left at the point */
  if (quad) {
    const REAL x1 = 1 - at[0], y1 = 1 - at[1];
    weights[0] = x1 * y1;
    weights[1] = at[0] * y1;
    weights[2] = at[0] * at[1];
    weights[3] = x1 * at[1];
    from[0] = x1, to[0] = at[0], fall[0] = y1;
    from[1] = y1, to[1] = at[1], fall[1] = at[0];
    from[2] = at[0], to[2] = x1, fall[2] = at[1];
    from[3] = at[1], to[3] = y1, fall[3] = x1;
  } else {
    for (uint k = 0; k < 3; k++) {
      weights[k] = from[k] = at[k];
      to[k] = at[k == 2 ? 0 : k + 1];
    }
    weights[3] = from[3] = to[3] = 0;
  }
  for (uint k = 0; k < 4; k++) {
    vertices[k] = vertex[4 * begin + (k < corners ? k : 0)];
    const uint t = k < corners ? middle[4 * begin + k] : CLRAD_NONE;
    const int there = t != CLRAD_NONE;
    const clrad_along_edge along = clrad_along(from[k], to[k]);
    vertices[4 + k] = there ? t : vertices[0];
    weights[4 + k] = there ? fall[k] * along.hat : 0;
    bends[2 * k] = fall[k] * (there ? along.half_a : along.whole);
    bends[2 * k + 1] = there ? fall[k] * along.half_b : 0;
  }
  for (uint k = 0; k < corners; k++) {
    weights[k] -= weights[4 + k] / 2;
    weights[k + 1 == corners ? 0 : k + 1] -= weights[4 + k] / 2;
  }
  return begin;
}

/* The same of a polygon; u, v are clamped to it. */
static uint clrad_leaf(REAL u, REAL v, __global const uint* polygon, __global const uint* patch_first,
                       __global const uint* codes, __global const uint* levels, __global const uint* vertex,
                       __global const uint* middle, uint* vertices, REAL* weights,
                       REAL* bends) {
  const uint corners = polygon[3], n = polygon[1], m = polygon[2];
  const int quad = corners == 4;
  uint patch = polygon[0];
  REAL at[3];
  u = clrad_clamped(u, 1);
  v = clrad_clamped(v, quad ? 1 : 1 - u);
  const REAL pu = u * n, pv = v * m;
  const uint i = min((uint)pu, n - 1);
  const uint j = min((uint)pv, quad ? m - 1 : n - 1 - i);
  const REAL x = clrad_clamped(pu - i, 1), y = clrad_clamped(pv - j, 1);
  if (quad) {
    patch += j * n + i;
    at[0] = x;
    at[1] = y;
    at[2] = 0;
  } else {
    patch += j * (2 * n - j) + 2 * i;
    /* The last patch of a row has no turned neighbour: past its edge there is only rounding. */
    if (x + y <= 1 || i + j + 1 == n) {
      at[0] = clrad_clamped(1 - x - y, 1);
      at[1] = x;
      at[2] = y;
    } else {
      patch++;
      at[0] = x + y - 1;
      at[1] = 1 - x;
      at[2] = 1 - y;
    }
  }
  return clrad_leaf_in_patch(at, CLRAD_DEPTH, patch, corners, patch_first, codes, levels, vertex, middle, vertices, weights, bends);
}

#endif
