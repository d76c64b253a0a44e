/* Occlusion by chopping rays into voxels (section 1.3.2 of the paper, figure 1.2), a bundle of rays at a time:
 * object-parallel and ray-parallel, in vectors of CLRAD_WIDTH.
 *
 *   per bundle             cut to the grid's box and to the wave, count the x planes crossed  -> allocate
 *   per (bundle, x slab)   the rays' parts in it, count the y planes crossed                  -> allocate
 *   per (..., y slab)      the same along z                                                   -> allocate
 *   per (bundle, voxel)    which rays meet the voxel, triangles in it: 0 drops the piece      -> allocate
 *   per (bundle, block)    intersect the rays that meet the voxel with CLRAD_WIDTH triangles of it
 *   per bundle             which rays are blocked; those take no part in the next wave
 *
 * A bundle is up to CLRAD_WIDTH neighbouring samples of one origin, a lane each, or one ray of Segments' pairs. With
 * width 1 it is one ray and a block one triangle: the paper's processor per ray and candidate. Every ray is cut into
 * exactly the pieces that it would be cut into alone (chop.cl): where it crosses plane i is one function of i, its own
 * parts carry its own t0, t1, and a bundle's piece is a voxel that any of them meets. What a bundle saves is what its
 * rays share: the records of pieces, their allocation, and the triangles of a block, loaded once for all of them with
 * what depends on the origin alone.
 *
 * Wave w holds the part of a bundle in its next slab * 2^w cells along the axis on which it crosses most cells: most rays
 * of a crowded scene are blocked soon, and those that are not should not take many waves.
 * A piece is (bundle, cell, first cell along the next axis, t0 and t1 of each lane; t0 > t1: the ray is not there);
 * cell = x | y << 10 | z << 20. Of the last cut only the lanes are kept, as bits. */
#include "shared/block.cl"
#include "shared/cut.cl"

/* How bundle numbers of a batch stand for rays: bundle b has samples [b % groups * CLRAD_WIDTH, ...) of `run`, from origin
 * b / groups of `from`; in pairs it goes from end b to end b. Targets lie in groups of CLRAD_WIDTH lanes, END_WORDS rows
 * of them each; in pairs they are ends like the origins. */
typedef struct bundle {
  __global const uint *a, *b;
  uint pairs;
  int lanes; /* how many */
} bundle;

static inline bundle bundle_of(__global const uint* from, __global const uint* to, uint run, uint pairs, uint i) {
  const uint groups = (run + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint origin = pairs ? i : i / groups, group = pairs ? i : i - origin * groups;
  bundle b;
  b.a = from + origin * END_WORDS;
  b.b = to + group * (pairs ? END_WORDS : END_WORDS * CLRAD_WIDTH);
  b.pairs = pairs;
  b.lanes = pairs ? 1 : (int)min(run - group * CLRAD_WIDTH, (uint)CLRAD_WIDTH);
  return b;
}

static inline float lane_target(bundle b, uint row, uint lane) {
  return as_float(b.pairs ? b.b[row] : b.b[row * CLRAD_WIDTH + lane]);
}
static inline clrad_floats targets(bundle b, uint row) {
  if (b.pairs) return (clrad_floats)as_float(b.b[row]);
  return CLRAD_LOAD((__global const float*)b.b + row * CLRAD_WIDTH);
}
static inline clrad_floats directions(bundle b, uint axis) {
  return CLRAD_DIFFERENCE(targets(b, axis), targets(b, 3 + axis), as_float(b.a[axis]), as_float(b.a[3 + axis]));
}
static inline clrad_segment lane_segment(bundle b, uint lane) {
  clrad_segment s;
  s.ax = as_float(b.a[0]);
  s.ay = as_float(b.a[1]);
  s.az = as_float(b.a[2]);
  s.ax_lo = as_float(b.a[3]);
  s.ay_lo = as_float(b.a[4]);
  s.az_lo = as_float(b.a[5]);
  s.bx = lane_target(b, 0, lane);
  s.by = lane_target(b, 1, lane);
  s.bz = lane_target(b, 2, lane);
  s.bx_lo = lane_target(b, 3, lane);
  s.by_lo = lane_target(b, 4, lane);
  s.bz_lo = lane_target(b, 5, lane);
  s.a_plane = b.a[6];
  s.b_plane = as_uint(lane_target(b, 6, lane));
  return s;
}

/* Targets first + i of the list, snapped, in groups of lanes; i past `n` repeats the last. */
__kernel void bundle_targets(uint lanes, uint n, uint first, __global const CLRAD_POINT_T* points, __global uint* to) {
  const uint i = get_global_id(0);
  if (i >= lanes) return;
  __global const CLRAD_POINT_T* point = points + first + min(i, n - 1u);
  const clrad_end end = clrad_snap_point(point);
  __global uint* e = to + i / CLRAD_WIDTH * (END_WORDS * CLRAD_WIDTH) + i % CLRAD_WIDTH;
  e[0 * CLRAD_WIDTH] = as_uint(end.x);
  e[1 * CLRAD_WIDTH] = as_uint(end.y);
  e[2 * CLRAD_WIDTH] = as_uint(end.z);
  e[3 * CLRAD_WIDTH] = as_uint(end.x_lo);
  e[4 * CLRAD_WIDTH] = as_uint(end.y_lo);
  e[5 * CLRAD_WIDTH] = as_uint(end.z_lo);
  e[6 * CLRAD_WIDTH] = end.plane;
  e[7 * CLRAD_WIDTH] = 0;
}

/* ---- cutting: the functions of shared/cut.cl in lanes */

/* The cells of an axis that a wave may use, packed with the axis. All cells of all axes: axis 3. */
#define ANY_CELLS (3u << 20)

static inline int first_cell(uint cells, uint axis) {
  return cells >> 20 == axis ? (int)(cells & 1023u) : 0;
}
static inline int last_cell(uint cells, uint axis, __global const float* frame) {
  return cells >> 20 == axis ? (int)(cells >> 10 & 1023u) : convert_int(frame[9 + axis]) - 1;
}

static inline clrad_ints clip_lanes(bundle b, __global const float* frame, clrad_floats* t0, clrad_floats* t1) {
  clrad_floats begin = 0.0f, end = 1.0f;
  clrad_ints inside = -1, moves = 0;
  for (uint a = 0; a < 3; ++a) {
    const float o = as_float(b.a[a]), low = clrad_plane(frame, a, 0), high = clrad_plane(frame, a, convert_int(frame[9 + a]));
    const clrad_floats d = directions(b, a), inverse = 1.0f / d;
    const clrad_floats p = (low - o) * inverse, q = (high - o) * inverse;
    const clrad_floats near = CLRAD_MIN(p, q), far = p < q ? q : p;
    const clrad_ints along = CLRAD_IS(d == 0.0f), moving = ~along;
    begin = (moving & CLRAD_IS(near >= begin)) ? near : begin;
    end = (moving & CLRAD_IS(far <= end)) ? far : end;
    inside &= moving | (clrad_ints)(o >= low && o <= high ? -1 : 0);
    moves |= moving;
  }
  const clrad_ints meets = inside & moves & CLRAD_IS(begin <= end);
  *t0 = begin;
  *t1 = end;
  return meets;
}

static inline clrad_ints cells_of(__global const float* frame, uint axis, clrad_floats x, int low, int high) {
  clrad_floats c = floor((x - frame[axis]) * frame[6 + axis]);
  const clrad_floats l = convert_float(low), h = convert_float(high);
  c = c > l ? c : l;
  c = c < h ? c : h;
  return CLRAD_TO_INTS(c);
}

static inline clrad_floats crossings(__global const float* frame, uint axis, clrad_ints i, float origin, clrad_floats d) {
  return (frame[axis] + CLRAD_TO_FLOATS(i) * frame[3 + axis] - origin) / d;
}

/* The cells [*low, *high] of the axis that the `there` lanes meet between t0 and t1. pre: one is there. */
static inline void hull_of(bundle b, uint axis, uint window, __global const float* frame, clrad_ints there, clrad_floats t0,
                           clrad_floats t1, int* low, int* high) {
  const int first = first_cell(window, axis), last = last_cell(window, axis, frame);
  const float o = as_float(b.a[axis]);
  const clrad_floats d = directions(b, axis);
  const clrad_ints i = cells_of(frame, axis, o + t0 * d, first, last), j = cells_of(frame, axis, o + t1 * d, first, last);
  *low = clrad_least(there ? (i < j ? i : j) : (clrad_ints)1024);
  *high = clrad_most(there ? (i > j ? i : j) : (clrad_ints)-1);
}

/* Cuts every lane's [t0, t1] to cells [low, high] of the axis. Lanes that are not there: t0 > t1. */
static inline clrad_ints cut_lanes(bundle b, uint axis, uint window, __global const float* frame, int low, int high,
                                   clrad_ints there, clrad_floats* t0, clrad_floats* t1) {
  const int first = first_cell(window, axis), last = last_cell(window, axis, frame);
  const float o = as_float(b.a[axis]);
  const clrad_floats d = directions(b, axis), begin = *t0, end = *t1;
  const clrad_ints i = cells_of(frame, axis, o + begin * d, first, last), j = cells_of(frame, axis, o + end * d, first, last);
  const clrad_ints back = CLRAD_IS(d < 0.0f), l = low, h = high;
  const clrad_ints a = back ? (i < h ? i : h) : (i > l ? i : l); /* cells in which the part begins and ends */
  const clrad_ints z = back ? (j > l ? j : l) : (j < h ? j : h);
  clrad_floats enter = crossings(frame, axis, a - back, o, d), leave = crossings(frame, axis, z + 1 + back, o, d);
  enter = enter > begin ? enter : begin;
  enter = enter < end ? enter : end;
  leave = leave > begin ? leave : begin;
  leave = leave < end ? leave : end;
  there &= back ? CLRAD_IS(a >= z) : CLRAD_IS(a <= z);
  *t0 = there ? (CLRAD_IS(a == i) ? begin : enter) : (clrad_floats)1.0f;
  *t1 = there ? (CLRAD_IS(z == j) ? end : leave) : (clrad_floats)0.0f;
  return there;
}

static inline uint voxel_of(uint cell, __global const float* frame) {
  return ((cell >> 20) * (uint)frame[10] + (cell >> 10 & 1023u)) * (uint)frame[9] + (cell & 1023u);
}

/* Writes piece s, which lies in `cell` as far as it is cut, and how many it asks for along `next` (3: blocks). */
static inline void put_piece(bundle b, uint bundle_number, uint cell, uint next, uint window, clrad_ints there,
                             clrad_floats t0, clrad_floats t1, __global const float* frame,
                             __global const uint* first_block, uint s, __global uint* out_bundle, __global uint* out_cell,
                             __global uint* out_low, __global float* out_t, __global uint* counts) {
  const int bits = clrad_bits_of_any(there & CLRAD_LANE_BITS(0));
  uint count = 0, start = 0;
  if (next == 3) {
    const uint v = voxel_of(cell, frame);
    start = (uint)bits;
    if (bits != 0) count = first_block[v + 1] - first_block[v];
  } else {
    if (bits != 0) {
      int low, high;
      hull_of(b, next, window, frame, there, t0, t1, &low, &high);
      start = (uint)low;
      count = (uint)(high - low) + 1u;
    }
    CLRAD_STORE(t0, out_t + s * (2 * CLRAD_WIDTH));
    CLRAD_STORE(t1, out_t + s * (2 * CLRAD_WIDTH) + CLRAD_WIDTH);
  }
  out_bundle[s] = bundle_number;
  out_cell[s] = cell;
  out_low[s] = start;
  counts[s] = count;
}

/* Wave `wave` of bundle alive[i] (of i when use_alive is 0), without its blocked rays. windows[b]: the cells it may use;
 * needs[b]: how many waves take the bundle to its end. slab = 0: all of it is one wave. */
__kernel void bundle_wave(uint count, __global const uint* alive, uint use_alive, uint wave, uint slab,
                          __global const uint* from, __global const uint* to, uint run, uint pairs,
                          __global const float* frame, __global const uint* first_block, uint axis,
                          __global const uint* blocked, __global uint* windows, __global uint* needs,
                          __global uint* piece_bundle, __global uint* piece_cell, __global uint* piece_low,
                          __global float* piece_t, __global uint* counts) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const uint number = use_alive ? alive[i] : i;
  const bundle b = bundle_of(from, to, run, pairs, number);
  clrad_floats t0, t1;
  const clrad_ints meets = clip_lanes(b, frame, &t0, &t1) & CLRAD_IS(CLRAD_LANES < b.lanes);
  clrad_ints there = meets & ~CLRAD_IS((CLRAD_LANE_BITS(0) & (int)blocked[number]) != 0);
  uint window = ANY_CELLS, waves = 1;
  if (slab > 0 && clrad_bits_of_any(meets) != 0) {
    /* From all rays, blocked or not, so that every wave sees the same. */
    uint along = 0;
    int low = 0, high = -1;
    for (uint a = 0; a < 3; ++a) {
      int l, h;
      hull_of(b, a, ANY_CELLS, frame, meets, t0, t1, &l, &h);
      if (a > 0 && h - l <= high - low) continue;
      along = a;
      low = l;
      high = h;
    }
    const int done = (int)(slab * ((1u << wave) - 1u)), cells = high - low + 1, end = min(done + (int)(slab << wave), cells);
    const int back = lane_target(b, along, 0) < as_float(b.a[along]);
    waves = 32u - clz(((uint)cells + slab - 1u) / slab);
    const int first = back ? high + 1 - end : low + done, last = back ? high - done : low + end - 1;
    there = cut_lanes(b, along, ANY_CELLS, frame, first, last, there, &t0, &t1);
    window = along << 20 | (uint)last << 10 | (uint)first;
  }
  windows[number] = window;
  needs[number] = waves;
  t0 = there ? t0 : (clrad_floats)1.0f;
  t1 = there ? t1 : (clrad_floats)0.0f;
  put_piece(b, number, 0, axis, window, there, t0, t1, frame, first_block, i, piece_bundle, piece_cell, piece_low, piece_t,
            counts);
}

/* One cut: slot s is piece rank[s], along `axis`, of the piece owner[s]; counts[s] = what it asks for along `next`. */
__kernel void bundle_cut(uint slots, uint axis, uint next, __global const uint* owner, __global const uint* rank,
                         __global const uint* from, __global const uint* to, uint run, uint pairs,
                         __global const float* frame, __global const uint* first_block, __global const uint* windows,
                         __global const uint* in_bundle, __global const uint* in_cell, __global const uint* in_low,
                         __global const float* in_t, __global uint* out_bundle, __global uint* out_cell,
                         __global uint* out_low, __global float* out_t, __global uint* counts) {
  const uint s = get_global_id(0);
  if (s >= slots) return;
  const uint p = owner[s], number = in_bundle[p], i = in_low[p] + rank[s], window = windows[number];
  const bundle b = bundle_of(from, to, run, pairs, number);
  clrad_floats t0 = CLRAD_LOAD(in_t + p * (2 * CLRAD_WIDTH)), t1 = CLRAD_LOAD(in_t + p * (2 * CLRAD_WIDTH) + CLRAD_WIDTH);
  const clrad_ints there = cut_lanes(b, axis, window, frame, (int)i, (int)i, CLRAD_IS(t0 <= t1), &t0, &t1);
  put_piece(b, number, in_cell[p] | i << (10 * axis), next, window, there, t0, t1, frame, first_block, s, out_bundle,
            out_cell, out_low, out_t, counts);
}

/* ---- testing */

/* Slot s: the rays of a piece against block rank[s] of its voxel. blocked[b] gains the bits of those that are hit. The
 * test is that of shared/block.cl; the volumes as D . (e x A), which has the same bound (shared/triangle.cl, step 3) and
 * leaves two dot products to each ray. Pairs that floats cannot tell go to the exact predicate, unless the ray is
 * surely hit by another triangle of the block; sums[items] counts them. */
__kernel void bundle_test(uint slots, __global const uint* owner, __global const uint* rank,
                          __global const uint* piece_bundle, __global const uint* piece_cell,
                          __global const uint* piece_lanes, __global const float* frame,
                          __global const uint* first_block, __global const float* packets,
                          __global const uint* triangle, __global const uint* plane,
                          __global const clrad_triangle* triangles, __global const uint* from, __global const uint* to,
                          uint run, uint pairs, volatile __global uint* blocked, __global ulong* sums, uint items) {
  const uint s = get_global_id(0);
  if (s >= slots) return;
  const uint p = owner[s], number = piece_bundle[p], block = first_block[voxel_of(piece_cell[p], frame)] + rank[s];
  const bundle b = bundle_of(from, to, run, pairs, number);
  const float ax = as_float(b.a[0]), ay = as_float(b.a[1]), az = as_float(b.a[2]);
  const float ax_lo = as_float(b.a[3]), ay_lo = as_float(b.a[4]), az_lo = as_float(b.a[5]);

  __global const float* q = packets + block * (PACKET_FLOATS * CLRAD_WIDTH);
  const clrad_floats x = CLRAD_DIFFERENCE(LOAD_FLOATS(0, q), LOAD_FLOATS(3, q), ax, ax_lo);
  const clrad_floats y = CLRAD_DIFFERENCE(LOAD_FLOATS(1, q), LOAD_FLOATS(4, q), ay, ay_lo);
  const clrad_floats z = CLRAD_DIFFERENCE(LOAD_FLOATS(2, q), LOAD_FLOATS(5, q), az, az_lo);
  const clrad_floats e0x = LOAD_FLOATS(6, q), e0y = LOAD_FLOATS(7, q), e0z = LOAD_FLOATS(8, q);
  const clrad_floats e2x = LOAD_FLOATS(9, q), e2y = LOAD_FLOATS(10, q), e2z = LOAD_FLOATS(11, q);
  const clrad_floats c0x = CLRAD_CROSS(e0y, e0z, y, z), c0y = CLRAD_CROSS(e0z, e0x, z, x), c0z = CLRAD_CROSS(e0x, e0y, x, y);
  const clrad_floats c2x = CLRAD_CROSS(e2y, e2z, y, z), c2y = CLRAD_CROSS(e2z, e2x, z, x), c2z = CLRAD_CROSS(e2x, e2y, x, y);
  const clrad_floats nx = LOAD_FLOATS(12, q), ny = LOAD_FLOATS(13, q), nz = LOAD_FLOATS(14, q);
  const clrad_floats side_a = -CLRAD_DOT(nx, ny, nz, x, y, z), norm = CLRAD_NORM_1(x, y, z);
  const clrad_floats reach = norm * LOAD_FLOATS(15, q), normal_size = LOAD_FLOATS(16, q);
  const clrad_floats plane_error = normal_size * BLOCK_PLANE_ERROR;
  const clrad_uints planes = LOAD_UINTS(block, plane);
  const clrad_ints in_a_plane = CLRAD_IS(planes != CLRAD_NONE) & CLRAD_IS(planes == b.a[6]);
  const clrad_ints has_plane = CLRAD_IS(planes != CLRAD_NONE);

  uint left = piece_lanes[p], found = 0, undecided_count = 0;
  while (left != 0) {
    const uint lane = 31u - clz(left & (0u - left));
    left &= left - 1u;
    const float dx = CLRAD_DIFFERENCE(lane_target(b, 0, lane), lane_target(b, 3, lane), ax, ax_lo);
    const float dy = CLRAD_DIFFERENCE(lane_target(b, 1, lane), lane_target(b, 4, lane), ay, ay_lo);
    const float dz = CLRAD_DIFFERENCE(lane_target(b, 2, lane), lane_target(b, 5, lane), az, az_lo);
    const uint b_plane = as_uint(lane_target(b, 6, lane));
    const float length = CLRAD_NORM_1(dx, dy, dz), size = CLRAD_MAX(CLRAD_MAX(fabs(dx), fabs(dy)), fabs(dz));
    const clrad_floats u0 = CLRAD_DOT(c0x, c0y, c0z, dx, dy, dz), u2 = CLRAD_DOT(c2x, c2y, c2z, dx, dy, dz);
    const clrad_floats facing = CLRAD_DOT(nx, ny, nz, dx, dy, dz), u1 = -(facing + u0) - u2, side_b = side_a + facing;
    const clrad_floats error =
        reach * (size * BLOCK_VOLUME_ERROR) + normal_size * (length * BLOCK_PLANE_ERROR) + size * CLRAD_VOLUME_FLOOR;
    const clrad_floats error_s = (norm + length) * plane_error + CLRAD_SIDE_FLOOR;
    const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
    const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
    const clrad_floats near = CLRAD_MIN(side_a, side_b), far = CLRAD_MAX(side_a, side_b);
    const clrad_ints ignored = in_a_plane | (has_plane & CLRAD_IS(planes == b_plane));
    const clrad_ints miss =
        (CLRAD_IS(least < -error) & CLRAD_IS(most > error)) | CLRAD_IS(near > error_s) | CLRAD_IS(far < -error_s) | ignored;
    if (clrad_bits_of_any(~miss) == 0) continue;
    const clrad_ints sure =
        (CLRAD_IS(least > error) | CLRAD_IS(most < -error)) & CLRAD_IS(near < -error_s) & CLRAD_IS(far > error_s) & ~miss;
    if (clrad_bits_of_any(sure) != 0) {
      found |= 1u << lane;
      continue;
    }
    uint unsure = (uint)clrad_bits_of_any(~miss & CLRAD_LANE_BITS(0));
    undecided_count += popcount(unsure);
    const clrad_segment segment = lane_segment(b, lane);
    for (uint k = 0; unsure != 0; ++k, unsure >>= 1)
      if ((unsure & 1u) && clrad_blocked(segment, triangles[triangle[block * CLRAD_WIDTH + k]])) {
        found |= 1u << lane;
        break;
      }
  }
  if (found != 0) atomic_or(blocked + number, found);
  clrad_count((volatile __global uint*)(sums + items), undecided_count);
}

/* ---- results */

/* flags[b] = wave `wave` is for the bundle and not all of its rays are blocked. */
__kernel void bundle_alive(uint bundles, uint wave, uint run, uint pairs, __global const uint* needs,
                           __global const uint* blocked, __global uint* flags) {
  const uint b = get_global_id(0);
  if (b >= bundles) return;
  const uint groups = (run + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const uint lanes = pairs ? 1u : min(run - b % groups * CLRAD_WIDTH, (uint)CLRAD_WIDTH);
  flags[b] = needs[b] > wave && popcount(blocked[b]) < lanes ? 1u : 0u;
}

/* Word w of the batch: bit k of chosen origin first_origin + w / words is its ray 32 (w % words) + k. */
__kernel void bundle_masks(uint count, uint first_origin, uint first_word, uint words, uint words_per_origin, uint run,
                           __global const uint* blocked, __global uint* masks) {
  const uint w = get_global_id(0);
  if (w >= count) return;
  const uint groups = (run + CLRAD_WIDTH - 1) / CLRAD_WIDTH, each = 32 / CLRAD_WIDTH;
  const uint begin = w % words * each, end = min(begin + each, groups);
  uint bits = 0;
  for (uint g = begin; g < end; ++g) bits |= blocked[w / words * groups + g] << ((g - begin) * CLRAD_WIDTH);
  masks[(ulong)(first_origin + w / words) * words_per_origin + first_word + w % words] = bits;
}

/* sums: `items` counts of ray/triangle pairs, after 2 * items as many of ray/voxel pieces. Work-item i adds its share of
 * the pieces. */
__kernel void bundle_tally(uint items, uint pieces, __global const uint* piece_cell, __global const uint* piece_lanes,
                           __global const float* frame, __global const uint* held, __global ulong* sums) {
  const uint i = get_global_id(0);
  if (i >= items) return;
  const uint begin = (uint)((ulong)pieces * i / items), end = (uint)((ulong)pieces * (i + 1) / items);
  ulong sum = 0, rays = 0;
  for (uint p = begin; p < end; ++p) {
    const uint n = popcount(piece_lanes[p]);
    sum += (ulong)n * held[voxel_of(piece_cell[p], frame)];
    rays += n;
  }
  sums[i] += sum;
  sums[2 * items + i] += rays;
}
