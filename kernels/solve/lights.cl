/* Irradiance by point, spot and directional lights: sharp, so one segment a (receiver, light) decides, and no samples.
 *
 * A light is a record of CLRAD_LIGHT_SIZE reals: kind, position hi and lo (frame), direction in which it shines, cosine of a
 * spot's outer cone, 1 / (cos inner - cos outer), and the normal of the surface that it lies on (0 0 0: none).
 *   H = I / r^2 cos x spot,   spot = clamp((c - cos outer) / (cos inner - cos outer), 0, 1)^2, c = cos of the angle to the axis,
 * with I per square of the frame's unit, or H = H_facing cos of a directional light (KHR_lights_punctual of glTF 2.0, without the
 * 0.001 by which its sample code keeps from dividing by 0: that dims narrow spots).
 *
 * light_factors   H / I at receiver first + i where nothing stands between; 0 and no flag where nothing arrives
 * far_ends        for directional lights, ends of the segments: beyond the scene, which lies in [-1, 1]^3
 * add_light       H += factor I (x what glass lets pass) where the segment's bit in masks is 0, over lights in order, sums compensated
 * reflect_direct  emitted += rho H on patches: what is reflected once is what patches emit to begin with
 * add_direct      irradiance += H
 * hold_direct     irradiance += (s - 1) H before it is divided by the row sum s (balance.cl): what lights bring is no part of a row
 * interpolate_direct  new vertices get the mean of their parents
 *
 * A light within CLOSE |r| of a receiver's plane is in it and brings nothing: normals and differences are rounded by less. */
#include "shared/math.cl"
#include "shared/sum.cl"

#define CLRAD_LIGHT_SIZE 15
#define CLRAD_LIGHT_SPOT 1
#define CLRAD_LIGHT_DIRECTIONAL 2
#define CLOSE (8 * CLRAD_EPSILON)

static clrad_vector three(__global const REAL* v) { return clrad_make(v[0], v[1], v[2]); }

/* From the receiver to the light. */
static clrad_vector to_light(__global const REAL* light, CLRAD_POINT_T p) {
  return clrad_make((light[1] - p.x) + (light[4] - p.x_lo), (light[2] - p.y) + (light[5] - p.y_lo),
                    (light[3] - p.z) + (light[6] - p.z_lo));
}

static REAL light_factor(__global const REAL* light, CLRAD_POINT_T p) {
  const clrad_vector n = clrad_make(p.nx, p.ny, p.nz), axis = three(light + 7), behind = three(light + 12);
  if (light[0] == CLRAD_LIGHT_DIRECTIONAL) {
    const REAL above = -clrad_dot(n, axis);
    return above > CLOSE ? above : 0;
  }
  const clrad_vector to = to_light(light, p);
  /* Scaled by a power of two: squares of a light that all but touches the receiver stay normal. */
  const REAL scale = clrad_power_of_two(clrad_largest(to));
  if (!(scale > 0)) return 0;
  const clrad_vector r = clrad_scaled(to, 1 / scale);
  const REAL r2 = clrad_dot(r, r), length = sqrt(r2), above = clrad_dot(n, r);
  if (!(above > CLOSE * length)) return 0;
  if (clrad_dot(behind, r) > CLOSE * length) return 0; /* the surface that it lies on hides it from behind */
  /* No nearer than a step of the visibility grid: as far as rays tell it is no nearer, and 1 / r^2 stays a float. */
  const REAL unit = scale > CLRAD_R(0x1p-38) ? scale : CLRAD_R(0x1p-38);
  REAL factor = above / length / r2 / unit / unit;
  if (light[0] == CLRAD_LIGHT_SPOT) {
    const REAL ramp = (-clrad_dot(axis, r) / length - light[10]) * light[11];
    const REAL inside = ramp < 0 ? 0 : ramp > 1 ? 1 : ramp;
    factor *= inside * inside;
  }
  return factor;
}

/* hidden[]: receivers that something covers see nothing; not read where `has_hidden` is 0. */
__kernel void light_factors(__global const REAL* lights, uint light, __global const CLRAD_POINT_T* receivers,
                            __global const uint* hidden, uint has_hidden, __global REAL* factors, __global uint* flags,
                            uint first, uint count) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  REAL factor = 0;
  if (!has_hidden || !hidden[first + i])
    factor = light_factor(lights + (ulong)light * CLRAD_LIGHT_SIZE, receivers[first + i]);
  factors[i] = factor;
  flags[i] = factor > 0;
}

/* Numbers within the range -> receivers. */
__kernel void number_lit(__global uint* active, uint first, uint count) {
  const uint i = get_global_id(0);
  if (i < count) active[i] += first;
}

/* ends[v] of the chosen receivers: against the light's direction until the scene's box is left, and 1/16 more. A receiver may
 * stand outside of the box, up to 3.75; where it is past the box already, the end is only that much further. */
__kernel void far_ends(__global const REAL* lights, uint light, __global const CLRAD_POINT_T* receivers,
                       __global const uint* active, __global CLRAD_POINT_T* ends, uint count) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const uint v = active[i];
  const CLRAD_POINT_T p = receivers[v];
  const clrad_vector w = clrad_scaled(three(lights + (ulong)light * CLRAD_LIGHT_SIZE + 7), -1);
  const REAL at[3] = {p.x, p.y, p.z}, way[3] = {w.x, w.y, w.z};
  REAL t = 16;
  for (int a = 0; a < 3; a++) {
    if (way[a] == 0) continue;
    const REAL leaves = ((way[a] > 0 ? 1 : -1) - at[a]) / way[a];
    t = leaves < t ? leaves : t;
  }
  t = (t > 0 ? t : 0) + CLRAD_R(0.0625);
  CLRAD_POINT_T end = p;
  end.plane = CLRAD_NONE;
  end.surface = CLRAD_NONE;
  clrad_pair s = clrad_two_sum(p.x, t * w.x);
  end.x = s.hi;
  end.x_lo = s.lo + p.x_lo;
  s = clrad_two_sum(p.y, t * w.y);
  end.y = s.hi;
  end.y_lo = s.lo + p.y_lo;
  s = clrad_two_sum(p.z, t * w.z);
  end.z = s.hi;
  end.z_lo = s.lo + p.z_lo;
  ends[v] = end;
}

/* irradiance[b * stride + v] of the chosen receivers v = active[begin .. begin + count - 1]; intensities[light * bands + b].
 * by_glass: times passes[(b % colours) * count + i - begin], what glass lets pass. */
__kernel void add_light(__global const uint* active, __global const uint* masks, __global const REAL* factors,
                        __global const REAL* intensities, uint light, uint by_glass, __global const REAL* passes,
                        uint colours, __global REAL* irradiance, __global REAL* irradiance_lost, uint first,
                        ulong stride, uint bands, uint begin, uint count) {
  const uint k = get_global_id(0), i = begin + k;
  if (k >= count || (masks[i] & 1)) return;
  const uint v = active[i];
  const REAL factor = factors[v - first];
  for (uint b = 0; b < bands; b++) {
    REAL sum = irradiance[b * stride + v], lost = irradiance_lost[b * stride + v];
    const REAL passed = by_glass ? passes[(ulong)(b % colours) * count + k] : 1;
    clrad_add(&sum, &lost, passed * factor * intensities[light * bands + b]);
    irradiance[b * stride + v] = sum;
    irradiance_lost[b * stride + v] = lost;
  }
}

__kernel void reflect_direct(__global const REAL* direct, __global const REAL* rho, __global REAL* emitted, uint count) {
  const uint i = get_global_id(0);
  if (i < count) emitted[i] += rho[i] * direct[i];
}

/* Rows of `values` numbers, of each those from `first` on. */
__kernel void add_direct(__global const REAL* direct, __global REAL* irradiance, uint first, uint values, uint rows) {
  const ulong i = get_global_id(0);
  const uint each = values - first;
  if (i >= (ulong)each * rows) return;
  const ulong at = i / each * values + first + i % each;
  irradiance[at] += direct[at];
}

/* CLRAD_LEAST_ROW: as close_vertices of balance.cl, which divides. */
#define CLRAD_LEAST_ROW CLRAD_R(0.25)
__kernel void hold_direct(__global const REAL* direct, __global const REAL* row_sum, __global REAL* irradiance,
                          uint vertices, uint bands) {
  const uint v = get_global_id(0);
  if (v >= vertices || !(row_sum[v] > CLRAD_LEAST_ROW)) return;
  for (uint b = 0; b < bands; b++)
    irradiance[(ulong)b * vertices + v] += (row_sum[v] - 1) * direct[(ulong)b * vertices + v];
}

__kernel void interpolate_direct(__global REAL* direct, __global const uint* parents, uint first, uint vertices,
                                 uint bands) {
  const uint i = get_global_id(0);
  if (first + i >= vertices) return;
  for (uint b = 0; b < bands; b++) {
    __global REAL* row = direct + (ulong)b * vertices;
    REAL sum = 0;
    for (int k = 0; k < 4; k++) sum += row[parents[4 * i + k]];
    row[first + i] = sum / 4;
  }
}
