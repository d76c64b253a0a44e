/* Visibility by chopping rays into voxels: object-parallel and ray-parallel (section 1.3.2 of the paper,
 * figure 1.2).
 *
 *   per ray                cut to the grid's box, count the x planes crossed      -> allocate
 *   per (ray, x slab)      piece of the ray in it, count the y planes crossed     -> allocate
 *   per (..., y slab)      the same along z                                       -> allocate
 *   per (ray, voxel)       triangles in the voxel: 0 drops the piece              -> allocate
 *   per (ray, candidates)  intersect
 *   per ray                blocked by any, or the nearest (segmented min)
 *
 * Candidates come in blocks of CLRAD_WIDTH triangles of one voxel, laid out for vectors: a work-item tests
 * one ray against one block. With width 1 that is the paper's one processor per ray and candidate. Axes with
 * a single cell are not cut. Where a ray crosses plane i is one function of i (shared/voxel.cl): neighbouring
 * pieces share that number, nothing is accumulated along a ray, and the pieces of a ray follow each other
 * from its origin to its target.
 *
 * Long rays are handled in waves, front to back: wave w holds the part of a ray that lies in its w-th run of
 * `slab` cells along the axis on which it crosses most cells. Rays that are blocked take no part in the next
 * wave.
 *
 * A piece is (ray, cell, t0, t1); cell = x | y << 10 | z << 20.
 */
#include "shared/triangle.cl"
#include "shared/voxel.cl"

#define ALWAYS_INLINE __attribute__((always_inline)) inline

#if CLRAD_WIDTH == 1
typedef float lanes_float;
typedef int lanes_int;
typedef uint lanes_uint;
#define LOAD_FLOATS(at, p) ((p)[at])
#define LOAD_UINTS(at, p) ((p)[at])
#define MASK(condition) (-(condition)) /* a scalar comparison gives 1, a vector's -1 a lane */
#define LANE_BITS 1
#elif CLRAD_WIDTH == 4
typedef float4 lanes_float;
typedef int4 lanes_int;
typedef uint4 lanes_uint;
#define LOAD_FLOATS(at, p) vload4(at, p)
#define LOAD_UINTS(at, p) vload4(at, p)
#define MASK(condition) (condition)
#define LANE_BITS (int4)(1, 2, 4, 8)
#elif CLRAD_WIDTH == 8
typedef float8 lanes_float;
typedef int8 lanes_int;
typedef uint8 lanes_uint;
#define LOAD_FLOATS(at, p) vload8(at, p)
#define LOAD_UINTS(at, p) vload8(at, p)
#define MASK(condition) (condition)
#define LANE_BITS (int8)(1, 2, 4, 8, 16, 32, 64, 128)
#else
typedef float16 lanes_float;
typedef int16 lanes_int;
typedef uint16 lanes_uint;
#define LOAD_FLOATS(at, p) vload16(at, p)
#define LOAD_UINTS(at, p) vload16(at, p)
#define MASK(condition) (condition)
#define LANE_BITS (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768)
#endif

/* All lanes ored together. */
ALWAYS_INLINE int any_bits(lanes_int v) {
#if CLRAD_WIDTH == 1
  return v;
#elif defined(__clang__) && defined(__has_builtin) && __has_builtin(__builtin_reduce_or)
  return __builtin_reduce_or(v);
#else
#if CLRAD_WIDTH == 16
  int8 v8 = v.lo | v.hi;
#elif CLRAD_WIDTH == 8
  int8 v8 = v;
#endif
#if CLRAD_WIDTH >= 8
  int4 v4 = v8.lo | v8.hi;
#else
  int4 v4 = v;
#endif
  int2 v2 = v4.lo | v4.hi;
  return v2.x | v2.y;
#endif
}

#define HIT_BIT 0x10000 /* of a block's verdict; bits 0..15: lanes that floats cannot decide */

/* Words of a block in `packets`: floats x0 y0 z0 and their low parts, edges 0 and 2, normal, the two sizes.
 */
#define PACKET_FLOATS 17
/* A ray is two ends on the visibility grid: ray r of a batch goes from end r / run of `from` to end r % run
 * of `to`, or, in pairs, from end r to end r. An end: x y z and their low parts as float bits, plane, spare.
 */
#define END_WORDS 8

typedef struct ray_ends {
  __global const uint *a, *b;
} ray_ends;

ALWAYS_INLINE ray_ends ends_of(__global const uint* from, __global const uint* to, uint run, uint pairs,
                               uint r) {
  /* r / run without an integer division, which has no vector form: r < 2^24, so the guess is off by one at
   * most. */
  uint q = convert_uint(convert_float(r) / convert_float(run));
  q -= q * run > r ? 1u : 0u;
  q += (q + 1u) * run <= r ? 1u : 0u;
  ray_ends e;
  e.a = from + (pairs ? r : q) * END_WORDS;
  e.b = to + (pairs ? r : r - q * run) * END_WORDS;
  return e;
}

ALWAYS_INLINE float ray_origin(ray_ends e, uint axis) {
  return as_float(e.a[axis]);
}
ALWAYS_INLINE float ray_direction(ray_ends e, uint axis) {
  return CLRAD_DIFFERENCE(as_float(e.b[axis]), as_float(e.b[3 + axis]), as_float(e.a[axis]),
                          as_float(e.a[3 + axis]));
}

/* ends[i] = point first + i of the list, snapped. */
__kernel void chop_ends(uint n, uint first, __global const CLRAD_POINT_T* points, __global const uint* active,
                        uint use_active, __global uint* ends) {
  uint i = get_global_id(0);
  if (i >= n) return;
  __global const CLRAD_POINT_T* point = points + (use_active ? active[first + i] : first + i);
  clrad_grid_point g = clrad_snap_point(point);
  __global uint* e = ends + i * END_WORDS;
  e[0] = as_uint(clrad_grid_hi(g.x));
  e[1] = as_uint(clrad_grid_hi(g.y));
  e[2] = as_uint(clrad_grid_hi(g.z));
  e[3] = as_uint(clrad_grid_lo(g.x));
  e[4] = as_uint(clrad_grid_lo(g.y));
  e[5] = as_uint(clrad_grid_lo(g.z));
  e[6] = point->plane;
  e[7] = 0;
}

__kernel void chop_packets(uint lanes, __global const uint* triangle,
                           __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                           __global float* packets, __global uint* plane) {
  uint i = get_global_id(0);
  if (i >= lanes) return;
  __global float* p = packets + i / CLRAD_WIDTH * (PACKET_FLOATS * CLRAD_WIDTH) + i % CLRAD_WIDTH;
  uint k = triangle[i];
  if (k == CLRAD_NONE) {
    /* All zero but for the sizes: E_U and E_S are then at least their floors and no volume reaches them, so
     * the lane would be undecided; the plane number tells that there is nothing. */
    for (int f = 0; f < PACKET_FLOATS; ++f) p[f * CLRAD_WIDTH] = 0.0f;
    plane[i] = CLRAD_NONE;
    return;
  }
  clrad_triangle t = triangles[k];
  clrad_facet f = facets[k];
  plane[i] = t.plane;
  p[0 * CLRAD_WIDTH] = t.x0;
  p[1 * CLRAD_WIDTH] = t.y0;
  p[2 * CLRAD_WIDTH] = t.z0;
  p[3 * CLRAD_WIDTH] = t.x0_lo;
  p[4 * CLRAD_WIDTH] = t.y0_lo;
  p[5 * CLRAD_WIDTH] = t.z0_lo;
  p[6 * CLRAD_WIDTH] = f.e0x;
  p[7 * CLRAD_WIDTH] = f.e0y;
  p[8 * CLRAD_WIDTH] = f.e0z;
  p[9 * CLRAD_WIDTH] = f.e2x;
  p[10 * CLRAD_WIDTH] = f.e2y;
  p[11 * CLRAD_WIDTH] = f.e2z;
  p[12 * CLRAD_WIDTH] = f.nx;
  p[13 * CLRAD_WIDTH] = f.ny;
  p[14 * CLRAD_WIDTH] = f.nz;
  p[15 * CLRAD_WIDTH] = f.edge_size;
  p[16 * CLRAD_WIDTH] = f.normal_size;
}

/* ---- cutting
 * ------------------------------------------------------------------------------------------------------ */

/* The part [*t0, *t1] of the ray inside the grid's box. 0 when there is none; then t0 > t1. */
ALWAYS_INLINE int clip(ray_ends ray, __global const float* frame, float* t0, float* t1) {
  float begin = 0.0f, end = 1.0f;
  int inside = 1, moves = 0;
  for (uint a = 0; a < 3; ++a) {
    float o = ray_origin(ray, a), d = ray_direction(ray, a), inverse = 1.0f / d;
    float low = clrad_plane(frame, a, 0), high = clrad_plane(frame, a, convert_int(frame[9 + a]));
    float p = (low - o) * inverse, q = (high - o) * inverse;
    float near = p < q ? p : q, far = p < q ? q : p;
    int along = d == 0.0f; /* with the planes: p and q are infinite or NaN */
    near = along ? 0.0f : near;
    far = along ? 1.0f : far;
    begin = begin > near ? begin : near;
    end = end < far ? end : far;
    inside &= (along ^ 1) | ((o >= low) & (o <= high));
    moves |= along ^ 1;
  }
  int meets = inside & moves & (begin <= end);
  *t0 = meets ? begin : 1.0f;
  *t1 = meets ? end : 0.0f;
  return meets;
}

/* The cells of an axis that a wave may use, packed with the axis. All cells of all axes: axis 3. */
#define ANY_CELLS (3u << 20)

ALWAYS_INLINE int first_cell(uint cells, uint axis) {
  return cells >> 20 == axis ? (int)(cells & 1023u) : 0;
}
ALWAYS_INLINE int last_cell(uint cells, uint axis, __global const float* frame) {
  return cells >> 20 == axis ? (int)(cells >> 10 & 1023u) : convert_int(frame[9 + axis]) - 1;
}

/* How many pieces [t0, t1] of the ray has along the axis; for axis 3: how many blocks the voxel's list has.
 */
ALWAYS_INLINE uint pieces_ahead(uint axis, ray_ends ray, float t0, float t1, uint cell, uint cells,
                                __global const float* frame, __global const uint* first_block) {
  if (axis == 3) {
    uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
    return first_block[v + 1] - first_block[v];
  }
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis);
  int low = first_cell(cells, axis), high = last_cell(cells, axis, frame);
  int i = clrad_cell(frame, axis, o + t0 * d, low, high), j = clrad_cell(frame, axis, o + t1 * d, low, high);
  return (uint)abs(j - i) + 1u;
}

/* Wave `wave` of a ray: narrows [t0, t1] and gives the cells it may use. *more: the ray goes on after this
 * wave. */
ALWAYS_INLINE uint wave_cells(ray_ends ray, __global const float* frame, uint wave, uint slab, float* t0,
                              float* t1, uint* more) {
  uint axis = 0;
  int from = 0, to = 0;
  for (uint a = 0; a < 3; ++a) {
    float o = ray_origin(ray, a), d = ray_direction(ray, a);
    int n = convert_int(frame[9 + a]);
    int i = clrad_cell(frame, a, o + *t0 * d, 0, n - 1), j = clrad_cell(frame, a, o + *t1 * d, 0, n - 1);
    if (a == 0 || abs(j - i) > abs(to - from)) {
      axis = a;
      from = i;
      to = j;
    }
  }
  int step = to < from ? -1 : 1, count = abs(to - from) + 1;
  int begin = (int)(wave * slab), end = begin + (int)slab;
  *more = end < count;
  end = end < count ? end : count;
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis), t_begin = *t0, t_end = *t1;
  if (begin > 0) {
    float t = clrad_crossing(frame, axis, from + step * begin + (step < 0), o, d);
    t = t > *t0 ? t : *t0;
    t_begin = t < *t1 ? t : *t1;
  }
  if (end < count) {
    float t = clrad_crossing(frame, axis, from + step * end + (step < 0), o, d);
    t = t > *t0 ? t : *t0;
    t_end = t < *t1 ? t : *t1;
  }
  *t0 = t_begin;
  *t1 = t_end;
  int a = from + step * begin, b = from + step * (end - 1);
  return axis << 20 | (uint)(a < b ? b : a) << 10 | (uint)(a < b ? a : b);
}

/* Cuts `rays` rays to the box; counts[r] = pieces along `axis`, 0 for rays that miss it. */
__kernel void chop_rays(uint rays, __global const uint* from, __global const uint* to, uint run, uint pairs,
                        __global const float* frame, __global const uint* first_block, uint axis,
                        __global uint* piece_ray, __global uint* piece_cell, __global float* piece_t0,
                        __global float* piece_t1, __global uint* counts) {
  uint r = get_global_id(0);
  if (r >= rays) return;
  ray_ends ray = ends_of(from, to, run, pairs, r);
  float t0, t1;
  int meets = clip(ray, frame, &t0, &t1);
  uint count = pieces_ahead(axis, ray, t0, t1, 0, ANY_CELLS, frame, first_block);
  piece_ray[r] = r;
  piece_cell[r] = 0;
  piece_t0[r] = t0;
  piece_t1[r] = t1;
  counts[r] = meets ? count : 0u;
}

/* The same, cut to a wave as well, for `count` rays: alive[i] is the ray of slot i (i itself when use_alive
 * is 0). */
__kernel void chop_wave(uint count, __global const uint* alive, uint use_alive, uint wave, uint slab,
                        __global const uint* from, __global const uint* to, uint run, uint pairs,
                        __global const float* frame, __global const uint* first_block, uint axis,
                        __global uint* ray_cells, __global uint* more, __global uint* piece_ray,
                        __global uint* piece_cell, __global float* piece_t0, __global float* piece_t1,
                        __global uint* counts) {
  uint i = get_global_id(0);
  if (i >= count) return;
  uint r = use_alive ? alive[i] : i, goes_on = 0, cells = ANY_CELLS, ahead = 0;
  ray_ends ray = ends_of(from, to, run, pairs, r);
  float t0, t1;
  if (clip(ray, frame, &t0, &t1)) {
    cells = wave_cells(ray, frame, wave, slab, &t0, &t1, &goes_on);
    ahead = pieces_ahead(axis, ray, t0, t1, 0, cells, frame, first_block);
  }
  ray_cells[r] = cells;
  more[r] = goes_on;
  piece_ray[i] = r;
  piece_cell[i] = 0;
  piece_t0[i] = t0;
  piece_t1[i] = t1;
  counts[i] = ahead;
}

/* One cut: slot s is piece rank[s], along `axis`, of the piece owner[s]; counts[s] = what it asks for along
 * `next`. */
__kernel void chop_cut(uint slots, uint axis, uint next, __global const uint* offsets,
                       __global const uint* owner, __global const uint* rank, __global const float* frame,
                       __global const uint* first_block, __global const uint* from, __global const uint* to,
                       uint run, uint pairs, __global const uint* ray_cells, uint use_cells,
                       __global const uint* in_ray, __global const uint* in_cell, __global const float* in_t0,
                       __global const float* in_t1, __global uint* out_ray, __global uint* out_cell,
                       __global float* out_t0, __global float* out_t1, __global uint* counts) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  uint p = owner[s], r = in_ray[p];
  int k = (int)rank[s], last = (int)(offsets[p + 1] - offsets[p]) - 1;
  ray_ends ray = ends_of(from, to, run, pairs, r);
  uint cells = use_cells ? ray_cells[r] : ANY_CELLS;
  float o = ray_origin(ray, axis), d = ray_direction(ray, axis), t0 = in_t0[p], t1 = in_t1[p];
  int step = d < 0.0f ? -1 : 1;
  int i =
      clrad_cell(frame, axis, o + t0 * d, first_cell(cells, axis), last_cell(cells, axis, frame)) + step * k;
  float entry = clrad_crossing(frame, axis, i + (step < 0 ? 1 : 0), o, d);
  entry = entry > t0 ? entry : t0;
  entry = entry < t1 ? entry : t1;
  float begin = k > 0 ? entry : t0;
  float leave = clrad_crossing(frame, axis, i + (step > 0 ? 1 : 0), o, d);
  leave = leave > t0 ? leave : t0;
  leave = leave < t1 ? leave : t1;
  float end = k < last ? leave : t1;
  uint cell = in_cell[p] | (uint)i << (10 * axis);
  out_ray[s] = r;
  out_cell[s] = cell;
  out_t0[s] = begin;
  out_t1[s] = end;
  counts[s] = pieces_ahead(next, ray, begin, end, cell, cells, frame, first_block);
}

/* ---- testing
 * ------------------------------------------------------------------------------------------------------ */

/* The fast test of shared/triangle.cl for one ray and a block of triangles, with fewer operations. With A =
 * v0 - a, D = b - a, R = A x D: U_0 = e_0 . R,  U_2 = e_2 . R,  P = D . N,  U_1 = -P - U_0 - U_2   (the three
 * volumes add up to -D . N) S_a = -N . A,   S_b = S_a + P Errors, with the notation and the steps of that
 * file, X = |D|_max edge_size |A|_1 and Y = normal_size |D|_1: U_0, U_2: products 5u, difference 6u, times e
 * 7u and rounded 8u, summed 10u: 10u X P: N 1u, D 2u, product 4u, summed 6u: 6u Y U_1: 20u X + 6u Y, and its
 * two roundings u (|P| + |U_0|) + u (|P| + |U_0| + |U_2|) <= 2u Y + 3u X E_U = 26u X + 10u Y + 2^-80 |D|_max
 * holds for all three, terms in u^2 and the rounding of the bound included. S_a: 6u normal_size |A|_1.  S_b:
 * that, 6u Y, and a rounding of u (normal_size |A|_1 + Y): E_S = 10u normal_size (|A|_1 + |D|_1) + 2^-110
 * holds for both.
 */
#define BLOCK_VOLUME_ERROR 0x1.ap-20f /* 26u */
#define BLOCK_PLANE_ERROR 0x1.4p-21f  /* 10u */

typedef struct ray_data {
  float ax, ay, az, ax_lo, ay_lo, az_lo;
  float dx, dy, dz;
  uint a_plane, b_plane;
} ray_data;

ALWAYS_INLINE ray_data load_ray(ray_ends e) {
  ray_data d;
  d.ax = ray_origin(e, 0);
  d.ay = ray_origin(e, 1);
  d.az = ray_origin(e, 2);
  d.ax_lo = ray_origin(e, 3);
  d.ay_lo = ray_origin(e, 4);
  d.az_lo = ray_origin(e, 5);
  d.dx = ray_direction(e, 0);
  d.dy = ray_direction(e, 1);
  d.dz = ray_direction(e, 2);
  d.a_plane = e.a[6];
  d.b_plane = e.b[6];
  return d;
}

/* Per lane -1 or 0: surely blocked, and undecided. */
ALWAYS_INLINE void test_block(ray_data s, uint block, __global const float* packets,
                              __global const uint* triangle, __global const uint* plane, lanes_int* hit,
                              lanes_int* undecided) {
  __global const float* p = packets + block * (PACKET_FLOATS * CLRAD_WIDTH);
  lanes_float x = (LOAD_FLOATS(0, p) - s.ax) + (LOAD_FLOATS(3, p) - s.ax_lo);
  lanes_float y = (LOAD_FLOATS(1, p) - s.ay) + (LOAD_FLOATS(4, p) - s.ay_lo);
  lanes_float z = (LOAD_FLOATS(2, p) - s.az) + (LOAD_FLOATS(5, p) - s.az_lo);
  lanes_float rx = y * s.dz - z * s.dy, ry = z * s.dx - x * s.dz, rz = x * s.dy - y * s.dx;
  lanes_float u0 = CLRAD_DOT(LOAD_FLOATS(6, p), LOAD_FLOATS(7, p), LOAD_FLOATS(8, p), rx, ry, rz);
  lanes_float u2 = CLRAD_DOT(LOAD_FLOATS(9, p), LOAD_FLOATS(10, p), LOAD_FLOATS(11, p), rx, ry, rz);
  lanes_float nx = LOAD_FLOATS(12, p), ny = LOAD_FLOATS(13, p), nz = LOAD_FLOATS(14, p);
  lanes_float facing = CLRAD_DOT(nx, ny, nz, s.dx, s.dy, s.dz);
  lanes_float u1 = -(facing + u0) - u2;
  lanes_float side_a = -CLRAD_DOT(nx, ny, nz, x, y, z), side_b = side_a + facing;

  lanes_float edge_size = LOAD_FLOATS(15, p), normal_size = LOAD_FLOATS(16, p);
  lanes_float norm = CLRAD_NORM_1(x, y, z);
  float length = CLRAD_NORM_1(s.dx, s.dy, s.dz);
  float size = CLRAD_MAX(CLRAD_MAX(fabs(s.dx), fabs(s.dy)), fabs(s.dz));
  lanes_float error = norm * edge_size * (size * BLOCK_VOLUME_ERROR) +
                      normal_size * (length * BLOCK_PLANE_ERROR) + size * CLRAD_VOLUME_FLOOR;
  lanes_float error_s = (norm + length) * (normal_size * BLOCK_PLANE_ERROR) + CLRAD_SIDE_FLOOR;

  lanes_float least = u0 < u1 ? u0 : u1, most = u0 > u1 ? u0 : u1;
  least = least < u2 ? least : u2;
  most = most > u2 ? most : u2;
  lanes_float near = side_a < side_b ? side_a : side_b, far = side_a > side_b ? side_a : side_b;
  lanes_uint k = LOAD_UINTS(block, triangle), q = LOAD_UINTS(block, plane);
  lanes_int ignored =
      MASK(k == CLRAD_NONE) | (MASK(q != CLRAD_NONE) & (MASK(q == s.a_plane) | MASK(q == s.b_plane)));
  lanes_int miss =
      (MASK(least < -error) & MASK(most > error)) | MASK(near > error_s) | MASK(far < -error_s) | ignored;
  lanes_int sure = (MASK(least > error) | MASK(most < -error)) & MASK(near < -error_s) & MASK(far > error_s);
  *hit = sure & ~miss;
  *undecided = ~sure & ~miss;
}

/* Slot s: a ray against a block of its candidates. blocked[ray] becomes 1 on a sure hit (all writers write
 * 1); doubt[s] = lanes that need the exact predicate, 0 when another lane of the block blocks the ray anyway.
 */
__kernel void chop_test_any(uint slots, __global const uint* owner, __global const uint* rank,
                            __global const uint* piece_ray, __global const uint* piece_cell,
                            __global const float* frame, __global const uint* first_block,
                            __global const float* packets, __global const uint* triangle,
                            __global const uint* plane, __global const uint* from, __global const uint* to,
                            uint run, uint pairs, __global uint* blocked, __global uint* doubt) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  uint p = owner[s], r = piece_ray[p], cell = piece_cell[p];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  lanes_int hit, undecided;
  test_block(load_ray(ends_of(from, to, run, pairs, r)), first_block[v] + rank[s], packets, triangle, plane,
             &hit, &undecided);
  int verdict = any_bits((hit & HIT_BIT) | (undecided & LANE_BITS));
  if (verdict & HIT_BIT) blocked[r] = 1;
  doubt[s] = verdict & HIT_BIT ? 0u : (uint)verdict;
}

ALWAYS_INLINE clrad_segment whole_segment(ray_ends e) {
  clrad_segment s;
  s.ax = as_float(e.a[0]);
  s.ay = as_float(e.a[1]);
  s.az = as_float(e.a[2]);
  s.ax_lo = as_float(e.a[3]);
  s.ay_lo = as_float(e.a[4]);
  s.az_lo = as_float(e.a[5]);
  s.bx = as_float(e.b[0]);
  s.by = as_float(e.b[1]);
  s.bz = as_float(e.b[2]);
  s.bx_lo = as_float(e.b[3]);
  s.by_lo = as_float(e.b[4]);
  s.bz_lo = as_float(e.b[5]);
  s.a_plane = e.a[6];
  s.b_plane = e.b[6];
  return s;
}

/* The undecided lanes of the slots in `list`, exactly. */
__kernel void chop_exact_any(uint n, __global const uint* list, __global const uint* owner,
                             __global const uint* rank, __global const uint* piece_ray,
                             __global const uint* piece_cell, __global const float* frame,
                             __global const uint* first_block, __global const uint* triangle,
                             __global const clrad_triangle* triangles, __global const uint* from,
                             __global const uint* to, uint run, uint pairs, __global const uint* doubt,
                             __global uint* blocked) {
  uint i = get_global_id(0);
  if (i >= n) return;
  uint s = list[i], p = owner[s], r = piece_ray[p], cell = piece_cell[p], lanes = doubt[s];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  uint first = (first_block[v] + rank[s]) * CLRAD_WIDTH;
  clrad_segment segment = whole_segment(ends_of(from, to, run, pairs, r));
  int hit = 0;
  for (uint l = 0; l < CLRAD_WIDTH && !hit; ++l)
    if (lanes >> l & 1u) hit = clrad_blocked(segment, triangles[triangle[first + l]]);
  if (hit) blocked[r] = 1;
}

/* As above for the nearest hit: slot_t[s], slot_triangle[s] of the block, INFINITY and CLRAD_NONE without
 * one. Of equal t the lower triangle: lanes are in ascending order. */
__kernel void chop_test_nearest(uint slots, __global const uint* owner, __global const uint* rank,
                                __global const uint* piece_ray, __global const uint* piece_cell,
                                __global const float* frame, __global const uint* first_block,
                                __global const float* packets, __global const uint* triangle,
                                __global const uint* plane, __global const clrad_triangle* triangles,
                                __global const clrad_facet* facets, __global const uint* from,
                                __global const uint* to, uint run, uint pairs, __global float* slot_t,
                                __global uint* slot_triangle, __global uint* doubt) {
  uint s = get_global_id(0);
  if (s >= slots) return;
  uint p = owner[s], r = piece_ray[p], cell = piece_cell[p];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  uint block = first_block[v] + rank[s];
  lanes_int hit, undecided;
  test_block(load_ray(ends_of(from, to, run, pairs, r)), block, packets, triangle, plane, &hit, &undecided);
  uint hits = (uint)any_bits(hit & LANE_BITS);
  doubt[s] = (uint)any_bits(undecided & LANE_BITS);
  float best = INFINITY;
  uint which = CLRAD_NONE;
  if (hits) {
    clrad_segment segment = whole_segment(ends_of(from, to, run, pairs, r));
    for (uint l = 0; l < CLRAD_WIDTH; ++l) {
      if (!(hits >> l & 1u)) continue;
      uint k = triangle[block * CLRAD_WIDTH + l];
      float t = clrad_hit_parameter(segment, triangles[k], facets[k]);
      if (t < best) {
        best = t;
        which = k;
      }
    }
  }
  slot_t[s] = best;
  slot_triangle[s] = which;
}

__kernel void chop_exact_nearest(uint n, __global const uint* list, __global const uint* owner,
                                 __global const uint* rank, __global const uint* piece_ray,
                                 __global const uint* piece_cell, __global const float* frame,
                                 __global const uint* first_block, __global const uint* triangle,
                                 __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                 __global const uint* from, __global const uint* to, uint run, uint pairs,
                                 __global const uint* doubt, __global float* slot_t,
                                 __global uint* slot_triangle) {
  uint i = get_global_id(0);
  if (i >= n) return;
  uint s = list[i], p = owner[s], r = piece_ray[p], cell = piece_cell[p], lanes = doubt[s];
  uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
  uint first = (first_block[v] + rank[s]) * CLRAD_WIDTH;
  clrad_segment segment = whole_segment(ends_of(from, to, run, pairs, r));
  float best = slot_t[s];
  uint which = slot_triangle[s];
  for (uint l = 0; l < CLRAD_WIDTH; ++l) {
    if (!(lanes >> l & 1u)) continue;
    uint k = triangle[first + l];
    if (!clrad_blocked(segment, triangles[k])) continue;
    float t = clrad_hit_parameter(segment, triangles[k], facets[k]);
    if (t < best || (t == best && k < which)) {
      best = t;
      which = k;
    }
  }
  slot_t[s] = best;
  slot_triangle[s] = which;
}

/* ---- results
 * ------------------------------------------------------------------------------------------------------ */

/* positions[i] = offsets[positions[i]]: from slots of one allocation to slots of the next. */
__kernel void chop_follow(uint n, __global const uint* offsets, __global uint* positions) {
  uint i = get_global_id(0);
  if (i < n) positions[i] = offsets[positions[i]];
}

/* Takes the segmented min of a wave over into its rays (use_alive: alive[i], else i): at[i] is the first slot
 * of the nearest t; a later slot may hold a lower triangle at the same t. */
__kernel void chop_nearest(uint n, __global const uint* offsets, __global const float* least,
                           __global const uint* at, __global const float* slot_t,
                           __global const uint* slot_triangle, __global const uint* alive, uint use_alive,
                           __global float* ray_t, __global uint* ray_triangle) {
  uint i = get_global_id(0);
  if (i >= n || at[i] == CLRAD_NONE) return;
  uint r = use_alive ? alive[i] : i, which = ray_triangle[r];
  float t = least[i];
  if (t == INFINITY || t > ray_t[r]) return;
  if (t < ray_t[r]) which = CLRAD_NONE;
  for (uint s = at[i]; s < offsets[i + 1]; ++s)
    if (slot_t[s] == t && slot_triangle[s] < which) which = slot_triangle[s];
  ray_t[r] = t;
  ray_triangle[r] = which;
}

/* flags[r] = the ray goes on and nothing has blocked it. */
__kernel void chop_alive(uint rays, __global const uint* more, __global const uint* blocked,
                         __global uint* flags) {
  uint r = get_global_id(0);
  if (r < rays) flags[r] = more[r] & (blocked[r] ^ 1u);
}

/* Word w of the batch: bit k of chosen origin first_origin + w / words is its ray 32 (w % words) + k. */
__kernel void chop_masks(uint count, uint first_origin, uint first_word, uint words, uint words_per_origin,
                         uint run, __global const uint* blocked, __global uint* masks) {
  uint w = get_global_id(0);
  if (w >= count) return;
  uint begin = w % words * 32u, end = begin + 32u < run ? begin + 32u : run, bits = 0;
  __global const uint* from = blocked + w / words * run;
  for (uint k = begin; k < end; ++k) bits |= from[k] << (k - begin);
  masks[(ulong)(first_origin + w / words) * words_per_origin + first_word + w % words] = bits;
}

/* Results of the batch, from segment `first` on; triangles by their number in the input, t = 1 without a hit.
 */
__kernel void chop_results(uint rays, ulong first, __global const float* ray_t,
                           __global const uint* ray_triangle, __global const uint* input_index,
                           __global uint* triangle, __global float* t) {
  uint r = get_global_id(0);
  if (r >= rays) return;
  uint k = ray_triangle[r];
  triangle[first + r] = CLRAD_NONE;
  t[first + r] = 1.0f;
  if (k != CLRAD_NONE) {
    triangle[first + r] = input_index[k];
    t[first + r] = ray_t[r];
  }
}

/* ---- counts
 * ------------------------------------------------------------------------------------------------------- */

/* sums: `items` counts of candidates, as many of exact tests, and of pieces that have candidates. Work-item i
 * adds its share of the pieces. */
__kernel void chop_tally_candidates(uint items, uint pieces, __global const uint* piece_cell,
                                    __global const uint* counts, __global const float* frame,
                                    __global const uint* held, __global ulong* sums) {
  uint i = get_global_id(0);
  if (i >= items) return;
  uint begin = (uint)((ulong)pieces * i / items), end = (uint)((ulong)pieces * (i + 1) / items);
  ulong sum = 0, busy = 0;
  for (uint p = begin; p < end; ++p) {
    uint cell = piece_cell[p];
    uint v = ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
    sum += counts[p] ? held[v] : 0u;
    busy += counts[p] ? 1u : 0u;
  }
  sums[i] += sum;
  sums[2 * items + i] += busy;
}

__kernel void chop_tally_exact(uint items, uint n, __global const uint* list, __global const uint* doubt,
                               __global ulong* sums) {
  uint i = get_global_id(0);
  if (i >= items) return;
  uint begin = (uint)((ulong)n * i / items), end = (uint)((ulong)n * (i + 1) / items);
  ulong sum = 0;
  for (uint p = begin; p < end; ++p) sum += popcount(doubt[list[p]]);
  sums[items + i] += sum;
}

__kernel void chop_fold(uint n, __global const ulong* from, __global ulong* to) {
  uint i = get_global_id(0);
  if (i < n) to[i] += from[i];
}
