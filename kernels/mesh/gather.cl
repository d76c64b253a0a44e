/* Vertex values up to elements and patches: "an area weighted average over all the elements is calculated to yield the
 * total radiosity for the subdivided patch" (section 1.4 of Drucker & Schroeder, Fig. 1.3).
 *
 * gather_elements  one work-item an element, whose corners' values begin at `from`: the area average of the interpolant over it, sum of weight x corner
 * gather_patches   one work-item a patch: the area-weighted sum over its segment of the element array
 *
 * vertex[4 e + k] is CLRAD_NONE past the corners of element e; share[e] = its area / its patch's area, so the shares of
 * one patch sum to 1. The order of the sum is fixed: element order, compensated. */
#include "shared/sum.cl"

__kernel void gather_elements(__global const REAL* values, ulong from, __global const uint* vertex, __global const REAL* weight,
                              __global REAL* element_values, uint elements) {
  const uint e = get_global_id(0);
  if (e >= elements) return;
  REAL sum = 0;
  for (int k = 0; k < 4; ++k) {
    const uint v = vertex[4 * e + k];
    if (v != CLRAD_NONE) sum += weight[4 * e + k] * values[from + v];
  }
  element_values[e] = sum;
}

__kernel void gather_patches(__global const REAL* element_values, __global const REAL* share,
                             __global const uint* first_element, __global REAL* patch_values, ulong at, uint patches) {
  const uint p = get_global_id(0);
  if (p >= patches) return;
  REAL sum = 0, lost = 0;
  for (uint e = first_element[p]; e < first_element[p + 1]; ++e) clrad_add(&sum, &lost, share[e] * element_values[e]);
  patch_values[at + p] = sum;
}
