/* Builds the uniform grid: which triangles a voxel holds (the paper's parallel preprocessing phase,
 * section 1.3.2).
 *
 *   per triangle: voxels of its bounding box          -> counts -> allocate
 *   per (triangle, voxel): does the triangle overlap? -> flags  -> compact -> stable sort by voxel
 *   per voxel: triangles counted                      -> scan   -> where its list starts, in blocks of
 * CLRAD_WIDTH
 *
 * Triangles stay in ascending order within a voxel. Lists hold a superset of what overlaps: all tests are
 * padded by CLRAD_VOXEL_PAD (shared/voxel.cl says why that is enough).
 */
#include "shared/voxel.cl"

typedef struct voxel_range {
  int x0, x1, y0, y1, z0, z1;
} voxel_range;

static inline voxel_range range_of(clrad_triangle t, __global const float* frame) {
  float low, high;
  voxel_range r;
#define RANGE(axis, a, v0, v1, v2)                                                                     \
  low = v0 < v1 ? v0 : v1;                                                                             \
  low = low < v2 ? low : v2;                                                                           \
  high = v0 > v1 ? v0 : v1;                                                                            \
  high = high > v2 ? high : v2;                                                                        \
  r.a##0 = clrad_cell(frame, axis, low - 2.0f * CLRAD_VOXEL_PAD, 0, convert_int(frame[9 + axis]) - 1); \
  r.a##1 = clrad_cell(frame, axis, high + 2.0f * CLRAD_VOXEL_PAD, 0, convert_int(frame[9 + axis]) - 1);
  RANGE(0, x, t.x0, t.x1, t.x2)
  RANGE(1, y, t.y0, t.y1, t.y2)
  RANGE(2, z, t.z0, t.z1, t.z2)
#undef RANGE
  return r;
}

/* counts[i] = voxels that the bounding box of triangle i touches. */
__kernel void grid_ranges(uint n, __global const clrad_triangle* triangles, __global const float* frame,
                          __global uint* counts) {
  uint i = get_global_id(0);
  if (i >= n) return;
  voxel_range r = range_of(triangles[i], frame);
  counts[i] = (uint)(r.x1 - r.x0 + 1) * (uint)(r.y1 - r.y0 + 1) * (uint)(r.z1 - r.z0 + 1);
}

/* Are triangle and box (about the middle, half size h) apart along (lx, ly, lz)? Whatever the rounding of the
 * axis, it is an axis; only the projections' rounding matters, and h is padded by more. The tiny constant
 * keeps products that underflow from telling anything apart. */
static inline int apart(float lx, float ly, float lz, float x0, float y0, float z0, float x1, float y1, float z1,
                 float x2, float y2, float z2, float hx, float hy, float hz) {
  float p0 = lx * x0 + ly * y0 + lz * z0, p1 = lx * x1 + ly * y1 + lz * z1, p2 = lx * x2 + ly * y2 + lz * z2;
  float low = p0 < p1 ? p0 : p1, high = p0 > p1 ? p0 : p1;
  low = low < p2 ? low : p2;
  high = high > p2 ? high : p2;
  float r = fabs(lx) * hx + fabs(ly) * hy + fabs(lz) * hz + 1e-30f;
  return low > r || high < -r;
}

/* The separating axis test of triangle and padded voxel (Akenine-Moller 2001): 3 faces, 1 normal, 9 pairs of
 * edges. */
static inline int overlaps(clrad_triangle t, __global const float* frame, int ix, int iy, int iz) {
  float ax = clrad_plane(frame, 0, ix), bx = clrad_plane(frame, 0, ix + 1);
  float ay = clrad_plane(frame, 1, iy), by = clrad_plane(frame, 1, iy + 1);
  float az = clrad_plane(frame, 2, iz), bz = clrad_plane(frame, 2, iz + 1);
  float mx = 0.5f * (ax + bx), my = 0.5f * (ay + by), mz = 0.5f * (az + bz);
  float hx = 0.5f * (bx - ax) + CLRAD_VOXEL_PAD;
  float hy = 0.5f * (by - ay) + CLRAD_VOXEL_PAD;
  float hz = 0.5f * (bz - az) + CLRAD_VOXEL_PAD;
  float x0 = t.x0 - mx, y0 = t.y0 - my, z0 = t.z0 - mz;
  float x1 = t.x1 - mx, y1 = t.y1 - my, z1 = t.z1 - mz;
  float x2 = t.x2 - mx, y2 = t.y2 - my, z2 = t.z2 - mz;
#define APART(lx, ly, lz) apart(lx, ly, lz, x0, y0, z0, x1, y1, z1, x2, y2, z2, hx, hy, hz)
  int out = APART(1.0f, 0.0f, 0.0f) | APART(0.0f, 1.0f, 0.0f) | APART(0.0f, 0.0f, 1.0f);
  float ex = x1 - x0, ey = y1 - y0, ez = z1 - z0;
  float fx = x2 - x0, fy = y2 - y0, fz = z2 - z0;
  float gx = x2 - x1, gy = y2 - y1, gz = z2 - z1;
  out |= APART(ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx);
  out |= APART(0.0f, -ez, ey) | APART(ez, 0.0f, -ex) | APART(-ey, ex, 0.0f);
  out |= APART(0.0f, -fz, fy) | APART(fz, 0.0f, -fx) | APART(-fy, fx, 0.0f);
  out |= APART(0.0f, -gz, gy) | APART(gz, 0.0f, -gx) | APART(-gy, gx, 0.0f);
#undef APART
  return !out;
}

/* Slot = (triangle owner[s], voxel rank[s] of its range). flags[s] = do they overlap; voxel[s] = the voxel's
 * number; held[v] counts the triangles of voxel v (whole numbers: the order of the additions does not
 * matter). */
__kernel void grid_overlap(uint slots, __global const clrad_triangle* triangles, __global const float* frame,
                           __global const uint* owner, __global const uint* rank, __global uint* flags,
                           __global uint* voxel, __global uint* held) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  clrad_triangle t = triangles[owner[s]];
  voxel_range r = range_of(t, frame);
  uint wide = (uint)(r.x1 - r.x0 + 1), high = (uint)(r.y1 - r.y0 + 1), k = rank[s];
  int ix = r.x0 + (int)(k % wide), iy = r.y0 + (int)(k / wide % high), iz = r.z0 + (int)(k / wide / high);
  uint v = ((uint)iz * (uint)frame[10] + (uint)iy) * (uint)frame[9] + (uint)ix;
  int inside = overlaps(t, frame, ix, iy, iz);
  flags[s] = (uint)inside;
  voxel[s] = v;
  if (inside) atomic_inc(held + v);
}

/* blocks[v] = blocks of CLRAD_WIDTH triangles that the list of voxel v takes; 0 for v in [voxels, n). */
__kernel void grid_blocks(uint n, uint voxels, __global const uint* held, __global uint* blocks) {
  uint v = get_global_id(0);
  if (v >= n) return;
  blocks[v] = 0;
  if (v < voxels) blocks[v] = (held[v] + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
}

/* The pairs that overlap, in slot order: key = voxel, value = triangle. */
__kernel void grid_pairs(uint pairs, __global const uint* picked, __global const uint* voxel,
                         __global const uint* owner, __global uint* keys, __global uint* values) {
  uint i = get_global_id(0);
  if (i >= pairs) return;
  keys[i] = voxel[picked[i]];
  values[i] = owner[picked[i]];
}

/* Lane l of block b: the triangle there, or CLRAD_NONE past the end of the voxel's list. owner and rank: the
 * voxel of a block and its number in it. */
__kernel void grid_lanes(uint lanes, __global const uint* owner, __global const uint* rank,
                         __global const uint* held, __global const uint* first, __global const uint* values,
                         __global uint* triangle) {
  uint i = get_global_id(0);
  if (i >= lanes) return;
  uint b = i / CLRAD_WIDTH, v = owner[b], place = rank[b] * CLRAD_WIDTH + i % CLRAD_WIDTH;
  triangle[i] = CLRAD_NONE;
  if (place < held[v]) triangle[i] = values[first[v] + place];
}
