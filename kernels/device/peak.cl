/* What the device's float arithmetic allows where nothing else holds it up: independent products and sums in registers, in packets,
 * not fused, as in all kernels here. For benchmarks that say what share of it an algorithm reaches. */
#include "shared/packet.cl"

#define CHAINS 12 /* in flight at a time: latency times issue width, and no more than there are registers */

/* `rounds` times CHAINS products and as many sums of CLRAD_WIDTH floats a work-item. The result is stored so that they are done. */
__kernel void peak(uint items, uint rounds, float a, float b, __global float* sums) {
  const uint i = get_global_id(0);
  if (i >= items) return;
  clrad_floats x[CHAINS];
  for (uint k = 0; k < CHAINS; ++k) x[k] = (float)(i + k);
  for (uint r = 0; r < rounds; ++r)
    for (uint k = 0; k < CHAINS; ++k) x[k] = x[k] * a + b;
  clrad_floats sum = 0.0f;
  for (uint k = 0; k < CHAINS; ++k) sum += x[k];
  sums[i] = least_lane(sum);
}
