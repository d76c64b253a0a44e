/* The steps of GMRES (Saad & Schultz 1986) on the balance form (balance.cl), all bands side by side: vectors are
 * [band][patch], a basis is [vector][band][patch]. Only patches that have a column are unknowns; others stay 0.
 *
 * apply     image = A vector,  A v_i = loss_i v_i + coupling_i sum_j F_ij (v_i - v_j)
 * dots      partial[(k, band, block)] = sum over a block of 1024 patches of weight x basis[k] x vector, compensated, patch
 *           after patch; the host adds the blocks. So a dot product is the same however work-items are grouped
 * subtract  vector -= sum_k factor[k][band] basis[k], k in order
 * scale     to = factor[band] x from
 * combine   sum = sum_k factor[k][band] basis[k] */
#include "shared/sum.cl"

#define BLOCK 1024u

__kernel void apply(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, __global const uint* slot_of,
                    uint slots, __global const REAL* loss, __global const REAL* coupling,
                    __global const REAL* vector, ulong at, __global REAL* image, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint p = i % patches;
  __global const REAL* of_band = vector + at + (i - p);
  if (slot_of[p] == CLRAD_NONE) {
    image[i] = 0;
    return;
  }
  const REAL own = of_band[p];
  const uint colour = i / patches % colours;
  REAL sum = 0, lost = 0;
  for (uint s = 0; s < slots; ++s)
    clrad_add(&sum, &lost, columns[((ulong)s * colours + colour) * patches + p] * (own - of_band[patch_of_slot[s]]));
  image[i] = loss[i] * own + coupling[i] * sum;
}

__kernel void dots(__global const REAL* basis, uint count, __global const REAL* vector, __global const REAL* weight,
                   __global REAL* partial, uint blocks, uint patches, uint bands) {
  const uint g = get_global_id(0);
  if (g >= count * bands * blocks) return;
  const uint block = g % blocks, b = g / blocks % bands, k = g / blocks / bands;
  __global const REAL* x = basis + ((ulong)k * bands + b) * patches;
  __global const REAL* y = vector + (ulong)b * patches;
  REAL sum = 0, lost = 0;
  for (uint p = block * BLOCK; p < min((block + 1) * BLOCK, patches); ++p)
    clrad_add(&sum, &lost, weight[p] * x[p] * y[p]);
  partial[g] = sum;
}

__kernel void subtract(__global REAL* vector, __global const REAL* basis, __global const REAL* factor, uint count,
                       uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint b = i / patches;
  REAL sum = 0, lost = 0;
  for (uint k = 0; k < count; ++k)
    clrad_add(&sum, &lost, factor[k * bands + b] * basis[(ulong)k * bands * patches + i]);
  vector[i] -= sum;
}

__kernel void scale(__global const REAL* from, __global const REAL* factor, __global const uint* slot_of,
                    __global REAL* to, ulong at, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  to[at + i] = slot_of[i % patches] == CLRAD_NONE ? 0 : factor[i / patches] * from[i];
}

__kernel void combine(__global const REAL* basis, __global const REAL* factor, uint count, __global REAL* sum_of,
                      uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint b = i / patches;
  REAL sum = 0, lost = 0;
  for (uint k = 0; k < count; ++k)
    clrad_add(&sum, &lost, factor[k * bands + b] * basis[(ulong)k * bands * patches + i]);
  sum_of[i] = sum;
}
