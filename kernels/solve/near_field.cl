/* Light from a patch that is near a receiver comes most from its nearest elements, not from its average: without
 * this, shading jumps along an edge where one patch of the neighbouring wall ends and the next begins.
 *
 * One work-item a receiver from `first` on, for one shooter: where the receiver is nearer than `reach` to the shooter's box,
 *   gain = fade F shot (B_near / B_mean - 1),  B_near = sum F_e B_e / sum F_e  over the shooter's elements,
 * with F the kept column (so what is hidden stays hidden) and F_e unoccluded. B_e is that of the element's exposed part, and near by
 * it varies over the element as its corners do: otherwise a receiver at its edge would see stairs. A piece that is covered has
 * B_e < 0 and is left out. Columns are [colour][vertex] as in deliver.cl. Arrays: radiosity[b * nodes + node], slopes[3 (b * nodes + node) + ..], shot[b * patches + patch].
 * near += gain, [band][vertex]. gains holds this shooter's alone, 0 before, and touched[v / block] = stamp where there are any:
 * near_balance.cl adds them up and leaves 0 again.
 *
 * keep_near clears the flags of receivers that are not that near: where a column was not kept, it is traced at the others. */
#include "shared/factor.cl"

#define CLRAD_MOST_BANDS 16

/* Sixteen of the points (i, j) / 7, 0 <= i, j <= 7, of a cell: rows j = row and row + 1. */
__constant REAL clrad_spot_i[16] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
__constant REAL clrad_spot_j[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};

static clrad_many clrad_one_where_positive(clrad_many whole) { return clamp(whole, (REAL)0, (REAL)1); }

/* mean[] = what s, t and s t, taken from the middle of the area (s t of a quad only), are on average over the light that a receiver
 * gets from a cell, 0 <= s, t <= 1 along its edges from the first corner. By 8 x 8 points of a quad, 36 of a triangle, each standing for
 * its part of the area; each counts by the kernel of the form factor, with half the spacing of the points added to its distance: a receiver
 * on the cell's very edge sees what is next to it and nothing else. */
static void light_centre(__global const REAL* cell, int triangle, CLRAD_POINT_T p, REAL side2, REAL* mean) {
  const REAL delta2 = 1.0f / (2 * 14 * 14), at[3] = {p.x, p.y, p.z}, n[3] = {p.nx, p.ny, p.nz};
  const REAL middle = triangle ? CLRAD_R(0.33333333333333333) : (REAL)0.5f;
  REAL all = 0, x_sum = 0, y_sum = 0, xy_sum = 0;
  for (int row = 0; row < 8; row += 2) {
    const clrad_many i = vload16(0, clrad_spot_i), j = vload16(0, clrad_spot_j) + (REAL)row;
    const clrad_many s = i / 7, t = j / 7, k = 7 - i - j;
    clrad_many height = 0, r2 = delta2; /* r2 in units of the cell: r^4 of tiny ones is below the smallest float */
    for (int a = 0; a < 3; a++) {
      const REAL c0 = cell[a], c1 = cell[3 + a], c2 = cell[6 + a], c3 = cell[9 + a];
      const clrad_many d = (c0 - at[a]) + s * (c1 - c0) + t * (c3 - c0) + s * t * (triangle ? 0 : c0 - c1 + c2 - c3);
      height += n[a] * d;
      r2 += d * d / side2;
    }
    const clrad_many inner_i = clrad_one_where_positive(i), inner_j = clrad_one_where_positive(j);
    clrad_many part; /* trapezoids: corners of a quad 1, edges 2, inside 4; of a triangle, 1, 3 and 6 */
    if (triangle) {
      const clrad_many inner = inner_i + inner_j + clrad_one_where_positive(k);
      part = clrad_one_where_positive(k + 1) * inner * (inner + 1) / 2;
    } else {
      part = (1 + inner_i * clrad_one_where_positive(7 - i)) * (1 + inner_j * clrad_one_where_positive(7 - j));
    }
    const clrad_many weight = part * fmax(height, (REAL)0) / (r2 * r2), x = s - middle, y = t - middle;
    all += clrad_lanes_sum(weight);
    x_sum += clrad_lanes_sum(weight * x);
    y_sum += clrad_lanes_sum(weight * y);
    xy_sum += clrad_lanes_sum(weight * x * y);
  }
  mean[0] = all > 0 ? x_sum / all : 0;
  mean[1] = all > 0 ? y_sum / all : 0;
  mean[2] = all > 0 ? xy_sum / all : 0;
}

/* Where r2 is below this many squared diameters of a cell the receiver sees its shape; from there on as to a point at its middle: an
 * error of some 5 % in one term of a correction. */
#define CLRAD_NEAR_DIAMETERS2 4

/* Form factor to one cell nearer than that, as if nothing stood between, and the centre of its light. */
static REAL near_cell_factor(__global const REAL* cell, CLRAD_POINT_T p, REAL side2, REAL* mean) {
  const int triangle = cell[6] == cell[9] && cell[7] == cell[10] && cell[8] == cell[11];
  light_centre(cell, triangle, p, side2, mean);
  return clrad_exact_factor(cell, clrad_make(p.x, p.y, p.z), clrad_make(p.x_lo, p.y_lo, p.z_lo),
                            clrad_make(p.nx, p.ny, p.nz));
}

/* Rows of a packet: middle, normal and area of each of 16 cells and the square of its diameter. Lanes without a cell, and those of
 * covered ones, have area 0 and a diameter of 0. */
#define CLRAD_CELL_X 0
#define CLRAD_CELL_NORMAL 3
#define CLRAD_CELL_AREA 6
#define CLRAD_CELL_SIDE2 7
#define CLRAD_CELL_ROWS 8

/* Form factors to the 16 cells of a packet, 0 to the near ones. near_by[lane] < 0 where a cell is near; returns whether any is. */
static int far_cell_factors(__global const REAL* packet, CLRAD_POINT_T p, clrad_many* factor, REAL* near_by) {
  const REAL at[3] = {p.x, p.y, p.z}, pn[3] = {p.nx, p.ny, p.nz};
  const clrad_many none = 0;
  clrad_many r2 = 0, above = 0, facing = 0;
  for (int a = 0; a < 3; a++) {
    const clrad_many r = vload16(CLRAD_CELL_X + a, packet) - at[a];
    r2 += r * r;
    above += pn[a] * r;
    facing -= vload16(CLRAD_CELL_NORMAL + a, packet) * r;
  }
  const clrad_many margin = r2 - CLRAD_NEAR_DIAMETERS2 * vload16(CLRAD_CELL_SIDE2, packet);
  vstore16(margin, 0, near_by);
  const clrad_many per = 1 / r2, seen = fmax(above, none) * per * (fmax(facing, none) * per);
  const clrad_many far = CLRAD_R(0.31830988618379067) * seen * vload16(CLRAD_CELL_AREA, packet);
  *factor = margin < 0 || !(r2 > 0) ? none : far;
  REAL least = near_by[0];
  for (int lane = 1; lane < 16; lane++) least = min(least, near_by[lane]);
  return least < 0;
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

__kernel void near_field(__global const CLRAD_POINT_T* receivers, __global const REAL* column, uint colours,
                         __global const REAL* shooters, __global const REAL* packets, uint first_packet, uint end_packet,
                         uint first_cell, __global const REAL* radiosity, __global const REAL* far_radiosity,
                         __global const REAL* slopes, uint cells, uint packet_count,
                         __global const REAL* mean_radiosity, __global const REAL* shot, uint patch, uint patches,
                         __global const REAL* box, REAL reach, __global REAL* near, __global REAL* gains,
                         volatile __global uint* touched, uint block, uint stamp, uint first, uint vertices, uint bands) {
  const uint v = first + get_global_id(0);
  if (v >= vertices) return;
  int reached = 0;
  for (uint c = 0; c < colours; c++) reached |= column[(ulong)c * vertices + v] != 0;
  if (!reached) return;
  const CLRAD_POINT_T p = receivers[v];
  const REAL d2 = box_distance2(box + 6 * patch, p);
  if (d2 >= reach * reach) return;
  /* Fades out over the outer half, or the border of the near field would show as a line. */
  const REAL d = sqrt(d2), fade = 2 * d <= reach ? 1 : 2 - 2 * d / reach;
  REAL near_all = 0, sum[CLRAD_MOST_BANDS], near_by[16];
  clrad_many far_all = 0, far_sum[CLRAD_MOST_BANDS];
  for (uint b = 0; b < bands; b++) sum[b] = 0, far_sum[b] = 0;
  for (uint packet = first_packet; packet < end_packet; packet++) {
    __global const REAL* rows = packets + (ulong)packet * CLRAD_CELL_ROWS * 16;
    clrad_many factor;
    const int any_near = far_cell_factors(rows, p, &factor, near_by);
    far_all += factor;
    for (uint b = 0; b < bands; b++) far_sum[b] += factor * vload16(b * (ulong)packet_count + packet, far_radiosity);
    for (uint lane = 0; any_near && lane < 16; lane++) {
      if (!(near_by[lane] < 0)) continue;
      const uint e = first_cell + 16 * (packet - first_packet) + lane;
      REAL mean[3];
      const REAL part = near_cell_factor(shooters + (ulong)e * CLRAD_SHOOTER_SIZE, p, rows[16 * CLRAD_CELL_SIDE2 + lane], mean);
      near_all += part;
      for (uint b = 0; b < bands; b++) {
        const ulong of = (ulong)b * cells + e;
        __global const REAL* slope = slopes + 3 * of;
        const REAL there = radiosity[of] + slope[0] * mean[0] + slope[1] * mean[1] + slope[2] * mean[2];
        sum[b] += part * (there > 0 ? there : 0);
      }
    }
  }
  const REAL all = near_all + clrad_lanes_sum(far_all);
  if (!(all > 0)) return;
  for (uint b = 0; b < bands; b++) {
    const REAL average = mean_radiosity[b * patches + patch];
    if (!(average > 0)) continue;
    const ulong i = (ulong)b * vertices + v;
    const REAL seen = (sum[b] + clrad_lanes_sum(far_sum[b])) / all;
    const REAL gain = fade * column[(ulong)(b % colours) * vertices + v] * shot[b * patches + patch] * (seen / average - 1);
    near[i] += gain;
    gains[i] = gain;
  }
  atomic_xchg(touched + v / block, stamp);
}
