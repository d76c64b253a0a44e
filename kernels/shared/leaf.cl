/* Which element a point of a polygon lies in, and what a value there is interpolated from: the linear quadtree
 * (Gargantini 1982) read by the path of the point through it. The same as host/mesh/locate.cpp.
 *
 * Bilinear or linear in the element's corners. Where an edge has a T-vertex, what it differs by from the mean of the edge's
 * ends is added as a hat along that edge, falling off to nothing at the other edges: both sides of every edge have the same
 * values, so there is no crack and no jump between levels.
 *
 * Tables: trees[4 p + ..] = first patch, patches_u, patches_v, corners of polygon p; patch_first[patch] (patches + 1 values);
 * code, level [element]; vertex, middle [4 element + k]. */
#ifndef CLRAD_LEAF_CL
#define CLRAD_LEAF_CL

#define CLRAD_DEPTH 15
#define CLRAD_LEAF_VERTICES 8
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

static inline REAL clrad_hat(REAL t) { return 2 * (t < 1 - t ? t : 1 - t); }

static inline REAL clrad_clamped(REAL x, REAL high) { return x > 0 ? (x < high ? x : high) : 0; /* NaN: 0 */ }

/* vertices and weights, CLRAD_LEAF_VERTICES of each; unused ones have weight 0. u, v are clamped to the polygon. */
static void clrad_leaf(REAL u, REAL v, __global const uint* polygon, __global const uint* patch_first,
                       __global const uint* codes, __global const uint* levels, __global const uint* vertex,
                       __global const uint* middle, uint* vertices, REAL* weights) {
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

  REAL deepest[3] = {at[0], at[1], at[2]};
  uint code = 0;
  for (uint level = 0; level < CLRAD_DEPTH; level++) code = code << 2 | clrad_descend(deepest, quad);
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

  REAL edge[4];
  if (quad) {
    weights[0] = (1 - at[0]) * (1 - at[1]);
    weights[1] = at[0] * (1 - at[1]);
    weights[2] = at[0] * at[1];
    weights[3] = (1 - at[0]) * at[1];
    edge[0] = clrad_hat(at[0]) * (1 - at[1]);
    edge[1] = clrad_hat(at[1]) * at[0];
    edge[2] = clrad_hat(at[0]) * at[1];
    edge[3] = clrad_hat(at[1]) * (1 - at[0]);
  } else {
    for (uint k = 0; k < 3; k++) {
      const REAL next = at[k == 2 ? 0 : k + 1];
      weights[k] = at[k];
      edge[k] = 2 * (at[k] < next ? at[k] : next);
    }
    weights[3] = edge[3] = 0;
  }
  for (uint k = 0; k < 4; k++) {
    vertices[k] = vertex[4 * begin + (k < corners ? k : 0)];
    const uint t = k < corners ? middle[4 * begin + k] : CLRAD_NONE;
    const int there = t != CLRAD_NONE;
    vertices[4 + k] = there ? t : vertices[0];
    weights[4 + k] = there ? edge[k] : 0;
  }
  for (uint k = 0; k < corners; k++) {
    weights[k] -= weights[4 + k] / 2;
    weights[k + 1 == corners ? 0 : k + 1] -= weights[4 + k] / 2;
  }
}

#endif
