/* What a picture's rays meet that has a texture: B = E + rho H, with H what shading left there and rho the texture's at the
 * very point. Bilinear and not otherwise filtered: the picture's samples do that.
 *
 * Pre:  shown[ray * bands + band] = H where texture_of[seen[ray]] is one of `textures`; uv[polygon * 8 + 2 k ..] at corner k;
 *       factor and exitance [polygon * bands + band].
 * Post: shown = B there; nothing else changes. A back that is seen stays black. */
#include "shared/surface.cl"
#include "shared/texture.cl"

__kernel void texture_rays(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                           __global const uint* seen, uint rays, __global const REAL* polygons,
                           __global const uint* texture_of, __global const REAL* uv, __global const uint* textures,
                           __global const float* texels, __global const REAL* factor, __global const REAL* exitance,
                           uint bands, __global float* shown) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays || seen[ray] == CLRAD_NONE || texture_of[seen[ray]] == CLRAD_NONE) return;
  const uint polygon = seen[ray];
  __global const REAL* table = polygons + (ulong)polygon * CLRAD_POLYGON_REALS;
  const clrad_seen s = clrad_meet(table, origins + ray, targets + ray);
  if (!(s.facing < (REAL)0)) return;
  REAL u, v;
  clrad_parameters(table, s, &u, &v);
  const int quad = table[17] != (REAL)0;
  v = clrad_unit_clamped(v, (REAL)1);
  u = clrad_unit_clamped(u, quad ? (REAL)1 : (REAL)1 - v);
  __global const REAL* c = uv + (ulong)8 * polygon;
  const REAL w0 = quad ? (1 - u) * (1 - v) : 1 - u - v, w1 = quad ? u * (1 - v) : u, w2 = quad ? u * v : v,
             w3 = quad ? (1 - u) * v : (REAL)0;
  const clrad_lookup l = clrad_look_up(textures + CLRAD_TEXTURE_UINTS * texture_of[polygon],
                                       w0 * c[0] + w1 * c[2] + w2 * c[4] + w3 * c[6],
                                       w0 * c[1] + w1 * c[3] + w2 * c[5] + w3 * c[7]);
  for (uint band = 0; band < bands; ++band) {
    const ulong at = (ulong)polygon * bands + band;
    __global float* out = shown + (ulong)ray * bands + band;
    *out = (float)(exitance[at] + factor[at] * clrad_value(texels, &l, bands, band) * (REAL)*out);
  }
}
