/* Rows of 16 values: the unit in which every primitive reads. On a CPU a row is one 512-bit register, on a GPU 16
 * registers of a work-item. Rows at the end of an array are padded, never read past it. */
#ifndef CLRAD_PRIMITIVES_ROWS
#define CLRAD_PRIMITIVES_ROWS
#include "shared/lanes.cl"

#define ROW 16u

/* Lanes that have a neighbour d lanes below. */
#define FROM1 ((int16)(0, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1))
#define FROM2 ((int16)(0, 0, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1))
#define FROM4 ((int16)(0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1))
#define FROM8 ((int16)(0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1))
#define LANES ((uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))

/* in[i .. i + 16), zeros from `end` on. */
static inline uint16 load_row(global const uint* in, ulong i, ulong end) {
  if (i + ROW <= end) return vload16(0, in + i);
  uint x[16];
  for (uint k = 0; k < ROW; ++k) x[k] = i + k < end ? in[i + k] : 0u;
  return vload16(0, x);
}

static inline void store_row(uint16 x, global uint* out, ulong i, ulong end) {
  if (i + ROW <= end) {
    vstore16(x, 0, out + i);
    return;
  }
  uint y[16];
  vstore16(x, 0, y);
  for (uint k = 0; k < ROW && i + k < end; ++k) out[i + k] = y[k];
}

/* Whether any lane of an int16 is set: one compare where the compiler has a reduction, 16 branches on PoCL otherwise. */
#define ANY(m) any(m)
#if defined(__has_builtin) && !defined(CLRAD_PLAIN)
#if __has_builtin(__builtin_reduce_or)
#undef ANY
#define ANY(m) (__builtin_reduce_or(m) != 0)
#endif
#endif

/* A whole row past the caches where the compiler can (outputs larger than the caches: no line is read before it is
 * written). Ends with streamed() before the kernel does. */
#ifdef __has_builtin
#if __has_builtin(__builtin_nontemporal_store)
#define CLRAD_STREAM
#endif
#endif
static inline void stream_row(uint16 x, global uint* out, ulong i) {
#ifdef CLRAD_STREAM
  if (((size_t)(out + i) & 63) == 0) {
    __builtin_nontemporal_store(x, (global uint16*)(out + i));
    return;
  }
#endif
  vstore16(x, 0, out + i);
}
static inline void streamed(void) { mem_fence(CLK_GLOBAL_MEM_FENCE); }

/* Inclusive sums within a row, modulo 2^32. */
static inline uint16 row_scan(uint16 x) {
  x += UP1(x) & as_uint16(FROM1);
  x += UP2(x) & as_uint16(FROM2);
  x += UP4(x) & as_uint16(FROM4);
  x += UP8(x) & as_uint16(FROM8);
  return x;
}

/* 1 where x is not 0. */
static inline uint16 ones(uint16 x) { return x != 0u ? (uint16)1u : (uint16)0u; }

/* Sum of a row without wrapping. */
static inline ulong row_sum_wide(ulong16 x) {
  const ulong8 a = x.lo + UPPER_WIDE(x);
  const ulong4 b = a.lo + a.hi;
  const ulong2 c = b.lo + b.hi;
  return c.lo + c.hi;
}

#endif
