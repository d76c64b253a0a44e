/* Reductions of float.
 *
 * The order of a sum, whatever the shape and the work-group size: a row of 16 values by pairs (neighbours, then
 * neighbours of these), the 64 rows of a block of 1024 from left to right, then the blocks from left to right. Missing
 * values count as -0, which leaves every sum as it is. */
#include "shared/group.cl"
#include "shared/rows.cl"

#define BLOCK 1024u
#define ROWS 64u

static inline float row_sum(float16 x) {
  const float8 a = x.even + ODDS(x);
  const float4 b = a.even + a.odd;
  const float2 c = b.even + b.odd;
  return c.even + c.odd;
}

/* in[i .. end) and `pad` from end on; reads below `limit` only. */
static inline float16 load_row_padded(global const float* in, ulong i, ulong end, ulong limit, float pad) {
  if (i + ROW <= end) return vload16(0, in + i);
  if (i + ROW <= limit) return LANES < (uint)(end - i) ? vload16(0, in + i) : (float16)pad;
  float x[16];
  for (uint k = 0; k < ROW; ++k) x[k] = i + k < end ? in[i + k] : pad;
  return vload16(0, x);
}

static inline float block_sum(global const float* in, ulong begin, ulong end, ulong limit) {
  float sum = -0.0f;
  for (ulong i = begin; i < end; i += ROW) sum += row_sum(load_row_padded(in, i, end, limit, -0.0f));
  return sum;
}

/* The same by a work-group: rows side by side, then one work-item adds them in order. All work-items get the sum. */
static inline float group_block_sum(global const float* in, ulong begin, ulong end, ulong limit, local float* rows) {
  const uint count = (uint)((end - begin + ROW - 1) / ROW);
  for (uint r = get_local_id(0); r < count; r += CLRAD_WORK_GROUP)
    rows[r] = row_sum(load_row_padded(in, begin + r * ROW, end, limit, -0.0f));
  barrier(CLK_LOCAL_MEM_FENCE);
  float sum = -0.0f;
  for (uint r = 0; r < count; ++r) sum += rows[r];
  barrier(CLK_LOCAL_MEM_FENCE);
  return sum;
}

kernel void reduce_sum_blocks(global const float* in, ulong n, global float* sums) {
  const ulong block = get_global_id(0), begin = block * BLOCK;
  if (begin >= n) return;
  sums[block] = block_sum(in, begin, min(begin + BLOCK, n), n);
}

kernel ONE_GROUP void reduce_sum_trees(global const float* in, ulong n, global float* sums) {
  local float rows[ROWS];
  const ulong begin = get_group_id(0) * (ulong)BLOCK;
  const float sum = group_block_sum(in, begin, min(begin + BLOCK, n), n, rows);
  if (get_local_id(0) == 0) sums[get_group_id(0)] = sum;
}

/* ---- extremes and where they are attained: ties to the lowest position, NaN never wins ---------------------------- */

static inline float smallest(float16 x) {
  const float8 high = UPPER(x), a = x.lo < high ? x.lo : high;
  const float4 b = a.lo < a.hi ? a.lo : a.hi;
  const float2 c = b.lo < b.hi ? b.lo : b.hi;
  return c.lo < c.hi ? c.lo : c.hi;
}
static inline uint lowest(uint16 x) {
  const uint8 high = UPPER(x), a = x.lo < high ? x.lo : high;
  const uint4 b = a.lo < a.hi ? a.lo : a.hi;
  const uint2 c = b.lo < b.hi ? b.lo : b.hi;
  return c.lo < c.hi ? c.lo : c.hi;
}

/* The lowest position in [begin, end) where sign * in is least; CLRAD_NONE when there is nothing but NaN. */
static inline uint range_min(global const float* in, ulong begin, ulong end, ulong limit, float sign) {
  float16 best = (float16)INFINITY;
  uint16 at = (uint16)CLRAD_NONE;
  for (ulong i = begin; i < end; i += ROW) {
    const float16 x = load_row_padded(in, i, end, limit, NAN) * sign;
    const int16 better = (x < best) | ((x == best) & (at == CLRAD_NONE));
    best = better ? x : best;
    at = better ? LANES + (uint)i : at;
  }
  return lowest(best == smallest(best) ? at : (uint16)CLRAD_NONE);
}

static inline void take_min(float value, uint index, float* best, uint* best_index) {
  if (value < *best || (value == *best && index < *best_index)) {
    *best = value;
    *best_index = index;
  }
}

/* sign = -1: argmax. One (value, index) pair per block. */
kernel void arg_blocks(global const float* in, ulong n, ulong length, float sign, global float* values,
                       global uint* indices) {
  const ulong block = get_global_id(0), begin = block * length;
  if (begin >= n) return;
  const uint index = range_min(in, begin, min(begin + length, n), n, sign);
  values[block] = index == CLRAD_NONE ? -INFINITY : in[index];
  indices[block] = index;
}

/* Leaves the work-group's best in [0] of both arrays. */
static inline void group_min(float best, uint index, local float* values, local uint* indices) {
  const uint l = get_local_id(0);
  values[l] = best;
  indices[l] = index;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint width = CLRAD_WORK_GROUP; width > 1;) {
    const uint half_width = (width + 1) / 2;
    if (l + half_width < width) {
      take_min(values[l + half_width], indices[l + half_width], &best, &index);
      values[l] = best;
      indices[l] = index;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    width = half_width;
  }
}

static inline void group_range_min(global const float* in, ulong begin, ulong end, float sign, local float* values,
                            local uint* indices) {
  float best = INFINITY;
  uint index = CLRAD_NONE;
  for (ulong i = begin + get_local_id(0); i < end; i += CLRAD_WORK_GROUP) take_min(in[i] * sign, (uint)i, &best, &index);
  group_min(best, index, values, indices);
}

kernel ONE_GROUP void arg_trees(global const float* in, ulong n, ulong length, float sign, global float* values,
                                global uint* indices) {
  local float v[CLRAD_WORK_GROUP];
  local uint p[CLRAD_WORK_GROUP];
  const ulong begin = get_group_id(0) * length;
  group_range_min(in, begin, min(begin + length, n), sign, v, p);
  if (get_local_id(0) == 0) {
    values[get_group_id(0)] = v[0] * sign;
    indices[get_group_id(0)] = p[0];
  }
}

/* ---- one result per segment [offsets[s], offsets[s + 1]) ----------------------------------------------------------- */

static inline float segment_sum(global const float* in, ulong begin, ulong end, ulong limit) {
  if (begin == end) return 0.0f;
  float sum = -0.0f;
  for (ulong b = begin; b < end; b += BLOCK) sum += block_sum(in, b, min(b + BLOCK, end), limit);
  return sum;
}

kernel void segment_sum_blocks(global const float* in, global const uint* offsets, uint segments, global float* out) {
  const size_t s = get_global_id(0);
  if (s >= segments) return;
  out[s] = segment_sum(in, offsets[s], offsets[s + 1], offsets[segments]);
}

kernel void segment_min_blocks(global const float* in, global const uint* offsets, uint segments, global float* out,
                               global uint* index) {
  const size_t s = get_global_id(0);
  if (s >= segments) return;
  const uint at = range_min(in, offsets[s], offsets[s + 1], offsets[segments], 1.0f);
  out[s] = at == CLRAD_NONE ? INFINITY : in[at];
  index[s] = at;
}

/* Trees: each work-item takes one short segment, then the work-group takes the long ones of its work-items together. */
#define LONG_SEGMENT 256u

kernel ONE_GROUP void segment_sum_trees(global const float* in, global const uint* offsets, uint segments,
                                        global float* out) {
  local float rows[ROWS];
  const size_t first = get_group_id(0) * (size_t)CLRAD_WORK_GROUP, s = first + get_local_id(0);
  const ulong limit = offsets[segments];
  if (s < segments && offsets[s + 1] - offsets[s] <= LONG_SEGMENT)
    out[s] = segment_sum(in, offsets[s], offsets[s + 1], limit);
  for (size_t t = first; t < min(first + CLRAD_WORK_GROUP, (size_t)segments); ++t) {
    const ulong begin = offsets[t], end = offsets[t + 1];
    if (end - begin <= LONG_SEGMENT) continue;
    float sum = -0.0f;
    for (ulong b = begin; b < end; b += BLOCK) sum += group_block_sum(in, b, min(b + BLOCK, end), limit, rows);
    if (get_local_id(0) == 0) out[t] = sum;
  }
}

kernel ONE_GROUP void segment_min_trees(global const float* in, global const uint* offsets, uint segments,
                                        global float* out, global uint* index) {
  local float v[CLRAD_WORK_GROUP];
  local uint p[CLRAD_WORK_GROUP];
  const size_t first = get_group_id(0) * (size_t)CLRAD_WORK_GROUP, s = first + get_local_id(0);
  if (s < segments && offsets[s + 1] - offsets[s] <= LONG_SEGMENT) {
    const uint at = range_min(in, offsets[s], offsets[s + 1], offsets[segments], 1.0f);
    out[s] = at == CLRAD_NONE ? INFINITY : in[at];
    index[s] = at;
  }
  for (size_t t = first; t < min(first + CLRAD_WORK_GROUP, (size_t)segments); ++t) {
    const ulong begin = offsets[t], end = offsets[t + 1];
    if (end - begin <= LONG_SEGMENT) continue;
    group_range_min(in, begin, end, 1.0f, v, p);
    if (get_local_id(0) == 0) {
      out[t] = v[0];
      index[t] = p[0];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}
