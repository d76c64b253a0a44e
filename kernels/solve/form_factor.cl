/* Form factors of receivers to one shooter, and what of them is visible. One work-item a
 * chosen receiver; `chosen` says whether active lists the receivers or they are taken in order.
 *
 * With `glass`, of what is not blocked passes[passes_at + (i - first) n + k] gets through on the way from chosen receiver i to sample
 * k (transmission.cl), and the results of one colour begin at `out_at`. */
#include "shared/factor.cl"
#include "shared/factor_packet.cl"

uint receiver_of(__global const uint* active, uint chosen, uint i) { return chosen ? active[i] : i; }
clrad_vector position_of(CLRAD_POINT_T p) { return clrad_make(p.x, p.y, p.z); }
clrad_vector position_lo_of(CLRAD_POINT_T p) { return clrad_make(p.x_lo, p.y_lo, p.z_lo); }
clrad_vector normal_of(CLRAD_POINT_T p) { return clrad_make(p.nx, p.ny, p.nz); }
clrad_vector from_to(CLRAD_POINT_T p, CLRAD_POINT_T q) {
  return clrad_plus(clrad_minus(position_of(q), position_of(p)), clrad_minus(position_lo_of(q), position_lo_of(p)));
}

/* Squared distance to a sample, at least that of a step of the visibility grid: 1 / r^4 of a nearer one is beyond a float, and
 * as far as its rays are told apart it is no nearer. */
#define LEAST_DISTANCE2 CLRAD_R(0x1p-74)
REAL squared_distance(clrad_vector r) { return fmax(clrad_dot(r, r), LEAST_DISTANCE2); }

/* flags[i] of receiver first + i: in front of the shooter's plane, not in it, and some corner strictly above the horizon. Small heights
 * are taken in pairs: a plain dot product would drop receivers next to the plane. Work-item: CLRAD_WIDTH receivers. */
__kernel void facing(__global const REAL* shooter, uint plane, __global const CLRAD_POINT_T* receivers,
                     __global uint* flags, uint first, uint count) {
  const uint i = get_global_id(0) * CLRAD_WIDTH;
  if (i >= count) return;
  __global const REAL* n = shooter + CLRAD_SHOOTER_NORMAL;
#if CLRAD_WIDTH == 1
  const CLRAD_POINT_T p = receivers[first + i];
  const clrad_vector x = position_of(p), x_lo = position_lo_of(p);
  const int front = p.plane != plane && clrad_corner_above(shooter, 0, clrad_make(-n[0], -n[1], -n[2]),
                                                           clrad_make(-n[3], -n[4], -n[5]), x, x_lo);
  int above = 0;
  for (uint k = 0; k < 4 && front && !above; k++)
    above = clrad_corner_above(shooter, k, normal_of(p), clrad_make(0, 0, 0), x, x_lo);
  flags[i] = above;
#else
  const uint lanes = min(count - i, (uint)CLRAD_WIDTH);
  uint receiver[CLRAD_WIDTH];
  int asked[CLRAD_WIDTH], flag[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++) {
    receiver[lane] = first + i + min(lane, lanes - 1);
    asked[lane] = receivers[receiver[lane]].plane != plane ? -1 : 0;
  }
  clrad_receivers at;
  clrad_load_receivers(receivers, receiver, &at);
  clrad_masks open = CLRAD_MASKS_OF_INTS(CLRAD_LOAD(asked)), above = 0;
  open &= clrad_corners_above(shooter, 0, clrad_fast_two_sums(-n[0], -n[3]), clrad_fast_two_sums(-n[1], -n[4]),
                              clrad_fast_two_sums(-n[2], -n[5]), &at, open);
  const clrad_reals none = 0;
  const clrad_pairs nx = {at.n.x, none}, ny = {at.n.y, none}, nz = {at.n.z, none};
  for (uint k = 0; k < 4 && clrad_some(open); k++) {
    const clrad_masks here = open & clrad_corners_above(shooter, k, nx, ny, nz, &at, open);
    above |= here;
    open &= ~here;
  }
  CLRAD_STORE(CLRAD_TO_INTS(above), flag);
  for (uint lane = 0; lane < lanes; lane++) flags[i + lane] = flag[lane] & 1;
#endif
}

/* dense: results go to factors[receiver], else to factors[i]. Work-item: CLRAD_WIDTH of the chosen receivers. */
__kernel void exact_factors(__global const REAL* shooter, uint plane, __global const CLRAD_POINT_T* receivers,
                            __global const uint* active, uint chosen, __global REAL* factors, uint dense, uint count) {
  const uint first = get_global_id(0) * CLRAD_WIDTH;
  if (first >= count) return;
#if CLRAD_WIDTH == 1
  const uint receiver = receiver_of(active, chosen, first);
  const CLRAD_POINT_T p = receivers[receiver];
  factors[dense ? receiver : first] =
      p.plane == plane ? 0 : clrad_exact_factor(shooter, position_of(p), position_lo_of(p), normal_of(p));
#else
  const uint lanes = min(count - first, (uint)CLRAD_WIDTH);
  uint receiver[CLRAD_WIDTH];
  int asked[CLRAD_WIDTH], left[CLRAD_WIDTH];
  REAL factor[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++) {
    receiver[lane] = receiver_of(active, chosen, first + min(lane, lanes - 1));
    asked[lane] = lane < lanes && receivers[receiver[lane]].plane != plane ? -1 : 0;
  }
  clrad_receivers at;
  clrad_load_receivers(receivers, receiver, &at);
  clrad_masks later;
  const clrad_reals factors_of_lanes = clrad_exact_factors(shooter, &at, CLRAD_MASKS_OF_INTS(CLRAD_LOAD(asked)), &later);
  CLRAD_STORE(factors_of_lanes, factor);
  CLRAD_STORE(CLRAD_TO_INTS(later), left);
  for (uint lane = 0; lane < lanes; lane++) {
    if (left[lane]) {
      const CLRAD_POINT_T p = receivers[receiver[lane]];
      factor[lane] = clrad_exact_factor(shooter, position_of(p), position_lo_of(p), normal_of(p));
    }
    factors[dense ? receiver[lane] : first + lane] = factor[lane];
  }
#endif
}

/* The sampled estimators: A/n sum cos cos / (pi r^2 + disk) over the samples whose bit in masks is 0 (all of them when
 * !masked); disk = A is the paper's, A/n Wallace's. dense: results go to out[receiver], else to out[i]. Chosen receivers
 * first .. count - 1. */
__kernel void disk_factors(__global const REAL* shooter, uint plane, __global const CLRAD_POINT_T* receivers,
                           __global const uint* active, uint chosen, __global const CLRAD_POINT_T* samples, uint n,
                           REAL disk, __global const uint* masks, uint masked, uint glass, __global const REAL* passes,
                           ulong passes_at, __global REAL* out, ulong out_at, uint dense, uint first, uint count) {
  const uint i = first + get_global_id(0);
  if (i >= count) return;
  const uint receiver = receiver_of(active, chosen, i);
  const CLRAD_POINT_T p = receivers[receiver];
  const REAL height = p.plane == plane ? 0 : clrad_height(shooter, position_of(p), position_lo_of(p));
  const uint words = (n + 31) / 32;
  REAL sum = 0;
  for (uint w = 0; w < words && height > 0; w++) { /* blocks of 32: short sums of sums */
    const uint mask = masked ? masks[(ulong)i * words + w] : 0;
    const uint end = n < 32 * (w + 1) ? n : 32 * (w + 1);
    REAL block = 0;
    for (uint k = 32 * w; k < end; k++) {
      const clrad_vector r = from_to(p, samples[k]);
      const REAL r2 = squared_distance(r), z = clrad_dot(normal_of(p), r);
      const REAL passed = glass ? passes[passes_at + (ulong)(i - first) * n + k] : (REAL)1;
      if (z > 0 && !(mask >> (k & 31) & 1)) block += z * height / (r2 * (CLRAD_PI * r2 + disk)) * passed;
    }
    sum += block;
  }
  out[out_at + (dense ? receiver : i)] = sum * (shooter[CLRAD_SHOOTER_AREA] / (REAL)n);
}

/* The samples of word w of a mask, all that there are of its 32. */
static uint word_of_samples(uint n, uint w) { return n - 32 * w < 32 ? (1u << (n - 32 * w)) - 1 : 0xffffffffu; }

/* What a sample weighs: its own kernel z / r^4, without the distance from the shooter's plane, which all samples share. */
#if CLRAD_WIDTH == 1
static REAL weight_of(CLRAD_POINT_T p, CLRAD_POINT_T q, REAL area) {
  const clrad_vector r = from_to(p, q);
  const REAL r2 = squared_distance(r), z = clrad_dot(normal_of(p), r);
  return z > 0 ? (z / r2) * (area / r2) : 0;
}
#else
static clrad_reals weights_of(const clrad_receivers* at, __global const CLRAD_POINT_T* q, REAL area) {
  const clrad_vectors r = clrad_from_receivers(at, q->x, q->y, q->z, q->x_lo, q->y_lo, q->z_lo);
  const clrad_reals length2 = clrad_dots(r, r), z = clrad_dots(at->n, r), least = LEAST_DISTANCE2, none = 0;
  const clrad_reals r2 = length2 > LEAST_DISTANCE2 ? length2 : least;
  return z > 0 ? (z / r2) * (area / r2) : none;
}
#endif

/* column[receiver] = F x visible fraction. undecided[i] = 1 where F > 0 but no sample is above the horizon. Where all samples are
 * seen or all hidden, as of most receivers, the fraction is 1 or 0 to the bit and one sample above the horizon is enough to know.
 * Work-item: CLRAD_WIDTH of the chosen receivers. */
__kernel void visible_factors(__global const REAL* shooter, __global const CLRAD_POINT_T* receivers,
                              __global const uint* active, uint chosen, __global const CLRAD_POINT_T* samples, uint n,
                              __global const uint* masks, __global const REAL* factors, uint glass,
                              __global const REAL* passes, ulong passes_at, __global REAL* column, ulong out_at,
                              __global uint* undecided, uint first, uint count) {
  const uint i = first + get_global_id(0) * CLRAD_WIDTH;
  if (i >= count) return;
  const REAL area = shooter[CLRAD_SHOOTER_AREA];
  const uint words = (n + 31) / 32;
#if CLRAD_WIDTH == 1
  const uint receiver = receiver_of(active, chosen, i);
  const CLRAD_POINT_T p = receivers[receiver];
  const REAL factor = factors[i];
  int hidden = 0, seen = 0;
  for (uint w = 0; w < words; w++) {
    const uint mask = masks[(ulong)i * words + w], there = word_of_samples(n, w);
    hidden |= (mask & there) != 0;
    seen |= (mask & there) != there;
  }
  REAL all = 0, visible = 0;
  if (glass || (hidden && seen)) {
    for (uint w = 0; w < words && factor > 0; w++) {
      const uint mask = masks[(ulong)i * words + w];
      const uint end = n < 32 * (w + 1) ? n : 32 * (w + 1);
      REAL block = 0, block_visible = 0;
      for (uint k = 32 * w; k < end; k++) {
        const REAL weight = weight_of(p, samples[k], area);
        block += weight;
        const REAL passed = glass ? passes[passes_at + (ulong)(i - first) * n + k] : (REAL)1;
        block_visible += mask >> (k & 31) & 1 ? 0 : weight * passed;
      }
      all += block;
      visible += block_visible;
    }
  } else {
    for (uint k = 0; k < n && factor > 0 && !(all > 0); k++) all = weight_of(p, samples[k], area);
    visible = hidden ? 0 : all;
  }
  column[out_at + receiver] = all > 0 ? factor * (visible / all) : 0;
  undecided[i] = factor > 0 && !(all > 0);
#else
  const uint lanes = min(count - i, (uint)CLRAD_WIDTH);
  uint receiver[CLRAD_WIDTH];
  int bits[CLRAD_WIDTH];
  REAL factor[CLRAD_WIDTH], fraction[CLRAD_WIDTH], passed[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++) {
    receiver[lane] = receiver_of(active, chosen, i + min(lane, lanes - 1));
    factor[lane] = factors[i + min(lane, lanes - 1)];
  }
  const clrad_reals none = 0, one = 1;
  const clrad_masks wanted = CLRAD_LOAD(factor) > none;
  clrad_masks hidden = 0, seen = 0, open = wanted;
  for (uint w = 0; w < words && clrad_some(wanted & ~(hidden & seen)); w++) {
    for (uint lane = 0; lane < CLRAD_WIDTH; lane++)
      bits[lane] = (int)masks[(ulong)(i + min(lane, lanes - 1)) * words + w];
    const clrad_masks mask = CLRAD_MASKS_OF_INTS(CLRAD_LOAD(bits));
    const int there = (int)word_of_samples(n, w);
    hidden |= (mask & there) != 0;
    seen |= (~mask & there) != 0;
  }
  clrad_receivers at;
  clrad_load_receivers(receivers, receiver, &at);
  clrad_reals fractions;
  if (glass || clrad_some(wanted & hidden & seen)) {
    clrad_reals all = 0, visible = 0;
    for (uint w = 0; w < words && clrad_some(wanted); w++) {
      for (uint lane = 0; lane < CLRAD_WIDTH; lane++)
        bits[lane] = (int)masks[(ulong)(i + min(lane, lanes - 1)) * words + w];
      const clrad_masks mask = CLRAD_MASKS_OF_INTS(CLRAD_LOAD(bits));
      const uint end = n < 32 * (w + 1) ? n : 32 * (w + 1);
      clrad_reals block = 0, block_visible = 0;
      for (uint k = 32 * w; k < end; k++) {
        const clrad_reals weight = weights_of(&at, samples + k, area);
        block += weight;
        clrad_reals through = weight;
        if (glass) {
          for (uint lane = 0; lane < CLRAD_WIDTH; lane++)
            passed[lane] = passes[passes_at + (ulong)(i - first + min(lane, lanes - 1)) * n + k];
          through = weight * CLRAD_LOAD(passed);
        }
        block_visible += (mask & (1 << (k & 31))) != 0 ? none : through;
      }
      all += block;
      visible += block_visible;
    }
    open &= ~(all > none);
    fractions = all > none ? visible / all : none;
  } else {
    for (uint k = 0; k < n && clrad_some(open); k++) open &= ~(weights_of(&at, samples + k, area) > none);
    fractions = hidden ? none : one;
  }
  CLRAD_STORE(fractions, fraction);
  CLRAD_STORE(CLRAD_TO_INTS(open), bits);
  for (uint lane = 0; lane < lanes; lane++) {
    column[out_at + receiver[lane]] = factor[lane] > 0 && !bits[lane] ? factor[lane] * fraction[lane] : 0;
    undecided[i + lane] = bits[lane] & 1;
  }
#endif
}

/* For the undecided, listed in `list`: a segment from the receiver to the centroid of the clipped shooter. */
__kernel void aim_undecided(__global const REAL* shooter, uint plane, __global const CLRAD_POINT_T* receivers,
                            __global const uint* active, uint chosen, __global const uint* list,
                            __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* ends, uint count) {
  const uint k = get_global_id(0);
  if (k >= count) return;
  const CLRAD_POINT_T p = receivers[receiver_of(active, chosen, list[k])];
  const clrad_pair_vector c =
      clrad_clipped_centroid(shooter, position_of(p), position_lo_of(p), normal_of(p));
  CLRAD_POINT_T end = p;
  end.x = c.x.hi;
  end.y = c.y.hi;
  end.z = c.z.hi;
  end.x_lo = c.x.lo;
  end.y_lo = c.y.lo;
  end.z_lo = c.z.lo;
  end.nx = shooter[CLRAD_SHOOTER_NORMAL] + shooter[CLRAD_SHOOTER_NORMAL + 3];
  end.ny = shooter[CLRAD_SHOOTER_NORMAL + 1] + shooter[CLRAD_SHOOTER_NORMAL + 4];
  end.nz = shooter[CLRAD_SHOOTER_NORMAL + 2] + shooter[CLRAD_SHOOTER_NORMAL + 5];
  end.plane = plane;
  end.surface = CLRAD_NONE;
  origins[k] = p;
  ends[k] = end;
}

__kernel void decide(__global const uint* active, uint chosen, __global const uint* list, __global const uint* masks,
                     __global const REAL* factors, uint glass, __global const REAL* passes, ulong passes_at,
                     __global REAL* column, ulong out_at, uint count) {
  const uint k = get_global_id(0);
  if (k >= count || (masks[k] & 1)) return;
  column[out_at + receiver_of(active, chosen, list[k])] = factors[list[k]] * (glass ? passes[passes_at + k] : (REAL)1);
}
