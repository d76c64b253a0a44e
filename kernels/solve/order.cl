/* Where receivers come when neighbours in space are to be neighbours in the list: by the Morton code of their place in the frame, 1024
 * cells a side. Of one cell they keep their order, which is that of the mesh. */
#include "shared/spread.cl"

static inline uint cell_of(REAL x) { return (uint)clamp((x + (REAL)1) * (REAL)512, (REAL)0, (REAL)1023); }

/* keys[i] < 2^30 and values[i] = i, for a sort by key. */
__kernel void order_keys(__global const CLRAD_POINT_T* receivers, uint count, __global uint* keys, __global uint* values) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const CLRAD_POINT_T* p = receivers + i;
  keys[i] = spread_bits(cell_of(p->x)) | spread_bits(cell_of(p->y)) << 1 | spread_bits(cell_of(p->z)) << 2;
  values[i] = i;
}
