/* The linear system of all patches in its balance form, section 3 of the design:
 *
 *   loss_i B_i + coupling_i sum_j F_ij (B_i - B_j) = E_i
 *
 * with F_ij the kept columns (means over the whole of patch i, whose share x_i is exposed) and s_i = sum_j F_ij their row
 * sums. It is B_i = E_i + rho_i / x_i sum_j F_ij B_j rearranged, with
 *   loss_i = 1 - rho_i + rho_i (x_i - s_i) / x_i,  coupling_i = rho_i / x_i
 * where rows are taken as they are, and
 *   loss_i = 1 - rho_i,                            coupling_i = rho_i / s_i
 * where they are closed: then only differences of radiosity are multiplied by form factors, and what rounding, sampling
 * and the mesh do to a row sum cannot be amplified by 1 / (1 - rho).
 *
 * Radiosities are pairs: at rho = 0.9999 a float of B = 10^4 E would leave 10^-3 E unaccounted for. Sums run over slots in
 * order, one work-item a (patch, band). Columns are [slot][colour][patch] as in deliver.cl, row sums [colour][patch]. */
#include "shared/math.cl"
#include "shared/sum.cl"

clrad_pair radiosity_of(__global const REAL* total, __global const REAL* total_lo, uint i) {
  clrad_pair t;
  t.hi = total[i];
  t.lo = total_lo[i];
  return t;
}

/* Row sums of the columns as pairs: sums[i] + sums[patches * colours + i], i = (colour, patch). */
__kernel void row_sums(__global const REAL* columns, uint colours, uint slots, __global REAL* sums, uint patches) {
  const uint i = get_global_id(0);
  if (i >= patches * colours) return;
  clrad_pair sum = clrad_two_sum(0, 0);
  for (uint s = 0; s < slots; ++s) {
    const clrad_pair grown = clrad_two_sum(sum.hi, columns[(ulong)s * colours * patches + i]);
    sum.hi = grown.hi;
    sum.lo += grown.lo;
  }
  sums[i] = sum.hi;
  sums[patches * colours + i] = sum.lo;
}

/* The same sums by reciprocity, A_i F_ij = A_j F_ji: sums[s * colours + c] = sum over the patches j that have columns of
 * A_j / A_i F_ji, i the patch of slot s. */
__kernel void reciprocal_sums(__global const REAL* columns, uint colours, __global const uint* patch_of_slot,
                              __global const uint* slot_of, uint slots, __global const REAL* area,
                              __global REAL* sums, uint patches) {
  const uint i = get_global_id(0);
  if (i >= slots * colours) return;
  REAL sum = 0, lost = 0;
  for (uint j = 0; j < patches; ++j)
    if (slot_of[j] != CLRAD_NONE) clrad_add(&sum, &lost, area[j] * columns[(ulong)i * patches + j]);
  sums[i] = sum / area[patch_of_slot[i / colours]];
}

/* What the balance of patch p lacks of E; *arrived: sum F B. The arrays are those of its band, columns from its colour on, the
 * balance that of its row. */
clrad_pair lacking(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, uint slots,
                   __global const REAL* total, __global const REAL* total_lo, REAL emitted, REAL loss, REAL coupling,
                   uint p, uint patches, REAL* arrived) {
  const clrad_pair own = radiosity_of(total, total_lo, p);
  clrad_pair net = clrad_two_sum(0, 0);
  REAL sum = 0, lost = 0;
  for (uint s = 0; s < slots; ++s) {
    const REAL f = columns[(ulong)s * colours * patches + p];
    if (f == 0) continue;
    const clrad_pair other = radiosity_of(total, total_lo, patch_of_slot[s]);
    net = clrad_pair_add(net, clrad_pair_times(clrad_pair_sub(own, other), f));
    clrad_add(&sum, &lost, f * other.hi);
  }
  *arrived = sum;
  const clrad_pair kept = clrad_pair_add(clrad_pair_times(own, loss), clrad_pair_times(net, coupling));
  return clrad_pair_sub(clrad_two_sum(0, emitted), kept);
}

/* What the radiosities that were shot in all mean: irradiance = scale sum F B, and unshot = what the balance still lacks. It
 * may be negative where columns, reflectances or the closing of rows have changed under what was shot: a correction that is shot
 * like any other. */
__kernel void balance(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, uint slots,
                      __global const REAL* total, __global const REAL* total_lo, __global const REAL* emitted,
                      __global const REAL* loss, __global const REAL* coupling, __global const REAL* scale,
                      __global REAL* irradiance, __global REAL* irradiance_lost, __global REAL* unshot,
                      __global REAL* unshot_lost, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint p = i % patches, first = i - p;
  REAL arrived;
  const clrad_pair lacks = lacking(columns + i / patches % colours * patches, colours, patch_of_slot, slots, total + first, total_lo + first, emitted[i],
                                   loss[i], coupling[i], p, patches, &arrived);
  irradiance[i] = scale[p] * arrived;
  irradiance_lost[i] = 0;
  unshot[i] = lacks.hi;
  unshot_lost[i] = -lacks.lo;
}

/* One row of a Gauss-Seidel sweep: patch p gets the radiosity that balances what all others have now (its own has the
 * coefficient loss + coupling s = 1). A patch without a column emits and reflects nothing. One work-item a band. */
__kernel void gather_row(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, uint slots,
                         __global const REAL* emitted, __global const REAL* loss, __global const REAL* coupling,
                         __global REAL* total, __global REAL* total_lo, __global REAL* pending, uint p, uint patches,
                         uint bands) {
  const uint b = get_global_id(0);
  if (b >= bands) return;
  const uint first = b * patches, i = first + p;
  REAL arrived;
  const clrad_pair change = lacking(columns + b % colours * patches, colours, patch_of_slot, slots, total + first, total_lo + first, emitted[i],
                                    loss[i], coupling[i], p, patches, &arrived);
  const clrad_pair t = clrad_pair_add(radiosity_of(total, total_lo, i), change);
  total[i] = t.hi;
  total_lo[i] = t.lo;
  pending[i] += change.hi;
}

/* spread[i] = coupling_i sum_j F_ij |B_i - B_j|: what errors of single factors act on in closed rows. */
__kernel void spread(__global const REAL* columns, uint colours, __global const uint* patch_of_slot, uint slots,
                     __global const REAL* total, __global const REAL* total_lo, __global const REAL* coupling,
                     __global REAL* result, uint patches, uint bands) {
  const uint i = get_global_id(0);
  if (i >= patches * bands) return;
  const uint p = i % patches, first = i - p, colour = i / patches % colours;
  const clrad_pair own = radiosity_of(total, total_lo, i);
  REAL sum = 0, lost = 0;
  for (uint s = 0; s < slots; ++s) {
    const clrad_pair other = radiosity_of(total, total_lo, first + patch_of_slot[s]);
    clrad_add(&sum, &lost, columns[((ulong)s * colours + colour) * patches + p] * fabs(clrad_pair_sub(own, other).hi));
  }
  result[i] = coupling[i] * sum;
}

/* Shoots a correction of every patch's radiosity; vertices get it later (pending). */
__kernel void correct(__global const REAL* correction, __global REAL* total, __global REAL* total_lo,
                      __global REAL* pending, uint count) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const clrad_pair t = clrad_pair_add(radiosity_of(total, total_lo, i), clrad_two_sum(0, correction[i]));
  total[i] = t.hi;
  total_lo[i] = t.lo;
  pending[i] += correction[i];
}

/* Irradiance of a vertex in a closed scene, in which a row of factors sums to 1: H / s, s its row sum. What a row lacks or
 * has too much is spread over all that the vertex sees in proportion, F / s, and not taken from the patch around it,
 * whose radiosity may be quite another than what it faces (a lamp). Where all has one radiosity this is exact; rows of less than
 * a quarter are of vertices that mostly face what is no part of the enclosure, and stay. */
#define CLRAD_LEAST_ROW CLRAD_R(0.25)
__kernel void close_vertices(__global REAL* irradiance, __global const REAL* row_sum, __global const uint* covered,
                             uint vertices, uint bands) {
  const uint v = get_global_id(0);
  if (v >= vertices || covered[v] || !(row_sum[v] > CLRAD_LEAST_ROW)) return;
  for (uint b = 0; b < bands; ++b) irradiance[(ulong)b * vertices + v] /= row_sum[v];
}
