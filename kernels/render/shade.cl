/* What a ray sees, and the mean over a pixel's samples: Gouraud interpolation of radiosity on each polygon's lattice
 * (section 1.5 of Drucker & Schroeder).
 *
 * The engine's answer is used for WHICH triangle is seen; where on its polygon is computed again here from the ray, so
 * that a small polygon far from the ray's origin is shaded by its own coordinates and every engine gives the same bits.
 *
 * Each polygon has a frame of its own: origin corner 0, axes e1 = c1 - c0 and e2 = c3 - c0 (triangle: c2 - c0). The dual
 * vectors give a point's coordinates (a, b) in it. The opposite corner of a quad is (1 + p, 1 + q), so the bilinear map is
 *     a = u (1 + p v),   b = v (1 + q u).
 * Its inverse solves p v^2 + (1 + q a - p b) v - b = 0; inside a convex quad the root belonging to it is
 *     v = 2 b / (h + sqrt(h^2 + 4 p b)),  h = 1 + q a - p b,   u = a / (1 + p v),
 * where the denominator is 2 (1 + q u) > 0 and the square root is the map's Jacobian: no case distinction is needed, and
 * p = q = 0 gives v = b, u = a.
 *
 * Pre:  triangles[i] of sample i; polygon tables as host/render/shade.cpp makes them; radiosity[band * vertices + vertex].
 * Post: radiance[pixel * bands + band] = mean over samples of B / pi; nothing hit or a back seen counts 0.
 * One work-item per pixel sums its samples in their order: the same bits whatever the work-group size. */

#define POLYGON_REALS 20
/* reals: corner 0 hi, lo, normal, dual of e1, dual of e2 (three each), p, q
 * uints: first vertex, cells_u, cells_v, corners */

typedef struct seen {
  REAL facing; /* direction . normal: negative when the front is seen */
  REAL a, b;
} seen;

seen meet(__global const REAL* polygon, const REAL* origin, const REAL* origin_lo, const REAL* direction) {
  REAL from[3];
  REAL height = 0, facing = 0;
  for (int c = 0; c < 3; ++c) {
    from[c] = (origin[c] - polygon[c]) + (origin_lo[c] - polygon[3 + c]);
    height += from[c] * polygon[6 + c];
    facing += direction[c] * polygon[6 + c];
  }
  seen s;
  s.facing = facing, s.a = 0, s.b = 0;
  const REAL along = -height / facing;
  for (int c = 0; c < 3; ++c) {
    const REAL at = from[c] + along * direction[c];
    s.a += at * polygon[9 + c];
    s.b += at * polygon[12 + c];
  }
  return s;
}

REAL clamped(REAL x, REAL high) { return x > (REAL)0 ? (x < high ? x : high) : (REAL)0; /* NaN: 0 */ }

/* (u, v) of the bilinear quad or the triangle, not clamped. */
void parameters(seen s, REAL p, REAL q, bool quad, REAL* u, REAL* v) {
  *u = s.a, *v = s.b;
  if (!quad) return;
  const REAL h = (REAL)1 + q * s.a - p * s.b;
  const REAL d = h * h + (REAL)4 * p * s.b;
  *v = (REAL)2 * s.b / (h + sqrt(d > (REAL)0 ? d : (REAL)0));
  *u = s.a / ((REAL)1 + p * *v);
}

bool contains(REAL u, REAL v, bool quad) {
  return quad ? u >= (REAL)0 && v >= (REAL)0 && u <= (REAL)1 && v <= (REAL)1
              : u >= (REAL)0 && v >= (REAL)0 && u + v <= (REAL)1;
}

/* The lattice cell of (u, v): the vertices to interpolate and their weights. */
void lattice(REAL u, REAL v, __global const uint* grid, uint* vertex, REAL* weight) {
  const uint first = grid[0], n = grid[1], m = grid[2];
  if (grid[3] == 4) {
    u = clamped(u, (REAL)1) * (REAL)n, v = clamped(v, (REAL)1) * (REAL)m;
    const uint i = (uint)u < n ? (uint)u : n - 1, j = (uint)v < m ? (uint)v : m - 1;
    const REAL x = u - (REAL)i, y = v - (REAL)j;
    const uint at = first + j * (n + 1) + i;
    vertex[0] = at, vertex[1] = at + 1, vertex[2] = at + n + 2, vertex[3] = at + n + 1;
    weight[0] = ((REAL)1 - x) * ((REAL)1 - y), weight[1] = x * ((REAL)1 - y), weight[2] = x * y;
    weight[3] = ((REAL)1 - x) * y;
    return;
  }
  u = clamped(u, (REAL)1), v = clamped(v, (REAL)1 - u);
  u *= (REAL)n, v *= (REAL)n;
  const uint i = (uint)u < n ? (uint)u : n - 1;
  const uint j = (uint)v < n - i ? (uint)v : n - 1 - i;
  const REAL x = clamped(u - (REAL)i, (REAL)1), y = clamped(v - (REAL)j, (REAL)1);
  /* Row j starts at first + j (n + 1) - j (j - 1) / 2 and holds n + 1 - j vertices. */
  const uint at = first + j * (n + 1) - j * (j - 1) / 2 + i, above = at + n + 1 - j;
  REAL rest = (REAL)1 - x - y;
  if (rest >= (REAL)0 || i + j + 2 > n) {
    /* The last cell of a row has no upper half: beyond its diagonal there is only rounding. */
    rest = rest > (REAL)0 ? rest : (REAL)0;
    vertex[0] = at, vertex[1] = at + 1, vertex[2] = above, vertex[3] = at;
    weight[0] = rest, weight[1] = x, weight[2] = (REAL)1 - rest - x, weight[3] = 0;
  } else {
    vertex[0] = at + 1, vertex[1] = above + 1, vertex[2] = above, vertex[3] = at + 1;
    weight[0] = (REAL)1 - y, weight[1] = -rest, weight[2] = (REAL)1 - x, weight[3] = 0;
  }
}

__kernel void shade_pixels(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                           __global const uint* triangles, uint samples, uint pixels,
                           __global const uint* polygon_of, __global const REAL* polygons, __global const uint* grids,
                           __global const uint* layer_start, __global const uint* layers,
                           __global const REAL* radiosity, uint vertices, uint bands, __global float* radiance) {
  const uint pixel = (uint)get_global_id(0);
  if (pixel >= pixels) return;
  __global float* mean = radiance + (ulong)pixel * bands;
  for (uint band = 0; band < bands; ++band) mean[band] = 0.0f;

  for (uint k = 0; k < samples; ++k) {
    const ulong ray = (ulong)pixel * samples + k;
    if (triangles[ray] == CLRAD_NONE) continue;
    uint polygon = polygon_of[triangles[ray]];
    const CLRAD_POINT_T o = origins[ray], t = targets[ray];
    const REAL origin[3] = {o.x, o.y, o.z}, origin_lo[3] = {o.x_lo, o.y_lo, o.z_lo};
    const REAL direction[3] = {(t.x - o.x) + (t.x_lo - o.x_lo), (t.y - o.y) + (t.y_lo - o.y_lo),
                               (t.z - o.z) + (t.z_lo - o.z_lo)};
    /* What lies on top of it in the same plane, in rising order: the last that contains the point is seen. */
    const uint hit = polygon;
    for (uint l = layer_start[hit]; l < layer_start[hit + 1]; ++l) {
      __global const REAL* other = polygons + (ulong)layers[l] * POLYGON_REALS;
      const bool quad = grids[4 * layers[l] + 3] == 4;
      const seen s = meet(other, origin, origin_lo, direction);
      REAL u, v;
      parameters(s, other[15], other[16], quad, &u, &v);
      if (contains(u, v, quad)) polygon = layers[l];
    }
    __global const REAL* table = polygons + (ulong)polygon * POLYGON_REALS;
    const seen s = meet(table, origin, origin_lo, direction);
    if (!(s.facing < (REAL)0)) continue;
    REAL u, v, weight[4];
    uint vertex[4];
    parameters(s, table[15], table[16], grids[4 * polygon + 3] == 4, &u, &v);
    lattice(u, v, grids + 4 * polygon, vertex, weight);
    for (uint band = 0; band < bands; ++band) {
      __global const REAL* b = radiosity + (ulong)band * vertices;
      mean[band] += (float)(weight[0] * b[vertex[0]] + weight[1] * b[vertex[1]] + weight[2] * b[vertex[2]] +
                            weight[3] * b[vertex[3]]);
    }
  }
  const REAL scale = (REAL)0.31830988618379067f / (REAL)samples; /* 1 / pi */
  for (uint band = 0; band < bands; ++band) mean[band] = (float)(mean[band] * scale);
}
