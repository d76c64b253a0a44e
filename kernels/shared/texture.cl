/* The value of a texture at (u, v): bilinear between the middles of the four texels around, the texture going on past its
 * edges as its wrap says. Texels are [row][column][band]. NaN counts as 0. */
#ifndef CLRAD_TEXTURE_CL
#define CLRAD_TEXTURE_CL

#define CLRAD_WRAP_REPEAT 0u
#define CLRAD_WRAP_MIRROR 1u
#define CLRAD_WRAP_CLAMP 2u

/* What a texture is, in uints: where its texels begin (in texels of one band, low and high word), width, height, wrap along u and v. */
#define CLRAD_TEXTURE_UINTS 6

/* The two texels on either side of a coordinate, and how much the second weighs. */
typedef struct clrad_between {
  uint first, second;
  REAL share;
} clrad_between;

static inline uint clrad_wrapped(int i, int size, uint wrap) {
  if (wrap == CLRAD_WRAP_CLAMP) return (uint)(i < 0 ? 0 : i < size ? i : size - 1);
  const int period = wrap == CLRAD_WRAP_MIRROR ? 2 * size : size;
  int k = i % period;
  if (k < 0) k += period;
  return (uint)(k < size ? k : period - 1 - k);
}

static inline clrad_between clrad_texels_around(REAL x, uint size, uint wrap) {
  /* Into one period (or next to the edge) first, so that whole numbers of texels fit an int. */
  if (wrap == CLRAD_WRAP_REPEAT) x -= floor(x);
  if (wrap == CLRAD_WRAP_MIRROR) x -= 2 * floor(x * (REAL)0.5f);
  if (wrap == CLRAD_WRAP_CLAMP) x = x > -1 ? (x < 2 ? x : (REAL)2) : (REAL)-1;
  if (!(x >= -1 && x <= 2)) x = 0;
  const REAL at = x * (REAL)size - (REAL)0.5f, below = floor(at);
  const int i = (int)below;
  clrad_between b;
  b.first = clrad_wrapped(i, (int)size, wrap);
  b.second = clrad_wrapped(i + 1, (int)size, wrap);
  b.share = at - below;
  return b;
}

typedef struct clrad_lookup {
  ulong at[4];
  REAL weight[4];
} clrad_lookup;

static inline clrad_lookup clrad_look_up(__global const uint* texture, REAL u, REAL v) {
  const ulong begin = texture[0] | (ulong)texture[1] << 32;
  const clrad_between x = clrad_texels_around(u, texture[2], texture[4]),
                      y = clrad_texels_around(v, texture[3], texture[5]);
  clrad_lookup l;
  l.at[0] = begin + (ulong)y.first * texture[2] + x.first;
  l.at[1] = begin + (ulong)y.first * texture[2] + x.second;
  l.at[2] = begin + (ulong)y.second * texture[2] + x.first;
  l.at[3] = begin + (ulong)y.second * texture[2] + x.second;
  l.weight[0] = (1 - x.share) * (1 - y.share);
  l.weight[1] = x.share * (1 - y.share);
  l.weight[2] = (1 - x.share) * y.share;
  l.weight[3] = x.share * y.share;
  return l;
}

static inline REAL clrad_value(__global const float* texels, const clrad_lookup* l, uint bands, uint band) {
  REAL sum = 0;
  for (uint k = 0; k < 4; ++k) sum += l->weight[k] * (REAL)texels[l->at[k] * bands + band];
  return sum;
}

#endif
