/* Sums over a work-group in local memory, for the tree shape. Any work-group size. */
#ifndef CLRAD_PRIMITIVES_GROUP
#define CLRAD_PRIMITIVES_GROUP

#define ONE_GROUP __attribute__((reqd_work_group_size(CLRAD_WORK_GROUP, 1, 1)))
/* Values that a work-group takes at a time, a row each. */
#define TILE ((ulong)CLRAD_WORK_GROUP * 16)

/* Inclusive sums over the work-group (Hillis & Steele 1986); any work-group size. */
static inline ulong group_scan_wide(ulong x, local ulong* scratch) {
  const uint l = get_local_id(0);
  scratch[l] = x;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint d = 1; d < CLRAD_WORK_GROUP; d <<= 1) {
    const ulong y = l >= d ? scratch[l - d] : 0ul;
    barrier(CLK_LOCAL_MEM_FENCE);
    x += y;
    scratch[l] = x;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  return x;
}

static inline uint group_scan(uint x, local uint* scratch) {
  const uint l = get_local_id(0);
  scratch[l] = x;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint d = 1; d < CLRAD_WORK_GROUP; d <<= 1) {
    const uint y = l >= d ? scratch[l - d] : 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    x += y;
    scratch[l] = x;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  return x;
}

#endif
