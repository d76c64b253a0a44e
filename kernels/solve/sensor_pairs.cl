/* Which patches may light which sensors, by how much at most, and how many rays each such pair gets; the rays are sensor.cl's. */
#include "shared/factor.cl"
#if CLRAD_WIDTH > 1
#include "shared/factor_packet.cl"
#endif
#include "shared/corner.cl"

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

/* What is left of a patch that lies behind the horizon but for rounding is nothing: its reciprocal would overflow. */
static inline REAL seen_factor(REAL f) { return f > CLRAD_R(1e-30) ? f : 0; }

/* factor[pair], unoccluded, and what it may bring (bands summed), which shares out the first rays. Pairs of sensor s are from
 * offsets[s patches] on. Work-item: a patch, and CLRAD_WIDTH sensors. */
__kernel void sensor_factors(__global const CLRAD_POINT_T* sensors, __global const REAL* shooters,
                             __global const uint* offsets, __global const REAL* brightness, __global REAL* factor,
                             __global float* weight, uint first, uint count, uint patches) {
  const uint packets = (count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint patch = get_global_id(0) / packets, begin = get_global_id(0) % packets * CLRAD_WIDTH;
  if (patch >= patches) return;
  __global const REAL* shooter = shooters + (ulong)patch * CLRAD_SHOOTER_SIZE;
  const uint lanes = min(count - begin, (uint)CLRAD_WIDTH);
#if CLRAD_WIDTH > 1
  uint sensor[CLRAD_WIDTH];
  int asked[CLRAD_WIDTH], left[CLRAD_WIDTH];
  REAL of_lane[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; lane++) {
    const uint s = begin + min(lane, lanes - 1);
    sensor[lane] = first + s;
    asked[lane] = lane < lanes && offsets[s * patches + patch] < offsets[s * patches + patch + 1] ? -1 : 0;
  }
  const clrad_ints any = CLRAD_LOAD(asked);
  if (clrad_bits_of_any(any) == 0) return;
  clrad_receivers at;
  clrad_load_receivers(sensors, sensor, &at);
  clrad_masks later;
  const clrad_reals factors = clrad_exact_factors(shooter, &at, CLRAD_MASKS_OF_INTS(any), &later);
  CLRAD_STORE(factors, of_lane);
  CLRAD_STORE(CLRAD_TO_INTS(later), left);
#endif
  for (uint lane = 0; lane < lanes; lane++) {
    const uint pair = offsets[(begin + lane) * patches + patch];
    if (pair == offsets[(begin + lane) * patches + patch + 1]) continue;
#if CLRAD_WIDTH > 1
    REAL f = of_lane[lane];
    if (left[lane])
#else
    REAL f;
#endif
    {
      const CLRAD_POINT_T s = sensors[first + begin + lane];
      f = clrad_exact_factor(shooter, clrad_make(s.x, s.y, s.z), clrad_make(s.x_lo, s.y_lo, s.z_lo),
                             clrad_make(s.nx, s.ny, s.nz));
    }
    f = seen_factor(f);
    factor[pair] = f;
    weight[pair] = (float)(f * brightness[patch]);
  }
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
