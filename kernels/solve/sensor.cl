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
#include "shared/aim.cl"
#include "shared/corner.cl"
#include "shared/leaf.cl"
#include "shared/sum.cl"

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

/* Of each lane: a quadrilateral's corners from a receiver, both normals, and a point of the unit square. */
typedef struct lane_aims {
  REAL r[12][CLRAD_WIDTH], up[3][CLRAD_WIDTH], n[3][CLRAD_WIDTH], u[CLRAD_WIDTH], v[CLRAD_WIDTH];
} lane_aims;

static inline void set_lane(lane_aims* a, uint lane, __global const CLRAD_POINT_T* corner, CLRAD_POINT_T from) {
  for (uint k = 0; k < 4; k++) {
    const clrad_vector r = corner_from(corner[k], from);
    a->r[3 * k][lane] = r.x;
    a->r[3 * k + 1][lane] = r.y;
    a->r[3 * k + 2][lane] = r.z;
  }
  a->up[0][lane] = from.nx;
  a->up[1][lane] = from.ny;
  a->up[2][lane] = from.nz;
  a->n[0][lane] = corner->nx;
  a->n[1][lane] = corner->ny;
  a->n[2][lane] = corner->nz;
}

static inline void copy_lane(lane_aims* a, uint from, uint to) {
  for (uint k = 0; k < 12; k++) a->r[k][to] = a->r[k][from];
  for (uint k = 0; k < 3; k++) {
    a->up[k][to] = a->up[k][from];
    a->n[k][to] = a->n[k][from];
  }
}

static inline clrad_vectors load_vectors(REAL (*a)[CLRAD_WIDTH]) {
  const clrad_vectors v = {CLRAD_LOAD(a[0]), CLRAD_LOAD(a[1]), CLRAD_LOAD(a[2])};
  return v;
}

/* Points of them, lane by lane. */
typedef struct lane_points {
  REAL x[CLRAD_WIDTH], y[CLRAD_WIDTH], z[CLRAD_WIDTH], u[CLRAD_WIDTH], v[CLRAD_WIDTH], above[CLRAD_WIDTH], weight[CLRAD_WIDTH];
} lane_points;

static inline void aim_lanes(lane_aims* a, lane_points* p) {
  const clrad_vectors r[4] = {load_vectors(a->r), load_vectors(a->r + 3), load_vectors(a->r + 6), load_vectors(a->r + 9)};
  const aims all = aimed(r, load_vectors(a->up), load_vectors(a->n), CLRAD_LOAD(a->u), CLRAD_LOAD(a->v));
  CLRAD_STORE(all.x.x, p->x);
  CLRAD_STORE(all.x.y, p->y);
  CLRAD_STORE(all.x.z, p->z);
  CLRAD_STORE(all.u, p->u);
  CLRAD_STORE(all.v, p->v);
  CLRAD_STORE(all.above, p->above);
  CLRAD_STORE(all.weight, p->weight);
}

/* Ends of the rays, their weights and where in the patch they are: place[2 ray]. Points follow the R2 sequence (Roberts 2018),
 * shifted at random for each pair: any number of rays is spread evenly; done[pair] are there already. Where a ray's end lies below the
 * horizon it has next to no weight, and where all do they speak for the sliver that does not. Work-item: CLRAD_WIDTH rays. */
__kernel void sensor_rays(__global const CLRAD_POINT_T* sensors, __global const CLRAD_POINT_T* corners,
                          __global const uint* pair_owner, __global const uint* done, __global const uint* ray_owner,
                          __global const uint* ray_rank, __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* ends,
                          __global REAL* weight, __global REAL* place, uint first, uint rays, uint patches, uint seed) {
  const uint begin = get_global_id(0) * CLRAD_WIDTH;
  if (begin >= rays) return;
  const uint lanes = min(rays - begin, (uint)CLRAD_WIDTH);
  lane_aims a;
  uint hash = 0, last = CLRAD_NONE; /* rays of a pair follow each other */
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++) {
    const uint i = begin + min(lane, lanes - 1), pair = ray_owner[i];
    if (pair != last) {
      const uint patch = pair_owner[pair] % patches, sensor = first + pair_owner[pair] / patches;
      hash = hash_of(seed, sensor, patch);
      set_lane(&a, lane, corners + 4 * (ulong)patch, sensors[sensor]);
      last = pair;
    } else {
      copy_lane(&a, lane - 1, lane);
    }
    const uint number = done[pair] + ray_rank[i] + 1;
    a.u[lane] = unit_of(hash + number * 3242174889u);
    a.v[lane] = unit_of(mixed(hash) + number * 2447445414u);
  }
  lane_points p;
  aim_lanes(&a, &p);
  const REAL least = CLRAD_R(1e-6);
  for (uint lane = 0; lane < lanes; lane++) {
    const uint i = begin + lane, owner = pair_owner[ray_owner[i]];
    const CLRAD_POINT_T s = sensors[first + owner / patches];
    weight[i] = p.weight[lane] * (p.above[lane] > least ? p.above[lane] : least);
    place[2 * i] = p.u[lane];
    place[2 * i + 1] = p.v[lane];
    origins[i] = s;
    ends[i] = point_at(corners[4 * (ulong)(owner % patches)], s, clrad_make(p.x[lane], p.y[lane], p.z[lane]));
  }
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

/* The lamp that a ray's end asks, by bounds of what lamps bring, and one over the chance that it was chosen; CLRAD_NONE: no lamp may shine. choice is in
 * [0, 1). */
static uint chosen_lamp(CLRAD_POINT_T e, REAL choice, __global const CLRAD_POINT_T* lamp_corners, __global const REAL* lamps,
                        uint lamp_count, REAL* per_chance) {
  const clrad_vector up = clrad_make(e.nx, e.ny, e.nz);
  REAL all = 0, chosen_weight = 1;
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
  *per_chance = all / chosen_weight;
  return chosen;
}

/* Which lamp each ray's end asks, and where: target[ray] and asks[ray] = 1, or 0 where no lamp may shine. light[ray] is the irradiance
 * that its lamp brings for E = 1 if nothing is in the way, over the chance that it was chosen; lamp[ray] which one. lamp_corners[4 lamp + k].
 * One number of a sequence of its own chooses; two more place the point (Roberts 2018, R3). Work-item: CLRAD_WIDTH rays. */
__kernel void sensor_lamps(__global const CLRAD_POINT_T* ends, __global const uint* pair_owner, __global const uint* done,
                           __global const uint* ray_owner, __global const uint* ray_rank, __global const uint* idle,
                           __global const CLRAD_POINT_T* lamp_corners, __global const REAL* lamps, uint lamp_count,
                           __global CLRAD_POINT_T* targets, __global uint* asks, __global uint* lamp,
                           __global REAL* light, uint colours, uint first, uint rays, uint patches, uint seed) {
  const uint begin = get_global_id(0) * CLRAD_WIDTH;
  if (begin >= rays) return;
  const uint lanes = min(rays - begin, (uint)CLRAD_WIDTH);
  lane_aims a;
  uint which[CLRAD_WIDTH], some = CLRAD_NONE;
  REAL per_chance[CLRAD_WIDTH];
  for (uint lane = 0; lane < lanes; lane++) {
    const uint i = begin + lane;
    which[lane] = CLRAD_NONE;
    asks[i] = 0;
    lamp[i] = 0;
    for (uint c = 0; c < colours; c++) light[(ulong)c * rays + i] = 0;
    if (idle[i]) continue;
    const uint pair = ray_owner[i], owner = pair_owner[pair];
    const uint hash = mixed(hash_of(seed, first + owner / patches, owner % patches) ^ 0x9e3779b9u);
    const uint number = done[pair] + ray_rank[i] + 1;
    which[lane] = chosen_lamp(ends[i], unit_of(hash + number * 3518319155u), lamp_corners, lamps, lamp_count, per_chance + lane);
    if (which[lane] == CLRAD_NONE) continue;
    set_lane(&a, lane, lamp_corners + 4 * (ulong)which[lane], ends[i]);
    a.u[lane] = unit_of(mixed(hash) + number * 2882110345u);
    a.v[lane] = unit_of(mixed(mixed(hash)) + number * 2360945575u);
    some = lane;
  }
  if (some == CLRAD_NONE) return;
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++)
    if (lane >= lanes || which[lane] == CLRAD_NONE) {
      copy_lane(&a, some, lane);
      a.u[lane] = a.v[lane] = 0;
    }
  lane_points p;
  aim_lanes(&a, &p);
  for (uint lane = 0; lane < lanes; lane++) {
    if (which[lane] == CLRAD_NONE) continue;
    const uint i = begin + lane;
    const REAL brings =
        p.above[lane] > 0 ? p.above[lane] * p.weight[lane] * (CLRAD_R(0.31830988618379067) * per_chance[lane]) : 0;
    if (!(brings > 0)) continue;
    targets[i] = point_at(lamp_corners[4 * (ulong)which[lane]], ends[i], clrad_make(p.x[lane], p.y[lane], p.z[lane]));
    asks[i] = 1;
    lamp[i] = which[lane];
    light[i] = brings;
  }
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
 * spread leave open is how x differs within the cell of each. Neighbours a cell's side h apart tell: for a gradient g their squared difference
 * is h^2 g^2 / 2 on average, and the variance in a cell h^2 g^2 / 12, a third of the half of it; where an edge cuts a cell, P(they
 * differ) = 2 / pi against E p (1 - p) = 1 / 6, half of the half. Half is taken for all. */
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
      spread += d * d / 4;
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

/* What shares out the other rays: the factor x the deviation of a single ray within its cell. It is taken as half of the patch's average
 * until enough rays say otherwise, and never from the mean that they found: who gets few rays because the first were dark stays too dark. */
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
