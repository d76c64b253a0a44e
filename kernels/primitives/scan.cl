/* Prefix sums of uint in three passes (Blelloch 1990, section 1.5): block sums, scan of the block sums, scan of each
 * block from its offset. Sums of blocks are 64 bits wide, so that the host sees a total past 32 bits.
 *
 * Two shapes share the passes. *_blocks: one work-item a block of `length` values, rows of 16 in registers (CPUs).
 * *_trees: one work-group a block, one row a work-item, row sums scanned in local memory (GPUs). Addition of uint is
 * associative, so both give the same bits.
 *
 * BITS of `mode`: */
#include "shared/group.cl"
#include "shared/rows.cl"

#define INCLUSIVE 1u /* out[i] includes in[i] */
#define FLAGS 2u     /* values count as 1 where not 0 */
#define APPEND 4u    /* out[n] receives the total */

static inline uint16 values(uint16 x, uint mode) { return mode & FLAGS ? ones(x) : x; }

/* ---- blocks ------------------------------------------------------------------------------------------------------ */

static inline ulong block_sum(global const uint* in, ulong begin, ulong end, uint mode) {
  ulong16 sum = 0;
  ulong i = begin;
  for (; i + ROW <= end; i += ROW) sum += convert_ulong16(values(vload16(0, in + i), mode));
  if (i < end) sum += convert_ulong16(values(load_row(in, i, end), mode));
  return row_sum_wide(sum);
}

static inline void block_scan(global const uint* in, global uint* out, ulong begin, ulong end, uint carry, uint mode) {
  const uint16 keep = mode & INCLUSIVE ? (uint16)0u : (uint16)0xffffffffu;
  ulong i = begin;
  for (; i + ROW <= end; i += ROW) {
    const uint16 x = vload16(0, in + i);
    const uint16 s = row_scan(x) + carry;
    vstore16(s - (x & keep), 0, out + i);
    carry = s.sf;
  }
  if (i < end) {
    const uint16 x = load_row(in, i, end);
    store_row(row_scan(x) + carry - (x & keep), out, i, end);
  }
}

kernel void scan_sums_blocks(global const uint* in, ulong n, ulong length, uint first, uint mode,
                             global ulong* sums) {
  const ulong block = first + get_global_id(0), begin = block * length;
  if (begin >= n) return;
  sums[block + 1] = block_sum(in, begin, min(begin + length, n), mode);
}

/* sums[first] holds what comes before; sums[b + 1], the sum of block b, becomes the sum up to and with block b: what
 * comes before block b + 1, and in the end the total. One work-item. */
kernel void scan_top_blocks(global ulong* sums, uint first, uint last) {
  if (get_global_id(0) > 0) return;
  ulong carry = first == 0 ? 0ul : sums[first];
  sums[first] = carry;
  for (uint b = first; b < last; ++b) {
    carry += sums[b + 1];
    sums[b + 1] = carry;
  }
}

kernel void scan_blocks(global const uint* in, ulong n, ulong length, uint first, uint mode, global const ulong* sums,
                        global uint* out) {
  const ulong block = first + get_global_id(0), begin = block * length;
  if (begin >= n) return;
  block_scan(in, out, begin, min(begin + length, n), (uint)sums[block], mode);
  if ((mode & APPEND) && begin + length >= n) out[n] = (uint)sums[block + 1];
}

/* All of a short array in one launch of one work-item; sums[0] = total. */
kernel void scan_short_blocks(global const uint* in, ulong n, uint mode, global ulong* sums, global uint* out) {
  if (get_global_id(0) > 0) return;
  const ulong total = block_sum(in, 0, n, mode);
  block_scan(in, out, 0, n, 0u, mode);
  if (mode & APPEND) out[n] = (uint)total;
  sums[0] = total;
}

/* ---- trees ------------------------------------------------------------------------------------------------------- */

static inline ulong group_block_sum(global const uint* in, ulong begin, ulong end, uint mode, local ulong* scratch) {
  ulong16 sum = 0;
  for (ulong i = begin + get_local_id(0) * ROW; i < end; i += TILE) sum += convert_ulong16(values(load_row(in, i, end), mode));
  group_scan_wide(row_sum_wide(sum), scratch);
  return scratch[CLRAD_WORK_GROUP - 1];
}

static inline void group_block_scan(global const uint* in, global uint* out, ulong begin, ulong end, uint carry, uint mode,
                             local uint* scratch) {
  const uint16 keep = mode & INCLUSIVE ? (uint16)0u : (uint16)0xffffffffu;
  for (ulong tile = begin; tile < end; tile += TILE) {
    const ulong i = tile + get_local_id(0) * ROW;
    const uint16 x = i < end ? load_row(in, i, end) : (uint16)0u;
    const uint16 s = row_scan(x);
    const uint before = group_scan(s.sf, scratch) - s.sf + carry;
    if (i < end) store_row(s + before - (x & keep), out, i, end);
    carry += scratch[CLRAD_WORK_GROUP - 1];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

kernel ONE_GROUP void scan_sums_trees(
    global const uint* in, ulong n, ulong length, uint first, uint mode, global ulong* sums) {
  local ulong scratch[CLRAD_WORK_GROUP];
  const ulong block = first + get_group_id(0), begin = block * length;
  const ulong sum = group_block_sum(in, begin, min(begin + length, n), mode, scratch);
  if (get_local_id(0) == 0) sums[block + 1] = sum;
}

/* As scan_top_blocks, by one work-group. */
kernel ONE_GROUP void scan_top_trees(global ulong* sums, uint first, uint last) {
  local ulong scratch[CLRAD_WORK_GROUP];
  ulong carry = first == 0 ? 0ul : sums[first];
  for (uint tile = first; tile < last; tile += CLRAD_WORK_GROUP) {
    const uint b = tile + get_local_id(0);
    const ulong s = group_scan_wide(b < last ? sums[b + 1] : 0ul, scratch);
    if (b < last) sums[b + 1] = carry + s;
    carry += scratch[CLRAD_WORK_GROUP - 1];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  if (first == 0 && get_local_id(0) == 0) sums[0] = 0;
}

kernel ONE_GROUP void scan_trees(
    global const uint* in, ulong n, ulong length, uint first, uint mode, global const ulong* sums, global uint* out) {
  local uint scratch[CLRAD_WORK_GROUP];
  const ulong block = first + get_group_id(0), begin = block * length;
  group_block_scan(in, out, begin, min(begin + length, n), (uint)sums[block], mode, scratch);
  if ((mode & APPEND) && begin + length >= n && get_local_id(0) == 0) out[n] = (uint)sums[block + 1];
}

/* All of a short array in one work-group; sums[0] = total. */
kernel ONE_GROUP void scan_short_trees(
    global const uint* in, ulong n, uint mode, global ulong* sums, global uint* out) {
  local ulong wide[CLRAD_WORK_GROUP];
  local uint scratch[CLRAD_WORK_GROUP];
  const ulong total = group_block_sum(in, 0, n, mode, wide);
  group_block_scan(in, out, 0, n, 0u, mode, scratch);
  if (get_local_id(0) == 0) {
    sums[0] = total;
    if (mode & APPEND) out[n] = (uint)total;
  }
}
