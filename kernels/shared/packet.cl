/* Packets: CLRAD_WIDTH lanes in one explicit vector, or a plain scalar when the width is 1. Masks are -1 or 0 a lane. */
#ifndef CLRAD_PACKET_CL
#define CLRAD_PACKET_CL

#if CLRAD_WIDTH == 1
#define CLRAD_BITS(v) as_int(v)
typedef float clrad_floats;
typedef int clrad_ints;
#define CLRAD_IS(condition) (-(condition)) /* a scalar comparison gives 1, a vector one -1 */
#define CLRAD_LOAD(p) (*(p))
#define CLRAD_STORE(v, p) (*(p) = (v))
#define CLRAD_LANE_BITS(first) (1 << (first))
#define CLRAD_LANES 0
#define CLRAD_TO_INTS(v) convert_int(v)
#define CLRAD_TO_FLOATS(v) convert_float(v)
#else
#define CLRAD_PASTE_2(a, b) a##b
#define CLRAD_PASTE(a, b) CLRAD_PASTE_2(a, b)
typedef CLRAD_PASTE(float, CLRAD_WIDTH) clrad_floats;
typedef CLRAD_PASTE(int, CLRAD_WIDTH) clrad_ints;
#define CLRAD_IS(condition) (condition)
#define CLRAD_BITS(v) CLRAD_PASTE(as_int, CLRAD_WIDTH)(v)
#define CLRAD_LOAD(p) CLRAD_PASTE(vload, CLRAD_WIDTH)(0, p)
#define CLRAD_STORE(v, p) CLRAD_PASTE(vstore, CLRAD_WIDTH)(v, 0, p)
#define CLRAD_TO_INTS(v) CLRAD_PASTE(convert_int, CLRAD_WIDTH)(v)
#define CLRAD_TO_FLOATS(v) CLRAD_PASTE(convert_float, CLRAD_WIDTH)(v)
#if CLRAD_WIDTH == 4
#define CLRAD_LANE_BITS(first) ((clrad_ints)(1, 2, 4, 8) << (first))
#define CLRAD_LANES ((clrad_ints)(0, 1, 2, 3))
#elif CLRAD_WIDTH == 8
#define CLRAD_LANE_BITS(first) ((clrad_ints)(1, 2, 4, 8, 16, 32, 64, 128) << (first))
#define CLRAD_LANES ((clrad_ints)(0, 1, 2, 3, 4, 5, 6, 7))
#else
#define CLRAD_LANE_BITS(first)                                                                                     \
  ((clrad_ints)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768) << (first))
#define CLRAD_LANES ((clrad_ints)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif
#endif

/* The bits set in any lane. any() would become a test and a branch for every pair of lanes on some devices. */
static inline int clrad_bits_of_any(clrad_ints m) {
#if CLRAD_WIDTH == 1
  return m;
#else
#if defined(__has_builtin)
#if __has_builtin(__builtin_reduce_or)
#define CLRAD_REDUCE_OR 1
#endif
#endif
#ifdef CLRAD_REDUCE_OR
  return __builtin_reduce_or(m);
#else
#if CLRAD_WIDTH == 16
  int8 m8 = m.lo | m.hi;
  int4 m4 = m8.lo | m8.hi;
#elif CLRAD_WIDTH == 8
  int4 m4 = m.lo | m.hi;
#else
  int4 m4 = m;
#endif
  int2 m2 = m4.lo | m4.hi;
  return m2.x | m2.y;
#endif
#endif
}

/* The least and the greatest lane. */
#define CLRAD_HALVES(name, op)                                              \
  static inline int name##_8(int8 v) {                                      \
    int4 h = v.lo op v.hi ? v.lo : v.hi;                                    \
    int2 q = h.lo op h.hi ? h.lo : h.hi;                                    \
    return q.x op q.y ? q.x : q.y;                                          \
  }
CLRAD_HALVES(clrad_least, <)
CLRAD_HALVES(clrad_most, >)
static inline int clrad_least(clrad_ints v) {
#if CLRAD_WIDTH == 1
  return v;
#elif CLRAD_WIDTH == 4
  return clrad_least_8((int8)(v, v));
#elif CLRAD_WIDTH == 8
  return clrad_least_8(v);
#else
  return clrad_least_8(v.lo < v.hi ? v.lo : v.hi);
#endif
}
static inline int clrad_most(clrad_ints v) {
#if CLRAD_WIDTH == 1
  return v;
#elif CLRAD_WIDTH == 4
  return clrad_most_8((int8)(v, v));
#elif CLRAD_WIDTH == 8
  return clrad_most_8(v);
#else
  return clrad_most_8(v.lo > v.hi ? v.lo : v.hi);
#endif
}

/* The same of floats. */
static inline float least_lane(clrad_floats v) {
#if CLRAD_WIDTH == 1
  return v;
#else
#if CLRAD_WIDTH == 16
  const float8 h = v.lo < v.hi ? v.lo : v.hi;
  const float4 f = h.lo < h.hi ? h.lo : h.hi;
#elif CLRAD_WIDTH == 8
  const float4 f = v.lo < v.hi ? v.lo : v.hi;
#else
  const float4 f = v;
#endif
  const float2 t = f.lo < f.hi ? f.lo : f.hi;
  return t.x < t.y ? t.x : t.y;
#endif
}
static inline float greatest_lane(clrad_floats v) {
  return -least_lane(-v);
}

#endif
