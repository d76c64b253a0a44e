/* What glass lets pass of the light along a segment.
 *
 * Why: to the engines of visibility a surface is there or not; glass takes a share. Its triangles are no occluders, and this
 * stage multiplies what is not blocked by the product of what each of its surfaces on the way lets pass:
 *     t (1 - R(cos i)),  t the material's transmission of the band, R by shared/fresnel.cl at index ior,
 * of a thin sheet 2 R / (1 + R) for R, of each face of a solid R itself, met from outside: what kernels/render/reflect.cl
 * passes. The way is straight: a sheet bends nothing; through a solid with parallel faces light leaves in its old direction,
 * and its shift is left out, as is what goes to and fro inside.
 *
 * Whether a segment crosses a triangle is the predicate of the engines, so the answer is the same for all of them. Triangles are
 * sorted by plane, then as in the file. A segment meets a plane once, so of the triangles in one plane at most one counts, the
 * last that is hit: the diagonal of a quad, an edge between polygons of one pane, panes back to back, and the upper of
 * two that overlap. Where planes meet at an edge or corner, each counts. Products are taken in the order of planes.
 *
 * Pre:  segments are numbered as in shared/segment.cl, chosen origins from `first` on (samples per origin; 0: pairs); of
 *       blocked ones (bit set in masks) 1 comes out. Block k holds triangles block_first[k] .. block_first[k + 1] - 1, whole planes, inside
 *       boxes[6 k ..]: middle and half size, with room to spare for rounding. surfaces[4 i ..]: unit normal and
 *       ior of triangle i, a sheet's negative; shares[i * colours + c].
 * Post: passes[c * count + s] of segment s of `count`. */
#include "shared/fresnel.cl"
#include "shared/triangle.cl"

#define SURFACE_REALS 4

/* Can the segment a + d meet the box? By separating axes: those of the box and their cross products with d. Coordinates are at
 * most 4: what of them is rounded away is within the box's room, and products of two (at most 8 4) lose less than 2^-16. */
static int near_box(__global const float* box, float ax, float ay, float az, float dx, float dy, float dz) {
  const float hx = 0.5f * dx, hy = 0.5f * dy, hz = 0.5f * dz;
  const float cx = (ax - box[0]) + hx, cy = (ay - box[1]) + hy, cz = (az - box[2]) + hz;
  const float lx = fabs(hx), ly = fabs(hy), lz = fabs(hz), ex = box[3], ey = box[4], ez = box[5];
  if (fabs(cx) > ex + lx || fabs(cy) > ey + ly || fabs(cz) > ez + lz) return 0;
  return fabs(cy * hz - cz * hy) <= ey * lz + ez * ly + 0x1p-16f &&
         fabs(cz * hx - cx * hz) <= ez * lx + ex * lz + 0x1p-16f &&
         fabs(cx * hy - cy * hx) <= ex * ly + ey * lx + 0x1p-16f;
}

static REAL reflects(__global const REAL* surface, REAL dx, REAL dy, REAL dz) {
  const REAL length = sqrt(dx * dx + dy * dy + dz * dz);
  const REAL along = fabs(dx * surface[0] + dy * surface[1] + dz * surface[2]) / length;
  const int sheet = surface[3] < 0;
  REAL cos_t;
  const REAL r = clrad_fresnel(1, fabs(surface[3]), along < 1 ? along : (REAL)1, &cos_t);
  return sheet ? clrad_sheet_reflects(r) : r;
}

__kernel void through_glass(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active, uint first,
                            __global const CLRAD_POINT_T* targets, uint samples, __global const uint* masks,
                            __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                            __global const REAL* surfaces, __global const REAL* shares, uint colours,
                            __global const uint* block_first, __global const float* boxes, uint blocks,
                            __global REAL* passes, ulong count) {
  const ulong r = get_global_id(0);
  if (r >= count) return;
  for (uint c = 0; c < colours; ++c) passes[c * count + r] = 1;
  const uint run = samples ? samples : 1, chosen = first + (uint)(r / run), k = (uint)(r % run), words = (run + 31) / 32;
  if (masks[(ulong)chosen * words + k / 32] >> (k & 31) & 1) return;
  const uint origin = use_active ? active[chosen] : chosen;
  __global const CLRAD_POINT_T* from = origins + origin;
  __global const CLRAD_POINT_T* to = targets + (samples ? k : origin);
  const float x = (float)from->x, y = (float)from->y, z = (float)from->z;
  const float ex = (float)to->x - x, ey = (float)to->y - y, ez = (float)to->z - z;
  for (uint block = 0; block < blocks; ++block) {
    if (!near_box(boxes + 6 * block, x, y, z, ex, ey, ez)) continue;
    const clrad_segment s = clrad_make_segment(from, to);
    const float dx = CLRAD_DIFFERENCE(s.bx, s.bx_lo, s.ax, s.ax_lo), dy = CLRAD_DIFFERENCE(s.by, s.by_lo, s.ay, s.ay_lo),
                dz = CLRAD_DIFFERENCE(s.bz, s.bz_lo, s.az, s.az_lo);
    const uint end = block_first[block + 1];
    for (uint i = block_first[block]; i < end;) {
      const uint plane = triangles[i].plane;
      uint hit = CLRAD_NONE, exact = 0;
      for (; i < end && triangles[i].plane == plane; ++i)
        if (clrad_test(s, triangles[i], facets[i], &exact)) hit = i;
      if (hit == CLRAD_NONE) continue;
      const REAL passed = 1 - reflects(surfaces + SURFACE_REALS * hit, dx, dy, dz);
      for (uint c = 0; c < colours; ++c) passes[c * count + r] *= shares[hit * colours + c] * passed;
    }
  }
}
