/* Irradiance gathered at points. Of each patch that may light a sensor
 *     H += F mean(V B),
 * F the exact factor as if nothing stood between, and the mean over points of the patch, each weighing as its own kernel:
 * V, whether the ray to it is free, and B, the radiosity there. So a patch of one radiosity that is seen as a whole brings
 * F B exactly, however few rays it has. A ray's end lies as dense as the kernel cos cos / r^2 is high (`aimed`), near an edge between walls, too.
 *
 * B = E + rho H, with H between vertices as pictures have it, except for what the lamps bring: the shadows of these are finer
 * than a mesh made for the rest of the light. H is taken without lamps (irradiance[], vertices), and each ray's end asks one lamp, chosen
 * by what it may bring, by one more segment (final gathering: Reichert 1992; Lischinski, Tampieri & Greenberg 1993).
 *
 * Rays are allocated twice: a few to all pairs of sensor and patch by what they bring, then the others by how much what the first ones
 * found differs (Neyman 1934). A lamp in full view takes few, its penumbra many.
 *
 * A pair is (sensor, patch), in the order of allocation. corners[4 patch + k] (a triangle repeats its last corner). Arrays of moments are
 * [moment][pair]: sums over the pair's rays of w, then for each band of w x and of what tells its error; x = V B, w the ray's weight. */
#include "shared/factor.cl"
#include "shared/leaf.cl"
#include "shared/sum.cl"

clrad_vector corner_from(CLRAD_POINT_T c, CLRAD_POINT_T p) {
  return clrad_make((c.x - p.x) + (c.x_lo - p.x_lo), (c.y - p.y) + (c.y_lo - p.y_lo), (c.z - p.z) + (c.z_lo - p.z_lo));
}

/* Rounding of normals and of cosines from corner differences, relative to the distance: 2^-20 is 16 times a float's. What
 * is so close to a plane is left to the factor, which decides in doubled precision. */
#define CLOSE CLRAD_R(0x1p-20)

/* Pairs of each (sensor, patch), 0 or 1: none when the patch is dark, in the sensor's plane, behind it, or looks away from it. */
__kernel void sensor_pairs(__global const CLRAD_POINT_T* sensors, __global const CLRAD_POINT_T* corners,
                           __global const REAL* brightness, __global uint* counts, uint first, uint count, uint patches) {
  const uint i = get_global_id(0);
  if (i >= count * patches) return;
  const uint patch = i % patches;
  const CLRAD_POINT_T s = sensors[first + i / patches];
  const clrad_vector n = clrad_make(s.nx, s.ny, s.nz);
  int above = 0;
  for (int k = 0; k < 4; k++) {
    const clrad_vector r = corner_from(corners[4 * patch + k], s);
    above |= clrad_dot(n, r) > -CLOSE * sqrt(clrad_dot(r, r));
  }
  const CLRAD_POINT_T c = corners[4 * patch];
  const clrad_vector r = corner_from(c, s);
  const int front =
      c.plane != s.plane && clrad_dot(clrad_make(c.nx, c.ny, c.nz), r) < CLOSE * sqrt(clrad_dot(r, r));
  counts[i] = front && above && brightness[patch] > 0;
}

/* factor[pair], unoccluded, and what it may bring (bands summed), which shares out the first rays. */
__kernel void sensor_factors(__global const CLRAD_POINT_T* sensors, __global const REAL* shooters,
                             __global const uint* owner, __global const REAL* brightness, __global REAL* factor,
                             __global float* weight, uint first, uint pairs, uint patches) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const uint patch = owner[i] % patches;
  const CLRAD_POINT_T s = sensors[first + owner[i] / patches];
  const REAL f = clrad_exact_factor(shooters + (ulong)patch * CLRAD_SHOOTER_SIZE, clrad_make(s.x, s.y, s.z),
                                    clrad_make(s.x_lo, s.y_lo, s.z_lo), clrad_make(s.nx, s.ny, s.nz));
  /* What is left of a patch that lies behind the horizon but for rounding: its reciprocal would overflow. */
  const REAL seen = f > CLRAD_R(1e-30) ? f : 0;
  factor[i] = seen;
  weight[i] = (float)(seen * brightness[patch]);
}

/* Where each sensor's pairs begin. */
__kernel void sensor_segments(__global const uint* pair_offsets, __global uint* segments, uint count, uint patches) {
  const uint i = get_global_id(0);
  if (i <= count) segments[i] = pair_offsets[i * patches];
}

/* Rays of each pair: its share of `rays` for its sensor, and `least` where anything may arrive. total[sensor] sums weight. */
__kernel void sensor_ray_counts(__global const uint* owner, __global const float* weight, __global const float* total,
                                float rays, uint least, __global uint* counts, uint pairs, uint patches) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const float w = weight[i];
  counts[i] = w > 0 ? least + (uint)(rays * (w / total[owner[i] / patches])) : 0u;
}

/* 32 bits well mixed from 32 (finaliser of MurmurHash3). */
uint mixed(uint x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/* In [0, 1), from units of 2^-32. */
REAL unit_of(uint x) { return ((REAL)(x >> 8) + CLRAD_R(0.5)) / 16777216; }

/* A point of a quadrilateral as seen from a receiver. */
typedef struct aim {
  clrad_vector x;  /* from the receiver */
  REAL u, v;       /* bilinear in the quadrilateral's corners */
  REAL above;      /* sine of its height above the receiver's horizon */
  REAL weight;     /* kernel x area / density of such points, without `above` */
} aim;

#ifdef CLRAD_FP64
typedef double4 clrad_four;
#else
typedef float4 clrad_four;
#endif

/* Of a bilinear function by its values at the corners: at the middles of the four quarters; quarter k is at corner k. */
static inline clrad_four at_quarters(REAL c0, REAL c1, REAL c2, REAL c3) {
  const clrad_four c = (clrad_four)(c0, c1, c2, c3);
  return (9 * c + 3 * (c.yzwx + c.wxyz) + c.zwxy) / 16;
}

/* The values at the corners of quarter q of a bilinear function with those of the whole. */
static inline clrad_four quarter_of(clrad_four c, int q) {
  const clrad_four edge = (c + c.yzwx) / 2; /* k: between corners k and k + 1 */
  const REAL middle = (edge.x + edge.z) / 2;
  if (q == 0) return (clrad_four)(c.x, edge.x, middle, edge.w);
  if (q == 1) return (clrad_four)(edge.x, c.y, edge.y, middle);
  if (q == 2) return (clrad_four)(middle, edge.y, c.z, edge.z);
  return (clrad_four)(edge.w, middle, edge.z, c.w);
}

static inline REAL bilinear_at(clrad_four c, REAL u, REAL v) {
  return (1 - v) * ((1 - u) * c.x + u * c.y) + v * ((1 - u) * c.w + u * c.z);
}

#define NEAR CLRAD_R(0.25)  /* parts whose diagonal's square is less than this x their distance's are not divided */
#define MOST_LEVELS 12

/* A point for (u, v) in the unit square, denser where the kernel is higher: down a quadtree of parts, each of which gets as
 * much of the square as it may have of the kernel (Clarberg et al. 2005). r: corners from the receiver; up: the receiver's normal, n: the
 * quadrilateral's. */
static aim aimed(const clrad_vector* r, clrad_vector up, clrad_vector n, REAL u, REAL v) {
  clrad_four x = (clrad_four)(r[0].x, r[1].x, r[2].x, r[3].x), y = (clrad_four)(r[0].y, r[1].y, r[2].y, r[3].y),
             z = (clrad_four)(r[0].z, r[1].z, r[2].z, r[3].z);
  clrad_four height = up.x * x + up.y * y + up.z * z;
  const clrad_vector e01 = clrad_minus(r[1], r[0]), e32 = clrad_minus(r[2], r[3]);
  const clrad_vector e03 = clrad_minus(r[3], r[0]), e12 = clrad_minus(r[2], r[1]);
  /* Area per parameter area; bilinear, too. */
  clrad_four area = (clrad_four)(clrad_dot(n, clrad_cross(e01, e03)), clrad_dot(n, clrad_cross(e01, e12)),
                                 clrad_dot(n, clrad_cross(e32, e12)), clrad_dot(n, clrad_cross(e32, e03)));
  if (!(area.x + area.y + area.z + area.w > 0)) area = 1; /* lost in rounding: the same all over */
  const clrad_vector a = clrad_minus(r[2], r[0]), b = clrad_minus(r[3], r[1]);
  const REAL a2 = clrad_dot(a, a), b2 = clrad_dot(b, b);
  REAL d2 = a2 > b2 ? a2 : b2, u0 = 0, v0 = 0, width = 1, chance = 1;
  for (int level = 0; level < MOST_LEVELS; level++) {
    const REAL mx = (x.x + x.y + x.z + x.w) / 4, my = (y.x + y.y + y.z + y.w) / 4, mz = (z.x + z.y + z.z + z.w) / 4;
    if (d2 <= NEAR * (mx * mx + my * my + mz * mz)) break;
    d2 /= 4;
    const clrad_four qx = at_quarters(x.x, x.y, x.z, x.w), qy = at_quarters(y.x, y.y, y.z, y.w),
                     qz = at_quarters(z.x, z.y, z.z, z.w);
    const clrad_four over = fmax(height, (REAL)0), edge = fmax((height + height.yzwx) / 2, (REAL)0);
    const REAL middle = fmax((height.x + height.y + height.z + height.w) / 4, (REAL)0);
    const clrad_four q = qx * qx + qy * qy + qz * qz + d2 / 16;
    const clrad_four weight = ((over + edge + edge.wxyz + middle) / q) *
                              (fmax(at_quarters(area.x, area.y, area.z, area.w), (REAL)0) / q);
    const REAL left = weight.x + weight.w, all = left + weight.y + weight.z;
    if (!(all > 0)) break;
    /* u may be 1 (rounding): a half without weight is never chosen. */
    const int right = left < all && u * all >= left;
    const REAL column = right ? all - left : left, low = right ? weight.y : weight.x;
    const REAL both = low + (right ? weight.z : weight.w);
    if (!(both > 0)) break;
    const int top = low < both && v * both >= low;
    const REAL row = top ? both - low : low;
    u = fmin((right ? u * all - left : u * all) / column, (REAL)1);
    v = fmin((top ? v * both - low : v * both) / row, (REAL)1);
    chance *= 4 * (column / all) * (row / both);
    width /= 2;
    u0 += right ? width : 0;
    v0 += top ? width : 0;
    const int chosen = top ? (right ? 2 : 3) : (right ? 1 : 0);
    x = quarter_of(x, chosen);
    y = quarter_of(y, chosen);
    z = quarter_of(z, chosen);
    height = quarter_of(height, chosen);
    area = quarter_of(area, chosen);
  }
  aim p;
  p.x = clrad_make(bilinear_at(x, u, v), bilinear_at(y, u, v), bilinear_at(z, u, v));
  p.u = u0 + width * u;
  p.v = v0 + width * v;
  const REAL r2 = clrad_dot(p.x, p.x), distance = sqrt(r2);
  /* The same all over the plane. Where rounding loses it the factor knows better, and only that it is the same matters. */
  const REAL toward = -clrad_dot(n, r[0]), facing = toward > 0 ? toward : CLRAD_R(1e-6) * distance;
  p.above = distance > 0 ? bilinear_at(height, u, v) / distance : 0;
  /* In this order nothing overflows or underflows at 1e-12 of the frame, where r2 r2 would. */
  p.weight = distance > 0 ? (facing / distance) * (bilinear_at(area, u, v) / r2) / chance : 0;
  return p;
}

static CLRAD_POINT_T point_at(CLRAD_POINT_T on, CLRAD_POINT_T from, clrad_vector x) {
  on.x = from.x + x.x;
  on.x_lo = (from.x - on.x) + x.x + from.x_lo;
  on.y = from.y + x.y;
  on.y_lo = (from.y - on.y) + x.y + from.y_lo;
  on.z = from.z + x.z;
  on.z_lo = (from.z - on.z) + x.z + from.z_lo;
  return on;
}

static uint hash_of(uint seed, uint sensor, uint patch) { return mixed(seed ^ mixed(sensor ^ mixed(patch))); }

/* Ends of the rays, their weights and where in the patch they are: place[2 ray]. Points follow the R2 sequence (Roberts 2018),
 * shifted at random for each pair: any number of rays is spread evenly; done[pair] are there already. Where a ray's end lies below the
 * horizon it has next to no weight, and where all do they speak for the sliver that does not. */
__kernel void sensor_rays(__global const CLRAD_POINT_T* sensors, __global const CLRAD_POINT_T* corners,
                          __global const uint* pair_owner, __global const uint* done, __global const uint* ray_owner,
                          __global const uint* ray_rank, __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* ends,
                          __global REAL* weight, __global REAL* place, uint first, uint rays, uint patches, uint seed) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  const uint pair = ray_owner[i], patch = pair_owner[pair] % patches;
  const uint sensor = first + pair_owner[pair] / patches;
  const CLRAD_POINT_T s = sensors[sensor];
  const uint hash = hash_of(seed, sensor, patch), number = done[pair] + ray_rank[i] + 1;
  __global const CLRAD_POINT_T* c = corners + 4 * (ulong)patch;
  clrad_vector r[4];
  for (int k = 0; k < 4; k++) r[k] = corner_from(c[k], s);
  const aim p = aimed(r, clrad_make(s.nx, s.ny, s.nz), clrad_make(c[0].nx, c[0].ny, c[0].nz),
                      unit_of(hash + number * 3242174889u), unit_of(mixed(hash) + number * 2447445414u));
  const REAL least = CLRAD_R(1e-6);
  weight[i] = p.weight * (p.above > least ? p.above : least);
  place[2 * i] = p.u;
  place[2 * i + 1] = p.v;
  origins[i] = s;
  ends[i] = point_at(c[0], s, p.x);
}

/* 1 where a ray has nothing to ask: it is blocked, or its end reflects nothing. reflects[patch]. */
__kernel void sensor_idle(__global const uint* pair_owner, __global const uint* ray_owner, __global const uint* masks,
                          __global const uint* reflects, __global uint* idle, uint rays, uint patches) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  idle[i] = (masks[i] & 1) || !reflects[pair_owner[ray_owner[i]] % patches];
}

/* A lamp, as REALs: middle, radius, power (area x E, bands summed). */
#define LAMP_SIZE 5

/* Which lamp each ray's end asks, and where: target[ray] and asks[ray] = 1, or 0 where no lamp may shine. light[ray] is the irradiance
 * that its lamp brings for E = 1 if nothing is in the way, over the chance that it was chosen; lamp[ray] which one. lamp_corners[4 lamp + k].
 * One number of a sequence of its own chooses, by bounds of what lamps bring; two more place the point (Roberts 2018, R3). */
__kernel void sensor_lamps(__global const CLRAD_POINT_T* ends, __global const uint* pair_owner, __global const uint* done,
                           __global const uint* ray_owner, __global const uint* ray_rank, __global const uint* idle,
                           __global const CLRAD_POINT_T* lamp_corners, __global const REAL* lamps, uint lamp_count,
                           __global CLRAD_POINT_T* targets, __global uint* asks, __global uint* lamp,
                           __global REAL* light, uint colours, uint first, uint rays, uint patches, uint seed) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  asks[i] = 0;
  lamp[i] = 0;
  for (uint c = 0; c < colours; c++) light[(ulong)c * rays + i] = 0;
  if (idle[i]) return;
  const uint pair = ray_owner[i], owner = pair_owner[pair];
  const uint hash = mixed(hash_of(seed, first + owner / patches, owner % patches) ^ 0x9e3779b9u);
  const uint number = done[pair] + ray_rank[i] + 1;
  REAL choice = unit_of(hash + number * 3518319155u);
  const CLRAD_POINT_T e = ends[i];
  const clrad_vector up = clrad_make(e.nx, e.ny, e.nz);
  REAL all = 0, chosen_weight = 0;
  uint chosen = CLRAD_NONE;
  for (uint l = 0; l < lamp_count; l++) {
    __global const REAL* record = lamps + LAMP_SIZE * l;
    const CLRAD_POINT_T c = lamp_corners[4 * l];
    if (c.plane == e.plane) continue;
    const clrad_vector r = clrad_make(record[0] - e.x, record[1] - e.y, record[2] - e.z);
    const REAL radius = record[3], q = clrad_dot(r, r) + radius * radius;
    const REAL above = clrad_dot(up, r) + radius;
    const REAL facing = -clrad_dot(clrad_make(c.nx, c.ny, c.nz), corner_from(c, e));
    if (!(above > 0 && facing > 0)) continue;
    const REAL w = record[4] * (above / q) * (facing / q);
    if (!(w > 0)) continue;
    all += w;
    /* Keeps the choice so far with its share of the sum, and what is left of the number is uniform again. */
    const REAL share = w / all;
    if (choice < share) {
      choice = choice / share;
      chosen = l;
      chosen_weight = w;
    } else {
      choice = (choice - share) / (1 - share);
    }
  }
  if (chosen == CLRAD_NONE) return;
  __global const CLRAD_POINT_T* c = lamp_corners + 4 * (ulong)chosen;
  clrad_vector r[4];
  for (int k = 0; k < 4; k++) r[k] = corner_from(c[k], e);
  const aim p = aimed(r, up, clrad_make(c[0].nx, c[0].ny, c[0].nz), unit_of(mixed(hash) + number * 2882110345u),
                      unit_of(mixed(mixed(hash)) + number * 2360945575u));
  const REAL brings = p.above > 0 ? p.above * p.weight * (CLRAD_R(0.31830988618379067) * (all / chosen_weight)) : 0;
  if (!(brings > 0)) return;
  targets[i] = point_at(c[0], e, p.x);
  asks[i] = 1;
  lamp[i] = chosen;
  light[i] = brings;
}

/* What glass lets pass, or nothing where something is in the way: asking[k] is the k-th ray that asks. */
__kernel void sensor_lamps_seen(__global const uint* asking, __global const uint* masks, uint glass,
                                __global const REAL* passes, __global REAL* light, uint colours, uint count, uint rays) {
  const uint k = get_global_id(0);
  if (k >= count) return;
  const uint i = asking[k];
  const REAL brings = masks[k] & 1 ? 0 : light[i];
  for (uint c = 0; c < colours; c++)
    light[(ulong)c * rays + i] = glass ? brings * passes[(ulong)c * count + k] : brings;
}

/* The place (u, v) in a patch as clrad_leaf_in_patch() takes it; a triangle's last corner is two of the four. */
static void patch_place(REAL u, REAL v, uint quad, REAL* at) {
  at[0] = quad ? u : (1 - v) * (1 - u);
  at[1] = quad ? v : (1 - v) * u;
  at[2] = quad ? 0 : v;
}

/* found[band][ray] = V B. Tables of the quadtree as in shared/leaf.cl; irradiance[band][vertex] and bend[band][edge] without what
 * lamps bring; depth: the deepest level; emitted[band][patch], rho[band][element], lamp_exitance[band][lamp]; from_lights[band][ray]. */
__kernel void sensor_found(__global const uint* pair_owner, __global const uint* ray_owner, __global const REAL* place,
                           __global const uint* masks, uint glass, __global const REAL* passes, uint colours,
                           __global const uint* quads, __global const uint* reflects, __global const uint* patch_first,
                           __global const uint* code, __global const uint* level, __global const uint* vertex,
                           __global const uint* middle, __global const uint* edge, __global const REAL* irradiance,
                           __global const REAL* bend, __global const REAL* emitted, __global const REAL* rho,
                           uint use_lamps, __global const uint* lamp, __global const REAL* light,
                           __global const REAL* lamp_exitance, uint lamp_count, uint use_lights,
                           __global const REAL* from_lights, __global REAL* found, uint rays, uint patches, uint elements,
                           uint vertices, uint edges, uint bands, uint depth) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  const uint patch = pair_owner[ray_owner[i]] % patches, blocked = masks[i] & 1, lit = reflects[patch] && !blocked;
  REAL weights[CLRAD_LEAF_VERTICES], bends[CLRAD_LEAF_EDGES];
  uint vertices_of[CLRAD_LEAF_VERTICES], element = 0;
  if (lit) {
    REAL at[3];
    patch_place(place[2 * i], place[2 * i + 1], quads[patch], at);
    element = clrad_leaf_in_patch(at, depth, patch, quads[patch] ? 4 : 3, patch_first, code, level, vertex, middle, vertices_of,
                                  weights, bends);
  }
  for (uint b = 0; b < bands; b++) {
    const ulong row = (ulong)b * rays;
    REAL x = emitted[(ulong)b * patches + patch];
    if (lit) {
      REAL h = use_lights ? from_lights[row + i] : 0;
      for (uint k = 0; k < CLRAD_LEAF_VERTICES; k++) h += weights[k] * irradiance[(ulong)b * vertices + vertices_of[k]];
      for (uint k = 0; k < CLRAD_LEAF_EDGES; k++) {
        const uint e = edge[(ulong)element * CLRAD_LEAF_EDGES + k];
        if (e != CLRAD_NONE) h += bends[k] * bend[(ulong)b * edges + e];
      }
      if (use_lamps)
        h += light[(ulong)(b % colours) * rays + i] * lamp_exitance[b * lamp_count + lamp[i]];
      x += rho[(ulong)b * elements + element] * h;
    }
    found[row + i] = blocked ? 0 : glass ? x * passes[(ulong)(b % colours) * rays + i] : x;
  }
}

/* Where rays end: element[ray] (CLRAD_NONE if blocked, or if nothing is reflected), at_vertex[8 ray + k], at_weight[16 ray + k] of
 * vertices and then of bends, and share[ray], what of a radiosity of 1 there comes to the sensor; glass is left out; after
 * sensor_tally. */
__kernel void sensor_ends(__global const uint* pair_owner, __global const uint* ray_owner, __global const REAL* place,
                          __global const REAL* weight, __global const REAL* moments, __global const uint* masks,
                          __global const uint* quads, __global const uint* reflects, __global const uint* patch_first,
                          __global const uint* code, __global const uint* level, __global const uint* vertex,
                          __global const uint* middle, __global uint* at_element, __global uint* at_vertex,
                          __global REAL* at_weight, __global REAL* share, uint rays, uint patches, uint depth) {
  const uint i = get_global_id(0);
  if (i >= rays) return;
  const uint pair = ray_owner[i], patch = pair_owner[pair] % patches;
  REAL weights[CLRAD_LEAF_VERTICES], bends[CLRAD_LEAF_EDGES];
  uint vertices_of[CLRAD_LEAF_VERTICES];
  share[i] = moments[pair] > 0 ? weight[i] / moments[pair] : 0;
  at_element[i] = CLRAD_NONE;
  if ((masks[i] & 1) || !reflects[patch]) return;
  REAL at[3];
  patch_place(place[2 * i], place[2 * i + 1], quads[patch], at);
  at_element[i] = clrad_leaf_in_patch(at, depth, patch, quads[patch] ? 4 : 3, patch_first, code, level, vertex, middle,
                                      vertices_of, weights, bends);
  for (uint k = 0; k < CLRAD_LEAF_VERTICES; k++) {
    at_vertex[(ulong)i * CLRAD_LEAF_VERTICES + k] = vertices_of[k];
    at_weight[(ulong)i * (CLRAD_LEAF_VERTICES + CLRAD_LEAF_EDGES) + k] = weights[k];
  }
  for (uint k = 0; k < CLRAD_LEAF_EDGES; k++)
    at_weight[(ulong)i * (CLRAD_LEAF_VERTICES + CLRAD_LEAF_EDGES) + CLRAD_LEAF_VERTICES + k] = bends[k];
}

/* Two points of the R2 sequence so many numbers apart are close neighbours (its turns are powers of the plastic ratio, so Padovan's
 * numbers); the largest up to half of n. */
static uint neighbour(uint n) {
  uint a = 1, b = 1, c = 1;
  while (2 * (a + b) <= n) {
    const uint next = a + b;
    a = b;
    b = c;
    c = next;
  }
  return c;
}

/* Adds each pair's rays to its moments, and to done[]. Weights are taken relative to the factor, which keeps them in range. What rays evenly
 * spread leave open is how x differs between neighbours: half of the squared difference of w (x - mean) each. */
__kernel void sensor_tally(__global const uint* ray_offsets, __global const REAL* weight, __global const REAL* found,
                           __global const REAL* factor, __global REAL* moments, __global uint* done, uint pairs, uint rays,
                           uint bands) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const uint begin = ray_offsets[i], end = ray_offsets[i + 1];
  if (begin == end) return;
  const uint n = end - begin, apart = neighbour(n);
  const REAL per = 1 / factor[i];
  REAL all = 0, lost = 0;
  for (uint k = begin; k < end; k++) clrad_add(&all, &lost, weight[k] * per);
  moments[i] += all;
  done[i] += n;
  for (uint b = 0; b < bands; b++) {
    __global REAL* m = moments + (ulong)(1 + 2 * b) * pairs + i;
    __global const REAL* x = found + (ulong)b * rays;
    REAL sum = 0, spread = 0;
    lost = 0;
    for (uint k = begin; k < end; k++) clrad_add(&sum, &lost, weight[k] * per * x[k]);
    const REAL mean = all > 0 ? sum / all : 0;
    for (uint k = begin; k + apart < end; k++) {
      const REAL d = per * (weight[k] * (x[k] - mean) - weight[k + apart] * (x[k + apart] - mean));
      spread += d * d / 2;
    }
    m[0] += sum;
    if (n > apart) m[pairs] += spread * n / (n - apart);
  }
}

/* Of one pair and band: *mean = mean of x by weight; returns the variance of that mean. */
static REAL moments_of(__global const REAL* moments, uint pairs, uint pair, uint band, REAL* mean) {
  const REAL all = moments[pair];
  __global const REAL* m = moments + (ulong)(1 + 2 * band) * pairs + pair;
  *mean = all > 0 ? m[0] / all : 0;
  return all > 0 ? m[pairs] / (all * all) : 0;
}

/* What shares out the other rays: the factor x the deviation of a single ray. It is taken as half of the patch's average until enough rays
 * say otherwise, and never from the mean that they found: who gets few rays because the first were dark stays too dark. */
#define PRIOR_RAYS 4
__kernel void sensor_spread(__global const uint* owner, __global const REAL* factor, __global const REAL* moments,
                            __global const uint* done, __global const REAL* radiosity, __global float* weight,
                            uint pairs, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= pairs) return;
  const uint n = done[i];
  REAL sum = 0, mean;
  for (uint b = 0; b < bands && n > 0; b++) {
    const REAL bright = radiosity[(ulong)b * patches + owner[i] % patches];
    sum += (n * (n * moments_of(moments, pairs, i, b, &mean)) + (bright * bright) * (PRIOR_RAYS / CLRAD_R(4.0))) /
           (n + PRIOR_RAYS);
  }
  weight[i] = (float)(factor[i] * sqrt(sum));
}

/* H and its standard error: one work-item a (sensor, band), over the sensor's pairs in order. Of n rays that agree about what is in the way
 * some share up to 1 / (n + 2) may still be otherwise (Laplace's rule of succession), half of it on average; open: nothing can be in the way,
 * and a single ray is off by what it differs from the patch's average. few: a pair may have so few rays that the ratio of sums is off, by its
 * spread over their number. Then, the mean of weights being known, what the average of the patch says is corrected by what rays say; but of
 * more rays the ratio is far better where that average is far from what is seen, as next to the edge of a large patch. */
#define RAYS_FOR_RATIO 16
__kernel void sensor_sum(uint pairs, __global const uint* pair_offsets, __global const uint* owner,
                         __global const REAL* factor, __global const REAL* moments, __global const uint* done,
                         __global const REAL* radiosity, __global REAL* irradiance, __global REAL* error, uint first,
                         uint count, uint patches, uint bands, uint open, uint few) {
  const uint i = get_global_id(0);
  if (i >= count * bands) return;
  const uint sensor = i / bands, band = i % bands;
  REAL sum = 0, lost = 0, squares = 0, mean;
  for (uint k = pair_offsets[sensor * patches]; k < pair_offsets[(sensor + 1) * patches]; k++) {
    if (done[k] == 0) continue;
    const REAL f = factor[k], bright = radiosity[(ulong)band * patches + owner[k] % patches];
    REAL variance = moments_of(moments, pairs, k, band, &mean);
    const REAL size = mean > bright ? mean : bright;
    const REAL unseen = !open ? size / (2 * (done[k] + 2)) : done[k] > 1 ? 0 : mean - bright;
    variance += unseen * unseen;
    if (few && done[k] < RAYS_FOR_RATIO) {
      variance += (mean - bright) * (mean - bright) / done[k]; /* weights differ by as much as they are, at most */
      mean = bright + (moments[(ulong)(1 + 2 * band) * pairs + k] - bright * moments[k]) / (CLRAD_PI * done[k]);
    }
    clrad_add(&sum, &lost, f * mean);
    squares += f * f * variance;
  }
  irradiance[(first + sensor) * bands + band] = sum;
  error[(first + sensor) * bands + band] = sqrt(squares);
}
