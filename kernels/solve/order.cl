/* Where receivers come when neighbours in space are to be neighbours in the list: by the Morton code of their place in the frame, 1024
 * cells a side. Of one cell they keep their order, which is that of the mesh. */

static inline uint spread_bits(uint x) {
  x = (x | x << 16) & 0x030000ffu;
  x = (x | x << 8) & 0x0300f00fu;
  x = (x | x << 4) & 0x030c30c3u;
  return (x | x << 2) & 0x09249249u;
}

static inline uint cell_of(REAL x) { return (uint)clamp((x + (REAL)1) * (REAL)512, (REAL)0, (REAL)1023); }

/* keys[i] < 2^30 and values[i] of receiver first + i, for a sort by key. */
__kernel void order_keys(__global const CLRAD_POINT_T* receivers, uint first, uint count, __global uint* keys,
                         __global uint* values) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const CLRAD_POINT_T* p = receivers + first + i;
  keys[i] = spread_bits(cell_of(p->x)) | spread_bits(cell_of(p->y)) << 1 | spread_bits(cell_of(p->z)) << 2;
  values[i] = first + i;
}
