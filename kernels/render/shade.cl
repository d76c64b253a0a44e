/* Which polygon a ray sees, the radiosity there, and the sum over a pixel's rays: Gouraud interpolation of radiosity on each
 * polygon's lattice (section 1.5 of Drucker & Schroeder). One work-item a ray, then one a pixel.
 *
 * The engine's answer is used for WHICH triangle is seen; where on its polygon is computed again here from the ray, so
 * that a small polygon far from the ray's origin is shaded by its own coordinates and every engine gives the same bits.
 *
 * Pre:  rays origins[i] -> targets[i], i < rays; the rays of a pixel stand next to each other; polygon tables as in
 *       kernels/shared/surface.cl; radiosity[band * vertices + vertex].
 * Post: radiance[pixel * bands + band] = sum over the pixel's rays of throughput x B / pi, over the samples a pixel; nothing
 *       hit or a back seen counts 0. */
#include "shared/surface.cl"

/* seen[i]: from the triangle that ray i meets to the polygon it sees. In a plane polygons may overlap, and an engine may
 * name any of them. Of those that contain the point the last in the file that shows its front is seen; where all
 * show their backs, the last of them. layers: per polygon those of its plane that overlap it, in rising order. */
__kernel void find_seen(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                        __global uint* seen, uint rays, __global const uint* polygon_of, __global const REAL* polygons,
                        __global const uint* layer_start, __global const uint* layers) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays || seen[ray] == CLRAD_NONE) return;
  const uint hit = polygon_of[seen[ray]], first = layer_start[hit], last = layer_start[hit + 1];
  uint top = hit;
  if (first < last) {
    int front = clrad_meet(polygons + (ulong)hit * CLRAD_POLYGON_REALS, origins + ray, targets + ray).facing < (REAL)0;
    for (uint l = first; l < last; ++l) {
      __global const REAL* other = polygons + (ulong)layers[l] * CLRAD_POLYGON_REALS;
      const clrad_seen s = clrad_meet(other, origins + ray, targets + ray);
      const int other_front = s.facing < (REAL)0;
      const int over = other_front != front ? other_front : layers[l] > top;
      if (over && clrad_contains(other, s)) top = layers[l], front = other_front;
    }
  }
  seen[ray] = top;
}

REAL clamped(REAL x, REAL high) { return x > (REAL)0 ? (x < high ? x : high) : (REAL)0; /* NaN: 0 */ }

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

/* shown[ray * bands + band] = B. grids: 4 uints a polygon: first vertex, cells_u, cells_v, corners. */
__kernel void shade_rays(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                         __global const uint* seen, uint rays, __global const REAL* polygons,
                         __global const uint* grids, __global const REAL* radiosity, uint vertices, uint bands,
                         __global float* shown) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays) return;
  __global float* out = shown + (ulong)ray * bands;
  for (uint band = 0; band < bands; ++band) out[band] = 0.0f;
  const uint polygon = seen[ray];
  if (polygon == CLRAD_NONE) return;
  __global const REAL* table = polygons + (ulong)polygon * CLRAD_POLYGON_REALS;
  const clrad_seen s = clrad_meet(table, origins + ray, targets + ray);
  if (!(s.facing < (REAL)0)) return;
  REAL u, v, weight[4];
  uint vertex[4];
  clrad_parameters(table, s, &u, &v);
  lattice(u, v, grids + 4 * polygon, vertex, weight);
  for (uint band = 0; band < bands; ++band) {
    __global const REAL* b = radiosity + (ulong)band * vertices;
    out[band] = (float)(weight[0] * b[vertex[0]] + weight[1] * b[vertex[1]] + weight[2] * b[vertex[2]] +
                        weight[3] * b[vertex[3]]);
  }
}

/* Adds the rays of each pixel in their order. Rays from the camera: `samples` a pixel, each of throughput 1; later ones:
 * those at [start[pixel], start[pixel + 1]), of throughput[ray * bands + band]. The same bits whatever the work-group size. */
__kernel void add_to_pixels(__global const float* shown, uint from_camera, __global const REAL* throughput,
                            __global const uint* start, uint samples, uint pixels, uint bands,
                            __global float* radiance) {
  const uint pixel = (uint)get_global_id(0);
  if (pixel >= pixels) return;
  const ulong first = from_camera ? (ulong)pixel * samples : start[pixel];
  const ulong last = from_camera ? first + samples : start[pixel + 1];
  const REAL scale = (REAL)0.31830988618379067f / (REAL)samples; /* 1 / pi */
  for (uint band = 0; band < bands; ++band) {
    float sum = 0.0f;
    for (ulong ray = first; ray < last; ++ray) {
      const float b = shown[ray * bands + band];
      sum += from_camera ? b : (float)(throughput[ray * bands + band] * b);
    }
    const float mean = (float)(sum * scale);
    const ulong at = (ulong)pixel * bands + band;
    radiance[at] = from_camera ? mean : radiance[at] + mean;
  }
}
