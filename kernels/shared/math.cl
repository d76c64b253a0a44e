/* Arithmetic shared by kernels: an arc tangent of two arguments, pairs of reals (twice the digits), small vectors.
 * Everything is made of + - * / and sqrt, which are correctly rounded everywhere, so that every device and every
 * width gives the same bits. The text also compiles as C++ (tests/shared/kernel_math.hpp), so that tests can look at
 * it closely. Underflow: callers scale their input to about 1, see clrad_power_of_two. */
#ifndef CLRAD_MATH_CL
#define CLRAD_MATH_CL

#ifdef CLRAD_FP64
#define CLRAD_R(x) x
#define CLRAD_EPSILON 1.1102230246251565e-16 /* half an ulp of 1: what one rounding may cost */
#define CLRAD_SPLIT 134217729.0              /* 2^27 + 1 */
#else
#define CLRAD_R(x) x##f
#define CLRAD_EPSILON 5.9604645e-8f
#define CLRAD_SPLIT 4097.0f /* 2^12 + 1 */
#endif
#define CLRAD_PI CLRAD_R(3.14159265358979324)

/* ---- arc tangent ---------------------------------------------------------------------------------------------------
 * Angle of (x, y) for y >= 0, in [0, pi]. With t = min / max and k the multiple of 1/4 nearest to t:
 * atan t = atan k + atan u, u = (t - k) / (1 + t k), |u| <= 1/8, and atan u by its own series, whose first term left
 * out is u * u^8 / 9 = 7e-9 u in float and u * u^18 / 19 = 3e-18 u in double. Constants are hi + lo, so that the
 * error stays below 2 ulp of the result. (0, 0) gives 0. */
REAL clrad_atan2(REAL y, REAL x) {
  const REAL ax = x < 0 ? -x : x;
  const int steep = y > ax;
  const REAL big = steep ? y : ax, small = steep ? ax : y;
  REAL k = 0, hi = 0, lo = 0;
#ifdef CLRAD_FP64
  if (small > 0.125 * big) { k = 0.25; hi = 0.24497866312686414; lo = 1.0698755618734451e-17; }
  if (small > 0.375 * big) { k = 0.5; hi = 0.4636476090008061; lo = 2.2698777452961687e-17; }
  if (small > 0.625 * big) { k = 0.75; hi = 0.6435011087932844; lo = 1.5834785051444286e-17; }
  if (small > 0.875 * big) { k = 1.0; hi = 0.7853981633974483; lo = 3.061616997868383e-17; }
#else
  if (small > 0.125f * big) { k = 0.25f; hi = 0.244978666f; lo = -3.17867777e-09f; }
  if (small > 0.375f * big) { k = 0.5f; hi = 0.463647604f; lo = 5.01215869e-09f; }
  if (small > 0.625f * big) { k = 0.75f; hi = 0.643501103f; lo = 5.86893734e-09f; }
  if (small > 0.875f * big) { k = 1.0f; hi = 0.785398185f; lo = -2.18556941e-08f; }
#endif
  const REAL below = big + k * small;
  const REAL u = below > 0 ? (small - k * big) / below : CLRAD_R(0.0);
  const REAL q = u * u;
#ifdef CLRAD_FP64
  const REAL tail = q * (-1.0 / 3 + q * (1.0 / 5 + q * (-1.0 / 7 + q * (1.0 / 9 + q * (-1.0 / 11 + q * (1.0 / 13 +
                    q * (-1.0 / 15 + q * (1.0 / 17))))))));
  const REAL half_hi = 1.5707963267948966, half_lo = 6.123233995736766e-17;
  const REAL pi_hi = 3.141592653589793, pi_lo = 1.2246467991473532e-16;
#else
  const REAL tail = q * (-1.0f / 3 + q * (1.0f / 5 + q * (-1.0f / 7)));
  const REAL half_hi = 1.57079637f, half_lo = -4.37113883e-08f;
  const REAL pi_hi = 3.14159274f, pi_lo = -8.74227766e-08f;
#endif
  lo = lo + u * tail + u; /* atan t = hi + lo; exact enough in k = 0, where hi = 0 */
  const REAL base_hi = steep ? half_hi : x < 0 ? pi_hi : CLRAD_R(0.0);
  const REAL base_lo = steep ? half_lo : x < 0 ? pi_lo : CLRAD_R(0.0);
  const int minus = steep != (x < 0); /* y > |x|: pi/2 -+ atan t; x < 0 alone: pi - atan t */
  return minus ? (base_hi - hi) + (base_lo - lo) : (base_hi + hi) + (base_lo + lo);
}

/* The power of two 2^e with 2^e <= |x| < 2^(e+1), for a normal finite x; 0 for 0 and subnormals. */
REAL clrad_power_of_two(REAL x) {
#ifdef CLRAD_FP64
  return as_double(as_ulong(x) & 0x7ff0000000000000UL);
#else
  return as_float(as_uint(x) & 0x7f800000u);
#endif
}

/* ---- vectors ------------------------------------------------------------------------------------------------------ */
typedef struct clrad_vector {
  REAL x, y, z;
} clrad_vector;

clrad_vector clrad_make(REAL x, REAL y, REAL z) {
  clrad_vector v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}
clrad_vector clrad_cross(clrad_vector a, clrad_vector b) {
  return clrad_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
REAL clrad_dot(clrad_vector a, clrad_vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
clrad_vector clrad_scaled(clrad_vector a, REAL s) { return clrad_make(a.x * s, a.y * s, a.z * s); }
clrad_vector clrad_minus(clrad_vector a, clrad_vector b) { return clrad_make(a.x - b.x, a.y - b.y, a.z - b.z); }
clrad_vector clrad_plus(clrad_vector a, clrad_vector b) { return clrad_make(a.x + b.x, a.y + b.y, a.z + b.z); }
REAL clrad_largest(clrad_vector a) {
  const REAL x = a.x < 0 ? -a.x : a.x, y = a.y < 0 ? -a.y : a.y, z = a.z < 0 ? -a.z : a.z;
  const REAL m = x > y ? x : y;
  return m > z ? m : z;
}

/* ---- pairs: hi + lo, |lo| <= ulp(hi) / 2 ---------------------------------------------------------------------------
 * Knuth's two-sum, Dekker's two-product (no fused multiply-add), as in Dekker, "A floating-point technique for
 * extending the available precision" (1971) and Hida, Li & Bailey (2001). Relative error of one operation: a few
 * times CLRAD_EPSILON squared. */
typedef struct clrad_pair {
  REAL hi, lo;
} clrad_pair;
typedef struct clrad_pair_vector {
  clrad_pair x, y, z;
} clrad_pair_vector;

clrad_pair clrad_fast_two_sum(REAL a, REAL b) { /* |a| >= |b| or a = 0 */
  clrad_pair r;
  r.hi = a + b;
  r.lo = b - (r.hi - a);
  return r;
}
clrad_pair clrad_two_sum(REAL a, REAL b) {
  clrad_pair r;
  r.hi = a + b;
  const REAL part = r.hi - a;
  r.lo = (a - (r.hi - part)) + (b - part);
  return r;
}
clrad_pair clrad_two_product(REAL a, REAL b) {
  clrad_pair r;
  r.hi = a * b;
  const REAL ta = CLRAD_SPLIT * a, tb = CLRAD_SPLIT * b;
  const REAL ah = ta - (ta - a), bh = tb - (tb - b);
  const REAL al = a - ah, bl = b - bh;
  r.lo = ((ah * bh - r.hi) + ah * bl + al * bh) + al * bl;
  return r;
}
clrad_pair clrad_pair_add(clrad_pair a, clrad_pair b) {
  clrad_pair s = clrad_two_sum(a.hi, b.hi);
  const clrad_pair t = clrad_two_sum(a.lo, b.lo);
  s = clrad_fast_two_sum(s.hi, s.lo + t.hi);
  return clrad_fast_two_sum(s.hi, s.lo + t.lo);
}
clrad_pair clrad_pair_negative(clrad_pair a) {
  a.hi = -a.hi;
  a.lo = -a.lo;
  return a;
}
clrad_pair clrad_pair_sub(clrad_pair a, clrad_pair b) { return clrad_pair_add(a, clrad_pair_negative(b)); }
clrad_pair clrad_pair_mul(clrad_pair a, clrad_pair b) {
  const clrad_pair p = clrad_two_product(a.hi, b.hi);
  return clrad_fast_two_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
clrad_pair clrad_pair_times(clrad_pair a, REAL b) {
  const clrad_pair p = clrad_two_product(a.hi, b);
  return clrad_fast_two_sum(p.hi, p.lo + a.lo * b);
}
clrad_pair clrad_pair_div(clrad_pair a, clrad_pair b) {
  const REAL q = a.hi / b.hi;
  const clrad_pair r = clrad_pair_sub(a, clrad_pair_times(b, q));
  return clrad_fast_two_sum(q, r.hi / b.hi);
}
clrad_pair clrad_pair_sqrt(clrad_pair a) { /* a > 0 */
  const REAL s = sqrt(a.hi);
  return clrad_fast_two_sum(s, clrad_pair_sub(a, clrad_two_product(s, s)).hi / (2 * s));
}
clrad_pair clrad_pair_scaled(clrad_pair a, REAL s) { /* s a power of two: exact */
  a.hi *= s;
  a.lo *= s;
  return a;
}

/* clrad_atan2 of pairs, in its way, y >= 0; with NaN any angle may come out. u - u^3 / 3 + u^5 / 5 is taken in pairs, the rest of the series,
 * at most u^7 / 7 with u = 1/8, in one REAL each. That is off by 3 roundings of 5e-7 of u, the first term left out by 2e-14 of u in float
 * and 4e-20 of u in double, and the operations by some 20 squares of a rounding: CLRAD_PAIR_ATAN2_ERROR of the result in all. */
#ifdef CLRAD_FP64
#define CLRAD_PAIR_ATAN2_ERROR (0x1p-11 * CLRAD_EPSILON)
#else
#define CLRAD_PAIR_ATAN2_ERROR (0x1p-18f * CLRAD_EPSILON)
#endif
clrad_pair clrad_pair_atan2(clrad_pair y, clrad_pair x) {
  const clrad_pair ax = x.hi < 0 ? clrad_pair_negative(x) : x;
  const int steep = y.hi > ax.hi;
  const clrad_pair big = steep ? y : ax, small = steep ? ax : y;
  REAL k = 0;
  clrad_pair at, base;
  at.hi = at.lo = base.hi = base.lo = 0;
#ifdef CLRAD_FP64
  if (small.hi > 0.125 * big.hi) { k = 0.25; at.hi = 0.24497866312686414; at.lo = 1.0698755618734451e-17; }
  if (small.hi > 0.375 * big.hi) { k = 0.5; at.hi = 0.4636476090008061; at.lo = 2.2698777452961687e-17; }
  if (small.hi > 0.625 * big.hi) { k = 0.75; at.hi = 0.6435011087932844; at.lo = 1.5834785051444286e-17; }
  if (small.hi > 0.875 * big.hi) { k = 1.0; at.hi = 0.7853981633974483; at.lo = 3.061616997868383e-17; }
#else
  if (small.hi > 0.125f * big.hi) { k = 0.25f; at.hi = 0.244978666f; at.lo = -3.17867777e-09f; }
  if (small.hi > 0.375f * big.hi) { k = 0.5f; at.hi = 0.463647604f; at.lo = 5.01215869e-09f; }
  if (small.hi > 0.625f * big.hi) { k = 0.75f; at.hi = 0.643501103f; at.lo = 5.86893734e-09f; }
  if (small.hi > 0.875f * big.hi) { k = 1.0f; at.hi = 0.785398185f; at.lo = -2.18556941e-08f; }
#endif
  const clrad_pair below = clrad_pair_add(big, clrad_pair_times(small, k));
  if (below.hi > 0) {
    const clrad_pair u = clrad_pair_div(clrad_pair_sub(small, clrad_pair_times(big, k)), below);
    const clrad_pair q = clrad_pair_mul(u, u);
    clrad_pair third, fifth;
#ifdef CLRAD_FP64
    const REAL rest = q.hi * (-1.0 / 7 + q.hi * (1.0 / 9 + q.hi * (-1.0 / 11 + q.hi * (1.0 / 13 + q.hi * (-1.0 / 15 +
                      q.hi * (1.0 / 17 + q.hi * (-1.0 / 19)))))));
    third.hi = -0.3333333333333333; third.lo = -1.8503717077085943e-17;
    fifth.hi = 0.2; fifth.lo = -1.1102230246251566e-17;
#else
    const REAL rest = q.hi * (-1.0f / 7 + q.hi * (1.0f / 9 + q.hi * (-1.0f / 11 + q.hi * (1.0f / 13))));
    third.hi = -0.333333343f; third.lo = 9.93410776e-09f;
    fifth.hi = 0.200000003f; fifth.lo = -2.98023224e-09f;
#endif
    const clrad_pair inner = clrad_pair_mul(q, clrad_pair_add(fifth, clrad_two_sum(0, rest)));
    const clrad_pair tail = clrad_pair_mul(clrad_pair_mul(u, q), clrad_pair_add(third, inner));
    at = clrad_pair_add(at, clrad_pair_add(u, tail));
  }
#ifdef CLRAD_FP64
  if (x.hi < 0) { base.hi = 3.141592653589793; base.lo = 1.2246467991473532e-16; }
  if (steep) { base.hi = 1.5707963267948966; base.lo = 6.123233995736766e-17; }
#else
  if (x.hi < 0) { base.hi = 3.14159274f; base.lo = -8.74227766e-08f; }
  if (steep) { base.hi = 1.57079637f; base.lo = -4.37113883e-08f; }
#endif
  return steep != (x.hi < 0) ? clrad_pair_sub(base, at) : clrad_pair_add(base, at);
}

clrad_pair_vector clrad_pair_vector_sub(clrad_pair_vector a, clrad_pair_vector b) {
  a.x = clrad_pair_sub(a.x, b.x);
  a.y = clrad_pair_sub(a.y, b.y);
  a.z = clrad_pair_sub(a.z, b.z);
  return a;
}
clrad_pair_vector clrad_pair_vector_add(clrad_pair_vector a, clrad_pair_vector b) {
  a.x = clrad_pair_add(a.x, b.x);
  a.y = clrad_pair_add(a.y, b.y);
  a.z = clrad_pair_add(a.z, b.z);
  return a;
}
clrad_pair_vector clrad_pair_vector_mul(clrad_pair_vector a, clrad_pair s) {
  a.x = clrad_pair_mul(a.x, s);
  a.y = clrad_pair_mul(a.y, s);
  a.z = clrad_pair_mul(a.z, s);
  return a;
}
clrad_pair_vector clrad_pair_vector_scaled(clrad_pair_vector a, REAL s) { /* s a power of two: exact */
  a.x = clrad_pair_scaled(a.x, s);
  a.y = clrad_pair_scaled(a.y, s);
  a.z = clrad_pair_scaled(a.z, s);
  return a;
}
clrad_pair_vector clrad_pair_cross(clrad_pair_vector a, clrad_pair_vector b) {
  clrad_pair_vector c;
  c.x = clrad_pair_sub(clrad_pair_mul(a.y, b.z), clrad_pair_mul(a.z, b.y));
  c.y = clrad_pair_sub(clrad_pair_mul(a.z, b.x), clrad_pair_mul(a.x, b.z));
  c.z = clrad_pair_sub(clrad_pair_mul(a.x, b.y), clrad_pair_mul(a.y, b.x));
  return c;
}
clrad_pair clrad_pair_dot(clrad_pair_vector a, clrad_pair_vector b) {
  return clrad_pair_add(clrad_pair_add(clrad_pair_mul(a.x, b.x), clrad_pair_mul(a.y, b.y)), clrad_pair_mul(a.z, b.z));
}
clrad_pair_vector clrad_pair_of(clrad_vector a) { /* widened */
  clrad_pair_vector p;
  p.x.hi = a.x;
  p.y.hi = a.y;
  p.z.hi = a.z;
  p.x.lo = p.y.lo = p.z.lo = 0;
  return p;
}
clrad_vector clrad_rounded(clrad_pair_vector a) { return clrad_make(a.x.hi, a.y.hi, a.z.hi); }
#endif
