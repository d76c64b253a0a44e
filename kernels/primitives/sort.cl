/* Stable radix sort of (key, value) pairs, least significant digit first (Zagha & Blelloch 1991). A pass counts digits
 * per block, scans the counts digit by digit (scan.cl: counts[digit * blocks + block]), and moves every pair to its
 * place. */
#include "shared/group.cl"
#include "shared/rows.cl"

/* ---- blocks: 8 bits a pass, one work-item a block ------------------------------------------------------------------ */

kernel void sort_count_blocks(global const uint* keys, ulong n, ulong length, uint blocks, uint shift, uint mask,
                              global uint* counts) {
  const ulong block = get_global_id(0), begin = block * length;
  if (begin >= n) return;
  const ulong end = min(begin + length, n);
  uint count[256];
  for (uint d = 0; d < 256; ++d) count[d] = 0;
  for (ulong i = begin; i < end; ++i) ++count[(keys[i] >> shift) & mask];
  for (uint d = 0; d <= mask; ++d) counts[(ulong)d * blocks + block] = count[d];
}

/* Pairs go to 256 places at a time, far apart. They are collected 16 of a digit at a time and written as whole rows, so
 * that neither cache lines nor pages are fetched per pair (Satish et al. 2010, "Fast sort on CPUs and GPUs"). */
kernel void sort_move_blocks(global const uint* keys, global const uint* values, ulong n, ulong length, uint blocks,
                             uint shift, uint mask, global const uint* starts, global uint* keys_out,
                             global uint* values_out) {
  const ulong block = get_global_id(0), begin = block * length;
  if (begin >= n) return;
  const ulong end = min(begin + length, n);
  uint start[256], at[256];
  uint key_rows[256 * ROW], value_rows[256 * ROW];
  for (uint d = 0; d <= mask; ++d) start[d] = at[d] = starts[(ulong)d * blocks + block];
  for (ulong i = begin; i < end; ++i) {
    const uint key = keys[i], d = (key >> shift) & mask, to = at[d]++, lane = to % ROW;
    key_rows[d * ROW + lane] = key;
    value_rows[d * ROW + lane] = values[i];
    if (lane < ROW - 1) continue;
    const uint row = to - lane;
    if (row >= start[d]) {
      stream_row(vload16(d, key_rows), keys_out, row);
      stream_row(vload16(d, value_rows), values_out, row);
    } else {
      for (uint k = start[d] - row; k < ROW; ++k) {
        keys_out[row + k] = key_rows[d * ROW + k];
        values_out[row + k] = value_rows[d * ROW + k];
      }
    }
  }
  for (uint d = 0; d <= mask; ++d)
    for (uint to = max(start[d], at[d] - at[d] % ROW); to < at[d]; ++to) {
      keys_out[to] = key_rows[d * ROW + to % ROW];
      values_out[to] = value_rows[d * ROW + to % ROW];
    }
  streamed();
}

/* ---- trees: 4 bits a pass, one work-group a block of CLRAD_WORK_GROUP * RUN pairs, RUN consecutive ones a work-item -- */

#define RUN 16u
#define DIGITS 16u
#define COUNTERS (DIGITS * CLRAD_WORK_GROUP)

/* counter[digit * CLRAD_WORK_GROUP + l] = how many of work-item l's pairs have the digit. */
static inline void count_run(global const uint* keys, ulong begin, ulong end, uint shift, uint mask, local uint* counter) {
  const uint l = get_local_id(0);
  for (uint d = 0; d < DIGITS; ++d) counter[d * CLRAD_WORK_GROUP + l] = 0;
  for (ulong i = begin; i < end; ++i) ++counter[((keys[i] >> shift) & mask) * CLRAD_WORK_GROUP + l];
  barrier(CLK_LOCAL_MEM_FENCE);
}

kernel ONE_GROUP void sort_count_trees(global const uint* keys, ulong n, ulong length, uint blocks, uint shift,
                                       uint mask, global uint* counts) {
  local uint counter[COUNTERS];
  const ulong begin = get_group_id(0) * length + get_local_id(0) * RUN, end = min(begin + RUN, n);
  count_run(keys, begin, end, shift, mask, counter);
  for (uint d = get_local_id(0); d <= mask; d += CLRAD_WORK_GROUP) {
    uint sum = 0;
    for (uint k = 0; k < CLRAD_WORK_GROUP; ++k) sum += counter[d * CLRAD_WORK_GROUP + k];
    counts[(ulong)d * blocks + get_group_id(0)] = sum;
  }
}

kernel ONE_GROUP void sort_move_trees(global const uint* keys, global const uint* values, ulong n, ulong length,
                                      uint blocks, uint shift, uint mask, global const uint* starts,
                                      global uint* keys_out, global uint* values_out) {
  local uint counter[COUNTERS];
  const uint l = get_local_id(0);
  const ulong begin = get_group_id(0) * length + l * RUN, end = min(begin + RUN, n);
  count_run(keys, begin, end, shift, mask, counter);
  /* Where each work-item's pairs of a digit start. */
  for (uint d = l; d <= mask; d += CLRAD_WORK_GROUP) {
    uint at = starts[(ulong)d * blocks + get_group_id(0)];
    for (uint k = 0; k < CLRAD_WORK_GROUP; ++k) {
      const uint count = counter[d * CLRAD_WORK_GROUP + k];
      counter[d * CLRAD_WORK_GROUP + k] = at;
      at += count;
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  for (ulong i = begin; i < end; ++i) {
    const uint key = keys[i], to = counter[((key >> shift) & mask) * CLRAD_WORK_GROUP + l]++;
    keys_out[to] = key;
    values_out[to] = values[i];
  }
}
