/* Irradiance gathered at points. Three rounds of processor allocation: every (sensor, patch) asks for one node or, where
 * the patch is near, for one node an element; every (sensor, node) asks for rays by its share of the sensor's light;
 * every ray is one segment for the visibility engine.
 *
 * A node is a patch or an element: corners[4 node + k] (a triangle repeats its last corner), elements after patches. */
#include "shared/factor.cl"
#include "shared/sum.cl"

clrad_vector corner_from(CLRAD_POINT_T c, CLRAD_POINT_T p) {
  return clrad_make((c.x - p.x) + (c.x_lo - p.x_lo), (c.y - p.y) + (c.y_lo - p.y_lo), (c.z - p.z) + (c.z_lo - p.z_lo));
}

/* Rounding of normals and of cosines from corner differences, relative to the distance: 2^-20 is 16 times a float's. What
 * is so close to a plane is left to the factor, which decides in doubled precision. */
#define CLOSE CLRAD_R(0x1p-20)

/* Nodes of each (sensor, patch): 0 when the patch is dark, in the sensor's plane, behind it, or looks away from it. */
__kernel void sensor_nodes(__global const CLRAD_POINT_T* sensors, __global const CLRAD_POINT_T* corners,
                           __global const uint* first_element, __global const REAL* brightness, REAL near_squared,
                           __global uint* counts, uint first, uint count, uint patches) {
  const uint i = get_global_id(0);
  if (i >= count * patches) return;
  const uint patch = i % patches;
  const CLRAD_POINT_T s = sensors[first + i / patches];
  const clrad_vector n = clrad_make(s.nx, s.ny, s.nz);
  int above = 0;
  REAL nearest = CLRAD_R(1e30), diameter = 0;
  for (int k = 0; k < 4; k++) {
    const CLRAD_POINT_T c = corners[4 * patch + k];
    const clrad_vector r = corner_from(c, s);
    const REAL r2 = clrad_dot(r, r);
    above |= clrad_dot(n, r) > -CLOSE * sqrt(r2);
    nearest = r2 < nearest ? r2 : nearest;
    const clrad_vector d = corner_from(c, corners[4 * patch]);
    const REAL d2 = clrad_dot(d, d);
    diameter = d2 > diameter ? d2 : diameter;
  }
  const CLRAD_POINT_T c = corners[4 * patch];
  const clrad_vector r = corner_from(c, s);
  const int front =
      c.plane != s.plane && clrad_dot(clrad_make(c.nx, c.ny, c.nz), r) < CLOSE * sqrt(clrad_dot(r, r));
  uint nodes = 0;
  if (front && above && brightness[patch] > 0)
    nodes = nearest < near_squared * diameter ? first_element[patch + 1] - first_element[patch] : 1;
  counts[i] = nodes;
}

/* node[pair], its unoccluded factor, and what it would bring (bands summed), which shares out the rays. */
__kernel void sensor_factors(__global const CLRAD_POINT_T* sensors, __global const REAL* shooters,
                             __global const uint* owner, __global const uint* rank, __global const uint* counts,
                             __global const uint* first_element, __global const REAL* brightness, __global uint* node,
                             __global REAL* factor, __global float* weight, uint first, uint pairs, uint patches) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const uint o = owner[i], patch = o % patches;
  const CLRAD_POINT_T s = sensors[first + o / patches];
  /* A patch of one element is the same node either way. */
  const uint id = counts[o] > 1 ? patches + first_element[patch] + rank[i] : patch;
  const REAL f = clrad_exact_factor(shooters + (ulong)id * CLRAD_SHOOTER_SIZE, clrad_make(s.x, s.y, s.z),
                                    clrad_make(s.x_lo, s.y_lo, s.z_lo), clrad_make(s.nx, s.ny, s.nz));
  node[i] = id;
  factor[i] = f;
  weight[i] = (float)(f * brightness[id]);
}

/* Where each sensor's pairs begin. */
__kernel void sensor_segments(__global const uint* pair_offsets, __global uint* segments, uint count, uint patches) {
  const uint i = get_global_id(0);
  if (i <= count) segments[i] = pair_offsets[i * patches];
}

/* Rays of each pair: its share of `rays` for its sensor, at least one where anything arrives. total[sensor] sums weight. */
__kernel void sensor_ray_counts(__global const uint* owner, __global const float* weight, __global const float* total,
                                float rays, __global uint* counts, uint pairs, uint patches) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const float w = weight[i];
  counts[i] = w > 0 ? 1u + (uint)(rays * (w / total[owner[i] / patches])) : 0u;
}

/* 32 bits well mixed from 32 (finaliser of MurmurHash3). */
uint mixed(uint x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/* Ends of the rays, and each ray's kernel cos cos / r^2. Points follow the R2 sequence (Roberts 2018), shifted at random
 * for each pair: any number of rays is spread evenly. u, v are in units of 2^-32; bilinear in the node's corners, with
 * the map's Jacobian in the kernel. */
__kernel void sensor_rays(__global const CLRAD_POINT_T* sensors, __global const CLRAD_POINT_T* corners,
                          __global const uint* pair_owner, __global const uint* node, __global const uint* ray_owner,
                          __global const uint* ray_rank, __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* ends,
                          __global REAL* kernel_of, uint first, uint rays, uint patches, uint seed) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  const uint pair = ray_owner[i];
  const uint sensor = first + pair_owner[pair] / patches;
  const CLRAD_POINT_T s = sensors[sensor];
  const uint hash = mixed(seed ^ mixed(sensor ^ mixed(node[pair])));
  const uint ui = hash + (ray_rank[i] + 1) * 3242174889u, vi = mixed(hash) + (ray_rank[i] + 1) * 2447445414u;
  const REAL u = ((REAL)(ui >> 8) + CLRAD_R(0.5)) / 16777216, v = ((REAL)(vi >> 8) + CLRAD_R(0.5)) / 16777216;
  __global const CLRAD_POINT_T* c = corners + 4 * (ulong)node[pair];
  clrad_vector r[4];
  for (int k = 0; k < 4; k++) r[k] = corner_from(c[k], s);
  /* A triangle repeats its last corner: the square is folded onto the triangle 0 1 2 by the same bilinear map. */
  const clrad_vector e01 = clrad_minus(r[1], r[0]), e32 = clrad_minus(r[2], r[3]);
  const clrad_vector e03 = clrad_minus(r[3], r[0]), e12 = clrad_minus(r[2], r[1]);
  const clrad_vector du = clrad_plus(clrad_scaled(e01, 1 - v), clrad_scaled(e32, v));
  const clrad_vector dv = clrad_plus(clrad_scaled(e03, 1 - u), clrad_scaled(e12, u));
  const clrad_vector x = clrad_plus(clrad_plus(r[0], clrad_scaled(e01, u)), clrad_scaled(dv, v));
  const clrad_vector n = clrad_make(c[0].nx, c[0].ny, c[0].nz);
  const REAL r2 = clrad_dot(x, x);
  const REAL above = clrad_dot(clrad_make(s.nx, s.ny, s.nz), x), facing = -clrad_dot(n, x);
  const REAL jacobian = clrad_dot(n, clrad_cross(du, dv));
  /* In this order nothing overflows or underflows at 1e-12 of the frame, where r2 r2 would. */
  kernel_of[i] = above > 0 && facing > 0 && r2 > 0 ? (above / r2) * (facing / r2) * jacobian : 0;
  CLRAD_POINT_T end = c[0];
  end.x = s.x + x.x;
  end.x_lo = (s.x - end.x) + x.x + s.x_lo;
  end.y = s.y + x.y;
  end.y_lo = (s.y - end.y) + x.y + s.y_lo;
  end.z = s.z + x.z;
  end.z_lo = (s.z - end.z) + x.z + s.z_lo;
  origins[i] = s;
  ends[i] = end;
}

/* Visible share of each pair, by its rays' kernels, and its variance: p (1 - p) times the sum of squared shares of the
 * rays, what independent rays would give (theirs are stratified, so this is on the safe side); one ray says little about
 * p, which is then taken as 1/2. With `glass`, passes[k + at] of each ray gets through (transmission.cl); shares of a ray in
 * [0, 1] vary less than all or nothing of the same mean. */
__kernel void sensor_visible(__global const uint* ray_offsets, __global const REAL* kernel_of,
                             __global const uint* masks, uint glass, __global const REAL* passes, ulong passes_at, __global const REAL* factor, __global REAL* visible,
                             __global REAL* variance, ulong out_at, uint pairs) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  REAL seen = 0, all = 0, squares = 0;
  const uint rays = ray_offsets[i + 1] - ray_offsets[i];
  REAL open_rays = 0;
  for (uint k = ray_offsets[i]; k < ray_offsets[i + 1]; k++) {
    const REAL w = kernel_of[k];
    all += w;
    squares += w * w;
    if (!(masks[k] & 1)) {
      const REAL passed = glass ? passes[passes_at + k] : (REAL)1;
      seen += w * passed;
      open_rays += passed;
    }
  }
  const REAL f = factor[i];
  /* A sliver above the horizon that no ray's end lies in: the rays to the rest of the node speak for it. */
  const REAL p = all > 0 ? seen / all : rays > 0 ? open_rays / rays : 0;
  visible[out_at + i] = f * p;
  variance[out_at + i] = f * f * (rays < 2 || !(all > 0) ? CLRAD_R(0.25) : p * (1 - p) * squares / (all * all));
}

/* H and its variance: one work-item a (sensor, band), over the sensor's pairs in order. visible and variance are
 * [colour][pair] as the columns of deliver.cl. */
__kernel void sensor_sum(uint colours, uint pairs, __global const uint* pair_offsets, __global const uint* node, __global const REAL* visible,
                         __global const REAL* variance, __global const REAL* radiosity, __global REAL* irradiance,
                         __global REAL* error, uint first, uint count, uint patches, uint nodes, uint bands) {
  const uint i = get_global_id(0);
  if (i >= count * bands) return;
  const uint sensor = i / bands, band = i % bands;
  const ulong of_colour = (ulong)(band % colours) * pairs;
  REAL sum = 0, lost = 0, squares = 0;
  for (uint k = pair_offsets[sensor * patches]; k < pair_offsets[(sensor + 1) * patches]; k++) {
    const REAL b = radiosity[(ulong)band * nodes + node[k]];
    clrad_add(&sum, &lost, b * visible[of_colour + k]);
    squares += b * b * variance[of_colour + k];
  }
  irradiance[(first + sensor) * bands + band] = sum;
  error[(first + sensor) * bands + band] = sqrt(squares);
}
