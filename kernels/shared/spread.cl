/* Ten bits, two places free between each and the next: three of them make a Morton code. */
#ifndef CLRAD_SPREAD_CL
#define CLRAD_SPREAD_CL

static inline uint spread_bits(uint x) {
  x = (x | x << 16) & 0x030000ffu;
  x = (x | x << 8) & 0x0300f00fu;
  x = (x | x << 4) & 0x030c30c3u;
  return (x | x << 2) & 0x09249249u;
}

#endif
