/* Lanes of REAL, vectors of them, and masks of the same size: -1 or 0 a lane. With width 1 plain scalars, as in shared/packet.cl. */
#ifndef CLRAD_REALS_CL
#define CLRAD_REALS_CL
#include "shared/packet.cl"

#if CLRAD_WIDTH == 1
typedef REAL clrad_reals;
typedef int clrad_masks;
#define CLRAD_MASKS_OF_INTS(v) (v)
#elif defined(CLRAD_FP64)
typedef CLRAD_PASTE(double, CLRAD_WIDTH) clrad_reals;
typedef CLRAD_PASTE(long, CLRAD_WIDTH) clrad_masks;
#define CLRAD_MASKS_OF_INTS(v) CLRAD_PASTE(convert_long, CLRAD_WIDTH)(v)
#else
typedef clrad_floats clrad_reals;
typedef clrad_ints clrad_masks;
#define CLRAD_MASKS_OF_INTS(v) (v)
#endif

static inline int clrad_some(clrad_masks m) { return clrad_bits_of_any(CLRAD_TO_INTS(m)) != 0; }

typedef struct clrad_vectors {
  clrad_reals x, y, z;
} clrad_vectors;

static inline clrad_reals clrad_dots(clrad_vectors a, clrad_vectors b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline clrad_vectors clrad_differences(clrad_vectors a, clrad_vectors b) {
  const clrad_vectors d = {a.x - b.x, a.y - b.y, a.z - b.z};
  return d;
}
static inline clrad_vectors clrad_crosses(clrad_vectors a, clrad_vectors b) {
  const clrad_vectors c = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  return c;
}

#endif
