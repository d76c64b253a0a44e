/* Which polygon a ray sees, the radiosity there, and the sum over a pixel's rays: interpolation of radiosity on each polygon's
 * elements (section 1.5 of Drucker & Schroeder has it linear; here it is quadratic where radiosity is smooth). One work-item a ray, then one a pixel.
 *
 * The engine's answer is used for WHICH triangle is seen; where on its polygon is computed again here from the ray, so
 * that a small polygon far from the ray's origin is shaded by its own coordinates and every engine gives the same bits.
 *
 * Pre:  rays origins[i] -> targets[i], i < rays; the rays of a pixel stand next to each other; polygon tables as in
 *       kernels/shared/surface.cl; radiosity[band * vertices + vertex], bend[band * edges + edge].
 * Post: radiance[pixel * bands + band] = sum over the pixel's rays of throughput x B / pi, over the samples a pixel; nothing
 *       hit or a back seen counts 0. */
#include "shared/leaf.cl"
#include "shared/surface.cl"

/* seen[i]: from the triangle that ray i meets to the polygon it sees. In a plane polygons may overlap, and an engine may
 * name any of them. Of those that contain the point the last in the file that shows its front is seen; where all
 * show their backs, the last of them. Of a two-sided polygon the engine names the front, and its back is seen from
 * behind, whatever rounding says of the outline.
 * layers: per polygon those of its plane that overlap it and face as it does, from layer_start[2 polygon] on, then those that face
 * the other way, from layer_start[2 polygon + 1] on: where the one kind shows its front the other cannot be seen, and a floor on
 * which much stands is not asked about the undersides of it all. Seen within rounding of edge-on, either may be named. */
__kernel void find_seen(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                        __global uint* seen, uint rays, __global const uint* polygon_of, __global const REAL* polygons,
                        __global const uint* layer_start, __global const uint* layers) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays || seen[ray] == CLRAD_NONE) return;
  const uint hit = polygon_of[seen[ray]], same = layer_start[2 * hit], turned = layer_start[2 * hit + 1],
             end = layer_start[2 * hit + 2];
  uint top = hit;
  if (same < end) {
    __global const REAL* table = polygons + (ulong)hit * CLRAD_POLYGON_REALS;
    const int from_front = clrad_meet(table, origins + ray, targets + ray).facing < (REAL)0;
    int front = from_front;
    if (!front && table[18] != (REAL)0) top = hit + 1, front = 1;
    /* Those that show their fronts, and, where none contains the point, those that show their backs. */
    for (uint pass = 0; pass < 2; ++pass) {
      const int shows_front = pass == 0, as_hit = shows_front == from_front;
      if (!shows_front && front) break;
      const uint last = as_hit ? turned : end;
      for (uint l = as_hit ? same : turned; l < last; ++l) {
        if (front == shows_front && layers[l] < top) continue;
        __global const REAL* other = polygons + (ulong)layers[l] * CLRAD_POLYGON_REALS;
        if (clrad_contains(other, clrad_meet(other, origins + ray, targets + ray))) top = layers[l], front = shows_front;
      }
    }
  }
  seen[ray] = top;
}

/* shown[ray * bands + band] = B. Tables of the quadtree as in kernels/shared/leaf.cl. */
__kernel void shade_rays(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                         __global const uint* seen, uint rays, __global const REAL* polygons,
                         __global const uint* trees, __global const uint* patch_first, __global const uint* code,
                         __global const uint* level, __global const uint* vertex, __global const uint* middle,
                         __global const uint* edge, __global const REAL* radiosity, uint vertices,
                         __global const REAL* bend, uint edges, uint bands, __global float* shown) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays) return;
  __global float* out = shown + (ulong)ray * bands;
  for (uint band = 0; band < bands; ++band) out[band] = 0.0f;
  const uint polygon = seen[ray];
  if (polygon == CLRAD_NONE) return;
  __global const REAL* table = polygons + (ulong)polygon * CLRAD_POLYGON_REALS;
  const clrad_seen s = clrad_meet(table, origins + ray, targets + ray);
  if (!(s.facing < (REAL)0)) return;
  REAL u, v, weight[CLRAD_LEAF_VERTICES], bent[CLRAD_LEAF_EDGES];
  uint corner[CLRAD_LEAF_VERTICES];
  clrad_parameters(table, s, &u, &v);
  const uint element =
      clrad_leaf(u, v, trees + CLRAD_TREE_UINTS * polygon, patch_first, code, level, vertex, middle, corner, weight, bent);
  __global const uint* edge_of = edge + (ulong)element * CLRAD_LEAF_EDGES;
  for (uint band = 0; band < bands; ++band) {
    __global const REAL* b = radiosity + (ulong)band * vertices;
    REAL sum = 0;
    for (uint k = 0; k < CLRAD_LEAF_VERTICES; ++k) sum += weight[k] * b[corner[k]];
    for (uint k = 0; k < CLRAD_LEAF_EDGES; ++k)
      if (edge_of[k] != CLRAD_NONE) sum += bent[k] * bend[(ulong)band * edges + edge_of[k]];
    out[band] = (float)sum;
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
