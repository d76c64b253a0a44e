/* Direct light where rays end: the points they meet become receivers, to which each light's form factor and visible fraction
 * are found by the solver's own kernels (kernels/solve/form_factor.cl and the engines).
 *
 * Pre:  seen[i] of ray i; exitance and reflectance[polygon * bands + band]; receivers are the rays listed in `lit`.
 * Post: shown[ray * bands + band] = E + rho sum over lights of E_light x F x visible fraction, fronts only. */
#include "shared/surface.cl"

/* shown = E; flags[i] = 1 where light that arrives is reflected. */
__kernel void start_direct(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                           __global const uint* seen, uint rays, __global const REAL* polygons,
                           __global const REAL* exitance, __global const REAL* reflectance, uint bands,
                           __global float* shown, __global uint* flags) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays) return;
  const uint polygon = seen[ray];
  __global float* out = shown + (ulong)ray * bands;
  const int front =
      polygon != CLRAD_NONE &&
      clrad_meet(polygons + (ulong)polygon * CLRAD_POLYGON_REALS, origins + ray, targets + ray).facing < (REAL)0;
  uint reflects = 0;
  for (uint band = 0; band < bands; ++band) {
    const ulong at = front ? (ulong)polygon * bands + band : 0;
    out[band] = front ? (float)exitance[at] : 0.0f;
    reflects |= front && reflectance[at] > (REAL)0;
  }
  flags[ray] = reflects;
}

__kernel void place_receivers(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                              __global const uint* seen, __global const uint* lit, uint count,
                              __global const REAL* polygons, __global const REAL* axes, __global const uint* planes,
                              __global CLRAD_POINT_T* receivers) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const uint ray = lit[i], polygon = seen[ray];
  __global const REAL* table = polygons + (ulong)polygon * CLRAD_POLYGON_REALS;
  receivers[i] = clrad_point_on(table, axes + (ulong)polygon * CLRAD_AXES_REALS,
                                clrad_meet(table, origins + ray, targets + ray), planes[polygon], polygon);
}

/* column[b % colours * stride + i]: form factor x visible fraction of light number `light` at receiver i in band b; lights[light * bands + band] its E. */
__kernel void add_light(__global const uint* seen, __global const uint* lit, uint count, __global const REAL* column,
                        ulong stride, uint colours, __global const REAL* lights, uint light, __global const REAL* reflectance, uint bands,
                        __global float* shown) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const uint ray = lit[i], polygon = seen[ray];
  for (uint band = 0; band < bands; ++band) {
    const REAL f = column[band % colours * stride + i];
    if (f > (REAL)0)
      shown[(ulong)ray * bands + band] +=
          (float)(reflectance[(ulong)polygon * bands + band] * lights[light * bands + band] * f);
  }
}

/* irradiance[band * count + i] at receiver i, by point, spot and directional lights. */
__kernel void add_irradiance(__global const uint* seen, __global const uint* lit, uint count,
                             __global const REAL* irradiance, __global const REAL* reflectance, uint bands,
                             __global float* shown) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const uint ray = lit[i], polygon = seen[ray];
  for (uint band = 0; band < bands; ++band)
    shown[(ulong)ray * bands + band] +=
        (float)(reflectance[(ulong)polygon * bands + band] * irradiance[(ulong)band * count + i]);
}
