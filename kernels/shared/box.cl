/* Boxes of occluders. A corner is hi + lo: its box reaches to the next float beyond hi where lo says so. */
#ifndef CLRAD_BOX_CL
#define CLRAD_BOX_CL

static inline float below(float hi, float lo) {
  return lo < 0.0f ? hi - fabs(hi) * 0x1p-23f - 0x1p-100f : hi;
}
static inline float above(float hi, float lo) {
  return lo > 0.0f ? hi + fabs(hi) * 0x1p-23f + 0x1p-100f : hi;
}
static inline float lowest(float a, float a_lo, float b, float b_lo, float c, float c_lo) {
  return fmin(fmin(below(a, a_lo), below(b, b_lo)), below(c, c_lo));
}
static inline float highest(float a, float a_lo, float b, float b_lo, float c, float c_lo) {
  return fmax(fmax(above(a, a_lo), above(b, b_lo)), above(c, c_lo));
}

/* Where a segment crosses a box's sides is coordinate * i + low or high, i = inverse(D), low = -(origin + BOX_PAD) * i and high = -(origin -
 * BOX_PAD) * i. In floats, too, that is monotone in the coordinate: what lies in a box is entered no earlier than the box. */
#define BOX_PAD 0x1p-18f

/* 1 / D; where a segment does not move along the axis, so much that both crossings are far outside it unless it lies between
 * them, and no infinity whose difference would be none. Other components are 2^-38 at least. */
static inline float inverse_of_one(float d) {
  return d == 0.0f ? 1e30f : 1.0f / d;
}

/* Where a segment enters between low and high along one axis; far outside [0, 1] where it does not cross them. */
static inline float entry_along(float origin, float d, float low, float high) {
  const float i = inverse_of_one(d), from = -(origin + BOX_PAD) * i, to = -(origin - BOX_PAD) * i;
  const float t0 = low * i + from, t1 = high * i + to;
  return t0 < t1 ? t0 : t1;
}

#endif
