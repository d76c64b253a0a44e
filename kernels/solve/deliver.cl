/* What a shot adds, by superposition: irradiance H += F x shot radiosity at every vertex, and at every patch
 * H += F shot, unshot += rho F shot, with F the column of the shooter (Cohen et al. 1988, eq. for one shot).
 * Arrays are [band][vertex] and [band][patch]; sums are compensated and in shot order, so they do not depend on how
 * work-items are grouped. Shots are shot[b * stride + at].
 *
 * A shooter has one column, or, where coloured glass is in the way, one a band: `colours` is 1 or bands, and columns of
 * receivers are [colour][vertex] and [slot][colour][patch]. */
#include "shared/sum.cl"

__kernel void deliver_to_vertices(__global const REAL* column, uint colours, __global const REAL* shot, uint shot_stride,
                                  uint shot_at, __global REAL* irradiance, __global REAL* irradiance_lost,
                                  uint first, uint vertices, uint bands) {
  const uint v = first + get_global_id(0);
  if (v >= vertices) return;
  REAL f = column[v];
  if (f == 0 && colours == 1) return;
  for (uint b = 0; b < bands; ++b) {
    if (colours > 1) f = column[(ulong)b * vertices + v];
    if (f == 0) continue;
    const ulong i = (ulong)b * vertices + v;
    REAL sum = irradiance[i], lost = irradiance_lost[i];
    clrad_add(&sum, &lost, f * shot[b * shot_stride + shot_at]);
    irradiance[i] = sum;
    irradiance_lost[i] = lost;
  }
}

void add_to_patch(__global REAL* irradiance, __global REAL* irradiance_lost, __global REAL* unshot,
                  __global REAL* unshot_lost, REAL rho, uint i, REAL arrived) {
  REAL sum = irradiance[i], lost = irradiance_lost[i];
  clrad_add(&sum, &lost, arrived);
  irradiance[i] = sum;
  irradiance_lost[i] = lost;
  sum = unshot[i];
  lost = unshot_lost[i];
  clrad_add(&sum, &lost, rho * arrived);
  unshot[i] = sum;
  unshot_lost[i] = lost;
}

/* One shooter: its patch-averaged column begins at columns[at]. */
__kernel void deliver_to_patches(__global const REAL* columns, ulong at, uint colours, __global const REAL* shot, uint shot_stride,
                                 uint shot_at, __global const REAL* rho, __global REAL* irradiance, __global REAL* irradiance_lost,
                                 __global REAL* unshot, __global REAL* unshot_lost, uint patches, uint bands) {
  const uint p = get_global_id(0);
  if (p >= patches) return;
  REAL f = columns[at + p];
  if (f == 0 && colours == 1) return;
  for (uint b = 0; b < bands; ++b) {
    if (colours > 1) f = columns[at + (ulong)b * patches + p];
    if (f == 0) continue;
    const uint i = b * patches + p;
    add_to_patch(irradiance, irradiance_lost, unshot, unshot_lost, rho[i], i,
                 f * shot[b * shot_stride + shot_at]);
  }
}

/* All kept columns at once: a matrix-vector product, one work-item per (patch, band), over slots in order.
 * shot_by_slot[b][slot]. */
__kernel void deliver_kept(__global const REAL* columns, uint colours, __global const REAL* shot_by_slot, uint slots,
                           __global const REAL* rho, __global REAL* irradiance, __global REAL* irradiance_lost,
                           __global REAL* unshot, __global REAL* unshot_lost, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint b = i / patches, p = i % patches;
  const uint colour = colours > 1 ? b : 0;
  REAL sum = 0, lost = 0;
  for (uint s = 0; s < slots; ++s)
    clrad_add(&sum, &lost, columns[((ulong)s * colours + colour) * patches + p] * shot_by_slot[b * slots + s]);
  if (sum != 0) add_to_patch(irradiance, irradiance_lost, unshot, unshot_lost, rho[i], i, sum);
}
