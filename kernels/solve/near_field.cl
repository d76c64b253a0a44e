/* Light from a patch that all but touches a receiver comes from its nearest elements, not from its average: without
 * this, shading jumps along an edge where one patch of the neighbouring wall ends and the next begins.
 *
 * One work-item a receiver from `first` on, for one shooter: where the receiver is nearer than `reach` to the shooter's box,
 *   H += fade F shot (B_near / B_mean - 1),  B_near = sum F_e B_e / sum F_e  over the shooter's elements,
 * with F the kept column (so what is hidden stays hidden) and F_e unoccluded. B_e counts an element's exposed part; a
 * piece that is covered has B_e < 0 and is left out. Arrays: radiosity[b * nodes + node], shot[b * patches + patch].
 *
 * keep_near clears the flags of receivers that are not that near: where a column was not kept, it is traced at the others. */
#include "shared/factor.cl"

#define CLRAD_MOST_BANDS 16

/* Form factor to one cell, as if nothing stood between. From two of its diameters on as to a point at its middle: an error
 * of some 5 % in one term of a correction. */
static REAL cell_factor(__global const REAL* cell, CLRAD_POINT_T p) {
  REAL r[3] = {0, 0, 0}, side2 = 0;
  const int triangle = cell[6] == cell[9] && cell[7] == cell[10] && cell[8] == cell[11];
  for (int a = 0; a < 3; a++) {
    const REAL sum = cell[a] + cell[3 + a] + cell[6 + a];
    const REAL middle = triangle ? sum / 3 : (sum + cell[9 + a]) / 4;
    const REAL at = a == 0 ? p.x : a == 1 ? p.y : p.z;
    r[a] = middle - at;
    side2 += (cell[a] - cell[6 + a]) * (cell[a] - cell[6 + a]);
  }
  const REAL r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  if (r2 < 4 * side2)
    return clrad_exact_factor(cell, clrad_make(p.x, p.y, p.z), clrad_make(p.x_lo, p.y_lo, p.z_lo),
                              clrad_make(p.nx, p.ny, p.nz));
  __global const REAL* n = cell + CLRAD_SHOOTER_NORMAL;
  const REAL above = p.nx * r[0] + p.ny * r[1] + p.nz * r[2], facing = -(n[0] * r[0] + n[1] * r[1] + n[2] * r[2]);
  return above > 0 && facing > 0 ? CLRAD_R(0.31830988618379067) * (above / r2) * (facing / r2) * cell[CLRAD_SHOOTER_AREA] : 0;
}

/* Square of the distance of p from the box of a patch: its low corner, then its high one. */
static REAL box_distance2(__global const REAL* box, CLRAD_POINT_T p) {
  const REAL at[3] = {p.x, p.y, p.z};
  REAL d2 = 0;
  for (int a = 0; a < 3; a++) {
    const REAL low = box[a] - at[a], high = at[a] - box[3 + a];
    const REAL d = low > 0 ? low : high > 0 ? high : 0;
    d2 += d * d;
  }
  return d2;
}

__kernel void keep_near(__global const CLRAD_POINT_T* receivers, __global const REAL* box, uint patch, REAL reach,
                        __global uint* flags, uint first, uint count) {
  const uint i = get_global_id(0);
  if (i >= count || !flags[i]) return;
  flags[i] = box_distance2(box + 6 * patch, receivers[first + i]) < reach * reach;
}

__kernel void near_field(__global const CLRAD_POINT_T* receivers, __global const REAL* column,
                         __global const REAL* shooters, uint first_node, uint elements, __global const REAL* radiosity,
                         uint nodes, __global const REAL* mean, __global const REAL* shot, uint patch, uint patches,
                         __global const REAL* box, REAL reach, __global REAL* irradiance, uint first, uint vertices,
                         uint bands) {
  const uint v = first + get_global_id(0);
  if (v >= vertices) return;
  const REAL f = column[v];
  if (f == 0) return;
  const CLRAD_POINT_T p = receivers[v];
  const REAL d2 = box_distance2(box + 6 * patch, p);
  if (d2 >= reach * reach) return;
  /* Fades out over the outer half, or the border of the near field would show as a line. */
  const REAL d = sqrt(d2), fade = 2 * d <= reach ? 1 : 2 - 2 * d / reach;
  REAL all = 0, sum[CLRAD_MOST_BANDS];
  for (uint b = 0; b < bands; b++) sum[b] = 0;
  for (uint e = first_node; e < first_node + elements; e++) {
    if (radiosity[e] < 0) continue;
    const REAL part = cell_factor(shooters + (ulong)e * CLRAD_SHOOTER_SIZE, p);
    all += part;
    for (uint b = 0; b < bands; b++) sum[b] += part * radiosity[(ulong)b * nodes + e];
  }
  if (!(all > 0)) return;
  for (uint b = 0; b < bands; b++) {
    const REAL average = mean[b * patches + patch];
    if (average > 0)
      irradiance[(ulong)b * vertices + v] +=
          fade * f * shot[b * patches + patch] * (sum[b] / (all * average) - 1);
  }
}
