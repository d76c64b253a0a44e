/* One segment per sample of a pinhole picture, from the eye (or from just before the scene) to just behind the scene.
 *
 * Why: the picture goes through the same engines as the solve, and these take segments within +-4 frame units, so each
 * ray is clipped to the scene's padded box. Rays that miss the box become a segment outside it, which hits nothing.
 * Pre:  camera holds the CAMERA_REALS numbers listed below; samples > 0; pixels count row by row from the top left.
 * Post: origins[i], targets[i] for sample i % samples of pixel first_pixel + i / samples, i < rays.
 * Samples: the same Hammersley set ((k + 1/2) / n, radical inverse of k + 1 / 2n) in every pixel, so n samples fall in n
 * columns and, n a power of two, n rows. Not shifted from pixel to pixel: the pictures have no fine pattern that could
 * beat with it, and along the edge of a lamp, a thousand times brighter than its surroundings, one sample more or
 * less is a notch. */
#include "shared/slab.cl"

/* camera[]: base hi, base lo, forward, right x tan x aspect, up x tan (three each), box low, box high, then
 * the base's distance along `forward` from the eye, and 1 where rays start at the eye itself; see host/render/camera.cpp. */

/* The digits of k in base two, mirrored at the point: exact, as samples are fewer than 2^24. */
REAL radical_inverse(uint k) {
  REAL value = 0;
  for (REAL digit = (REAL)0.5f; k != 0; k >>= 1, digit *= (REAL)0.5f) value += k & 1 ? digit : (REAL)0;
  return value;
}

__kernel void camera_rays(__global const REAL* camera, uint width, uint height, uint samples, uint first_pixel,
                          uint rays, __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* targets) {
  const uint i = (uint)get_global_id(0);
  if (i >= rays) return;
  const uint pixel = first_pixel + i / samples, k = i % samples;
  const uint column = pixel % width, row = pixel / width;

  const REAL jx = ((REAL)k + (REAL)0.5f) / (REAL)samples;
  const REAL jy = radical_inverse(k) + (REAL)0.5f / (REAL)samples;
  const REAL x = (REAL)2 * ((REAL)column + jx) / (REAL)width - (REAL)1;
  const REAL y = (REAL)1 - (REAL)2 * ((REAL)row + jy) / (REAL)height;

  REAL base[3], lo[3], direction[3];
  REAL square = 0;
  const REAL distance = camera[21];
  const bool from_eye = camera[22] != (REAL)0;
  for (int c = 0; c < 3; ++c) {
    const REAL aside = x * camera[9 + c] + y * camera[12 + c];
    direction[c] = camera[6 + c] + aside;
    square += direction[c] * direction[c];
    base[c] = camera[c] + distance * aside;
    lo[c] = from_eye ? camera[3 + c] : (REAL)0;
  }
  REAL enter = -distance, leave = (REAL)1e30f; /* s = -distance is the eye */
  for (int c = 0; c < 3; ++c) clrad_slab(base[c], direction[c], camera[15 + c], camera[18 + c], &enter, &leave);
  const bool inside = enter < leave;

  REAL from[3], to[3];
  for (int c = 0; c < 3; ++c) {
    /* From the eye itself where it is near enough: its lo part is then exact. */
    from[c] = from_eye ? base[c] : base[c] + enter * direction[c];
    to[c] = base[c] + leave * direction[c];
    if (!inside) from[c] = (REAL)2.5f, to[c] = (REAL)3, lo[c] = (REAL)0;
  }
  const REAL length = sqrt(square);
  CLRAD_POINT_T p;
  p.nx = direction[0] / length, p.ny = direction[1] / length, p.nz = direction[2] / length;
  p.plane = CLRAD_NONE, p.surface = CLRAD_NONE, p.spare = 0;
#ifdef CLRAD_FP64
  p.spare_2 = 0;
#endif
  p.x = from[0], p.y = from[1], p.z = from[2];
  p.x_lo = lo[0], p.y_lo = lo[1], p.z_lo = lo[2];
  origins[i] = p;
  p.x = to[0], p.y = to[1], p.z = to[2];
  p.x_lo = 0, p.y_lo = 0, p.z_lo = 0;
  targets[i] = p;
}
