/* What the near field (near_field.cl) takes from vertices beside a patch, or gives them, this patch sends elsewhere less or more: it sends
 * what it has. The light that each patch owes that way, and sums of it.
 *
 * gains_in_strips  one work-item a strip of the vertices and a band, for one shooter: the power of its gains there, and 0 in their place.
 *                  Blocks that it did not touch are passed over.
 * owed_by_patches  one work-item a (patch, band): the radiosity that it owes, less the power of its gains by the area that is exposed.
 * add_near         irradiance += near.
 * from_near        one work-item a (patch, band): sum of F B over the patches whose boxes are nearer than their reach[patch], so a bound
 *                  of what near fields are of. Columns are [slot][colour][patch], boxes low x y z, high x y z.
 *
 * gains are [band][vertex], area[v] is the part of the surfaces that vertex v stands for; in_strips[(slot bands + band) strips + strip].
 * Strips are whole blocks, and their sums are in the order of vertices and strips, so they do not depend on work-groups. */
#include "shared/sum.cl"

__kernel void gains_in_strips(__global REAL* gains, __global const uint* touched, uint block, uint stamp,
                              __global const REAL* area, __global REAL* in_strips, uint slot, uint strips, uint vertices, uint bands) {
  const uint i = get_global_id(0);
  if (i >= strips * bands) return;
  const uint strip = i % strips, b = i / strips, blocks = (vertices + block - 1) / block;
  const uint begin = (uint)((ulong)blocks * strip / strips), end = (uint)((ulong)blocks * (strip + 1) / strips);
  REAL sum = 0, lost = 0;
  for (uint k = begin; k < end; ++k) {
    if (touched[k] != stamp) continue;
    for (uint v = k * block; v < min((k + 1) * block, vertices); ++v) {
      __global REAL* gain = gains + (ulong)b * vertices + v;
      if (*gain == 0) continue;
      clrad_add(&sum, &lost, area[v] * *gain);
      *gain = 0;
    }
  }
  in_strips[((ulong)slot * bands + b) * strips + strip] = sum;
}

__kernel void owed_by_patches(__global const REAL* in_strips, __global const uint* slot_of_patch, __global const REAL* exposed_area,
                              uint strips, __global REAL* owed, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint p = i % patches, b = i / patches, slot = slot_of_patch[p];
  owed[i] = 0;
  if (slot == CLRAD_NONE || !(exposed_area[p] > 0)) return;
  REAL sum = 0, lost = 0;
  for (uint k = 0; k < strips; ++k) clrad_add(&sum, &lost, in_strips[((ulong)slot * bands + b) * strips + k]);
  owed[i] = -sum / exposed_area[p];
}

__kernel void add_near(__global const REAL* near, __global REAL* irradiance, uint count) {
  const uint i = get_global_id(0);
  if (i < count) irradiance[i] += near[i];
}

__kernel void from_near(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, uint slots,
                        __global const REAL* box, __global const REAL* reach, __global const REAL* radiosity, __global REAL* light,
                        uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint p = i % patches, b = i / patches;
  __global const REAL* own = box + 6 * p;
  REAL sum = 0, lost = 0;
  for (uint s = 0; s < slots; ++s) {
    const uint q = patch_of_slot[s];
    __global const REAL* other = box + 6 * q;
    REAL d2 = 0;
    for (int a = 0; a < 3; ++a) {
      const REAL d = fmax(fmax(own[a] - other[3 + a], other[a] - own[3 + a]), (REAL)0);
      d2 += d * d;
    }
    if (d2 < reach[q] * reach[q])
      clrad_add(&sum, &lost, columns[((ulong)s * colours + b % colours) * patches + p] * radiosity[(ulong)b * patches + q]);
  }
  light[i] = sum;
}
