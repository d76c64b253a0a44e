/* The brightest patch: power[p] = area x sum over bands of |unshot|, always float since it only ranks and measures
 * convergence ("the patch with the highest undistributed radiosity is found", section 1.3). Arrays are [band][patch]. */

__kernel void unshot_power(__global const REAL* unshot, __global const REAL* area, __global float* power, uint patches,
                           uint bands) {
  const uint p = get_global_id(0);
  if (p >= patches) return;
  REAL sum = 0;
  for (uint b = 0; b < bands; ++b) sum += fabs(unshot[b * patches + p]);
  power[p] = (float)(sum * area[p]);
}

/* Takes the unshot radiosity of `count` patches: shot[b][k] gets that of chosen[k], which keeps none (a planar patch does
 * not light itself). total[b][patch] sums what was ever shot. */
__kernel void take_shot(__global REAL* unshot, __global REAL* unshot_lost, __global REAL* total, __global REAL* shot,
                        __global const uint* chosen, uint count, uint patches, uint bands) {
  const uint k = get_global_id(0);
  if (k >= count * bands) return;
  const uint b = k / count, i = b * patches + chosen[k % count];
  shot[k] = unshot[i];
  total[i] += unshot[i];
  unshot[i] = 0;
  unshot_lost[i] = 0;
}

/* Keys that sort patches by falling power; floats that are not negative sort like their bits. */
__kernel void rank_power(__global const float* power, __global uint* keys, __global uint* order, uint patches) {
  const uint p = get_global_id(0);
  if (p >= patches) return;
  keys[p] = ~as_uint(power[p]);
  order[p] = p;
}

/* The same for every patch whose column is kept (slot != CLRAD_NONE) at once: shot_by_slot[b][slot]. */
__kernel void take_shots(__global REAL* unshot, __global REAL* unshot_lost, __global REAL* total,
                         __global REAL* pending, __global const uint* slot_of, __global REAL* shot_by_slot, uint slots,
                         uint patches, uint bands) {
  const uint p = get_global_id(0);
  if (p >= patches || slot_of[p] == CLRAD_NONE) return;
  for (uint b = 0; b < bands; ++b) {
    const uint i = b * patches + p;
    shot_by_slot[b * slots + slot_of[p]] = unshot[i];
    pending[i] += unshot[i];
    total[i] += unshot[i];
    unshot[i] = 0;
    unshot_lost[i] = 0;
  }
}
