/* Mean reflectance of elements whose material has a texture: the area mean of the texture's bilinear interpolant, by the
 * midpoint rule. One work-item an element and band.
 *
 * Why not a table of sums: elements lie at any angle in a texture, and may be bent in it; points serve all of them alike.
 * Points: points[i] along each side of element i, two a texel where that makes no more than the host's limit, else two a
 *         texel of the texture halved until it does (host/mesh/texture.cpp chooses both). On a bilinear interpolant half a texel
 *         apart the rule errs by at most 1/32 of the difference of neighbouring texels, and these errors alternate.
 * Pre:  uv[8 i + 2 k ..] texture coordinates of corner k of element i, bilinear between them (a triangle: linear, uv[8 i + 6]
 *       unused); jacobian[4 i + k] area per parameter area there, all 0 of a triangle; texture[i] which of `textures`.
 * Post: mean[i * bands + band], compensated sums in a fixed order. */
#include "shared/sum.cl"
#include "shared/texture.cl"

__kernel void average_texture(__global const REAL* uv, __global const REAL* jacobian, __global const uint* points,
                              __global const uint* texture, __global const uint* textures, __global const float* texels,
                              uint bands, __global REAL* mean, uint elements) {
  const uint id = (uint)get_global_id(0);
  const uint i = id / bands, band = id % bands;
  if (i >= elements) return;
  __global const REAL* c = uv + (ulong)8 * i;
  __global const REAL* j = jacobian + (ulong)4 * i;
  const uint n = points[i];
  const int triangle = j[0] == 0;
  REAL sum = 0, lost = 0, area = 0, area_lost = 0;
  for (uint row = 0; row < n; ++row)
    for (uint column = 0; column < n; ++column) {
      REAL w0, w1, w2, w3 = 0, weight = 1;
      if (triangle) {
        /* The middles of n^2 small triangles: upright ones below the diagonal, turned ones above it. */
        const int turned = row + column >= n;
        const REAL third = turned ? (REAL)-1 / 3 : (REAL)1 / 3;
        w1 = (turned ? (REAL)(n - column) : (REAL)column) + third;
        w2 = (turned ? (REAL)(n - row) : (REAL)row) + third;
        w1 /= (REAL)n, w2 /= (REAL)n;
        w0 = 1 - w1 - w2;
      } else {
        const REAL s = ((REAL)column + (REAL)0.5f) / (REAL)n, t = ((REAL)row + (REAL)0.5f) / (REAL)n;
        w0 = (1 - s) * (1 - t), w1 = s * (1 - t), w2 = s * t, w3 = (1 - s) * t;
        weight = w0 * j[0] + w1 * j[1] + w2 * j[2] + w3 * j[3];
      }
      const REAL u = w0 * c[0] + w1 * c[2] + w2 * c[4] + w3 * c[6], v = w0 * c[1] + w1 * c[3] + w2 * c[5] + w3 * c[7];
      const clrad_lookup l = clrad_look_up(textures + CLRAD_TEXTURE_UINTS * texture[i], u, v);
      clrad_add(&area, &area_lost, weight);
      clrad_add(&sum, &lost, weight * clrad_value(texels, &l, bands, band));
    }
  mean[id] = sum / area;
}
