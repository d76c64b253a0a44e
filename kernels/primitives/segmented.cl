/* Inclusive scans that start anew at every head (Schwartz 1980; Blelloch 1990, section 1.5), and float scans.
 *
 * One fixed order whatever the shape and the work-group size: within a row of 16 the scan of Hillis & Steele (1986),
 * the 64 rows of a block of 1024 from left to right, then block totals by the same scan again, one level up:
 *     result = combine(total of the blocks before, combine(rows before, row's own))
 * and each combination only as far as no head lies between. A level has two passes: `totals` gives each block's last
 * value and whether it holds a head; `scan` writes the block, given the inclusive scan of the totals.
 *
 * *_blocks: one work-item a block. *_trees: 64 work-items a block, one row each; the carry into each row is folded from
 * the rows before in local memory, in the same order. */
#include "shared/group.cl"
#include "shared/rows.cl"

#define BLOCK 1024u
#define ROWS 64u
/* Blocks side by side in a work-group, and work-items of each. */
#define TEAMS (CLRAD_WORK_GROUP < ROWS ? 1u : CLRAD_WORK_GROUP / ROWS)
#define TEAM (CLRAD_WORK_GROUP < ROWS ? CLRAD_WORK_GROUP : ROWS)

#define HEADS 1u     /* bit of `mode`: there are heads; else the whole array is one segment */
#define EXCLUSIVE 2u /* bit of `mode`, without HEADS only: out[i] leaves in[i] out; out[0] = 0 */

/* Operators, for scalars and rows alike; a comes before b. Unsigned sums stay at the largest value instead of wrapping
 * (saturating addition is associative, too). A NaN gives way to any number; of equals the first is kept. */
#define SUM_UINT(a, b) ((a) + min(b, ~(a)))
#define MIN_UINT(a, b) min(a, b)
#define MAX_UINT(a, b) max(a, b)
#define FIRST_UINT(a, b) (a)
#define SUM_FLOAT(a, b) ((a) + (b))
#define MIN_FLOAT(a, b) ((((b) < (a)) | ((a) != (a))) ? (b) : (a))
#define MAX_FLOAT(a, b) ((((b) > (a)) | ((a) != (a))) ? (b) : (a))

/* -1 where a head is. */
static inline int16 head_row(global const uint* heads, ulong i, ulong n, uint mode) {
  return mode & HEADS ? load_row(heads, i, n) != 0u : (int16)0;
}

static inline float16 load_row_float(global const float* in, ulong i, ulong n) {
  return as_float16(load_row((global const uint*)in, i, n));
}
static inline uint16 load_row_uint(global const uint* in, ulong i, ulong n) { return load_row(in, i, n); }
static inline void store_row_float(float16 x, global float* out, ulong i, ulong n) {
  store_row(as_uint16(x), (global uint*)out, i, n);
}
static inline void store_row_uint(uint16 x, global uint* out, ulong i, ulong n) { store_row(x, out, i, n); }

#define STEP(T, COMBINE, UP, FROM)                    \
  x = (f | ~FROM) ? x : COMBINE((T##16)UP(x), x);       \
  f |= UP(f);

/* Carries go as a pair (value, head seen); `any` says that rows came before. */
#define SEGMENTED_SCAN(NAME, T, COMBINE)                                                                              \
  /* x: scan of a row; returns where a head lies at or before a lane. */                                              \
  inline int16 NAME##_row(T##16 * value, int16 f) {                                                                   \
    T##16 x = *value;                                                                                                 \
    STEP(T, COMBINE, UP1, FROM1) STEP(T, COMBINE, UP2, FROM2) STEP(T, COMBINE, UP4, FROM4)                            \
    STEP(T, COMBINE, UP8, FROM8)                                                                                      \
    *value = x;                                                                                                       \
    return f;                                                                                                         \
  }                                                                                                                   \
                                                                                                                      \
  /* Row r of a block whose rows before give carry and seen; offset is what comes before the block. */                \
  inline T##16 NAME##_place(T##16 x, int16 f, uint r, T carry, int seen, ulong block, T offset, uint mode) {          \
    T##16 y = r == 0 ? x : (f ? x : COMBINE((T##16)carry, x));                                                        \
    if (mode & EXCLUSIVE) y = (T##16)(carry, y.s0, y.s12, y.s3456, y.s789a, y.sbcde);                                 \
    if (block == 0) {                                                                                                 \
      if ((mode & EXCLUSIVE) && r == 0) y.s0 = 0;                                                                     \
      return y;                                                                                                       \
    }                                                                                                                 \
    const T##16 z = (f | (int16)(seen ? -1 : 0)) ? y : COMBINE((T##16)offset, y);                                     \
    y = z;                                                                                                            \
    if ((mode & EXCLUSIVE) && r == 0) y.s0 = offset;                                                                  \
    return y;                                                                                                         \
  }                                                                                                                   \
                                                                                                                      \
  kernel void NAME##_totals_blocks(global const T* in, global const uint* heads, ulong n, uint mode,                  \
                                   global T* totals, global uint* seen_out) {                                         \
    const ulong block = get_global_id(0), begin = block * BLOCK;                                                      \
    if (begin >= n) return;                                                                                           \
    T carry = 0;                                                                                                      \
    int seen = 0;                                                                                                     \
    for (uint r = 0; r < ROWS && begin + r * ROW < n; ++r) {                                                          \
      T##16 x = load_row_##T(in, begin + r * ROW, n);                                                                 \
      const int16 f = NAME##_row(&x, head_row(heads, begin + r * ROW, n, mode));                                      \
      carry = r == 0 || f.sf ? x.sf : COMBINE(carry, x.sf);                                                           \
      seen |= f.sf;                                                                                                   \
    }                                                                                                                 \
    totals[block] = carry;                                                                                            \
    seen_out[block] = seen ? 1u : 0u;                                                                                 \
  }                                                                                                                   \
                                                                                                                      \
  kernel void NAME##_scan_blocks(global const T* in, global const uint* heads, ulong n, uint mode,                    \
                                 global const T* offsets, global T* out) {                                            \
    const ulong block = get_global_id(0), begin = block * BLOCK;                                                      \
    if (begin >= n) return;                                                                                           \
    const T offset = block == 0 ? 0 : offsets[block - 1];                                                             \
    T carry = 0;                                                                                                      \
    int seen = 0;                                                                                                     \
    for (uint r = 0; r < ROWS && begin + r * ROW < n; ++r) {                                                          \
      T##16 x = load_row_##T(in, begin + r * ROW, n);                                                                 \
      const int16 f = NAME##_row(&x, head_row(heads, begin + r * ROW, n, mode));                                      \
      store_row_##T(NAME##_place(x, f, r, carry, seen, block, offset, mode), out, begin + r * ROW, n);                \
      carry = r == 0 || f.sf ? x.sf : COMBINE(carry, x.sf);                                                           \
      seen |= f.sf;                                                                                                   \
    }                                                                                                                 \
  }                                                                                                                   \
                                                                                                                      \
  /* Last value and head of each row of this team's block, in local memory. */                                        \
  inline void NAME##_rows(global const T* in, global const uint* heads, ulong n, uint mode, ulong begin, uint member, \
                          local T* last, local int* head) {                                                           \
    for (uint r = member; r < ROWS && begin + r * ROW < n; r += TEAM) {                                               \
      T##16 x = load_row_##T(in, begin + r * ROW, n);                                                                 \
      const int16 f = NAME##_row(&x, head_row(heads, begin + r * ROW, n, mode));                                      \
      last[r] = x.sf;                                                                                                 \
      head[r] = f.sf;                                                                                                 \
    }                                                                                                                 \
    barrier(CLK_LOCAL_MEM_FENCE);                                                                                     \
  }                                                                                                                   \
                                                                                                                      \
  inline T NAME##_fold(local const T* last, local const int* head, uint rows, int* seen_out) {                        \
    T carry = 0;                                                                                                      \
    int seen = 0;                                                                                                     \
    for (uint k = 0; k < rows; ++k) {                                                                                 \
      carry = k == 0 || head[k] ? last[k] : COMBINE(carry, last[k]);                                                  \
      seen |= head[k];                                                                                                \
    }                                                                                                                 \
    *seen_out = seen;                                                                                                 \
    return carry;                                                                                                     \
  }                                                                                                                   \
                                                                                                                      \
  kernel ONE_GROUP void NAME##_totals_trees(global const T* in, global const uint* heads, ulong n, uint mode,         \
                                            global T* totals, global uint* seen_out) {                                \
    local T last[TEAMS * ROWS];                                                                                       \
    local int head[TEAMS * ROWS];                                                                                     \
    const uint team = get_local_id(0) / TEAM, member = get_local_id(0) % TEAM, at = min(team, TEAMS - 1) * ROWS;      \
    const ulong block = get_group_id(0) * (ulong)TEAMS + team, begin = team < TEAMS ? block * BLOCK : n;              \
    NAME##_rows(in, heads, n, mode, begin, member, last + at, head + at);                                             \
    if (member > 0 || begin >= n) return;                                                                             \
    int seen;                                                                                                         \
    totals[block] = NAME##_fold(last + at, head + at, (uint)min((ulong)ROWS, (n - begin + ROW - 1) / ROW), &seen);    \
    seen_out[block] = seen ? 1u : 0u;                                                                                 \
  }                                                                                                                   \
                                                                                                                      \
  kernel ONE_GROUP void NAME##_scan_trees(global const T* in, global const uint* heads, ulong n, uint mode,           \
                                          global const T* offsets, global T* out) {                                   \
    local T last[TEAMS * ROWS];                                                                                       \
    local int head[TEAMS * ROWS];                                                                                     \
    const uint team = get_local_id(0) / TEAM, member = get_local_id(0) % TEAM, at = min(team, TEAMS - 1) * ROWS;      \
    const ulong block = get_group_id(0) * (ulong)TEAMS + team, begin = team < TEAMS ? block * BLOCK : n;              \
    NAME##_rows(in, heads, n, mode, begin, member, last + at, head + at);                                             \
    if (begin >= n) return;                                                                                           \
    const T offset = block == 0 ? 0 : offsets[block - 1];                                                             \
    for (uint r = member; r < ROWS && begin + r * ROW < n; r += TEAM) {                                               \
      T##16 x = load_row_##T(in, begin + r * ROW, n);                                                                 \
      const int16 f = NAME##_row(&x, head_row(heads, begin + r * ROW, n, mode));                                      \
      int seen;                                                                                                       \
      const T carry = NAME##_fold(last + at, head + at, r, &seen);                                                    \
      store_row_##T(NAME##_place(x, f, r, carry, seen, block, offset, mode), out, begin + r * ROW, n);                \
    }                                                                                                                 \
  }

SEGMENTED_SCAN(sum_uint, uint, SUM_UINT)
SEGMENTED_SCAN(min_uint, uint, MIN_UINT)
SEGMENTED_SCAN(max_uint, uint, MAX_UINT)
SEGMENTED_SCAN(first_uint, uint, FIRST_UINT)
SEGMENTED_SCAN(sum_float, float, SUM_FLOAT)
SEGMENTED_SCAN(min_float, float, MIN_FLOAT)
SEGMENTED_SCAN(max_float, float, MAX_FLOAT)
