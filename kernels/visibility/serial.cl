/* Object-serial / ray-parallel visibility (Drucker & Schroeder, section 1.3.1): every work-item holds CLRAD_WIDTH rays
 * in vectors and goes over all triangles, which are read as scalars; with few origins vectors hold triangles instead. No
 * structure, no candidates, no early out but for rays that are blocked already: the baseline that the other engines are
 * measured against, at the speed the device's arithmetic allows.
 *
 * Tests are those of shared/triangle.cl, in vectors; pairs that the floats cannot tell go to shared/predicate.cl, one
 * lane at a time. `exact` (two words) counts them.
 */
#include "shared/block.cl"
#include "shared/packet.cl"
#include "shared/packet_test.cl"
#include "shared/triangle.cl"

#define CHUNK 16 /* samples kept at a time; a power of two, at least the widest packet, at most 32 */
#define FEW 16   /* origins for which CLRAD_WIDTH triangles are loaded once */

/* Occlusion bits of CLRAD_WIDTH origins against 32 samples by one of `ranges` runs of triangles; work-item = (run, tile of
 * origins, word of samples), so that few rays among many triangles keep a device busy, too.
 * Lanes are origins. What depends on (origin, triangle) alone is computed once for CHUNK samples, and a sample's side
 * of the triangle's plane once for all lanes: the rest is three dot products a ray.
 * pre: samples > 0, words = ceil(samples / 32). post: masks[(range * origin_count + origin) * words + word], unused bits 0. */
__kernel void serial_occluded(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                              uint origin_count, __global const CLRAD_POINT_T* targets, uint samples, uint words,
                              __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                              uint triangle_count, uint ranges, __global uint* masks, volatile __global uint* exact) {
  const uint tiles = (origin_count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const ulong item = get_global_id(0);
  const uint range = (uint)(item / ((ulong)tiles * words)), rest = (uint)(item - (ulong)range * tiles * words);
  if (range >= ranges) return;
  const uint tile = rest / words, word = rest % words;
  const uint first_triangle = (uint)((ulong)triangle_count * range / ranges);
  const uint last_triangle = (uint)((ulong)triangle_count * (range + 1) / ranges);

  float a[6][CLRAD_WIDTH];
  int a_plane_lanes[CLRAD_WIDTH], valid_lanes[CLRAD_WIDTH];
  for (int lane = 0; lane < CLRAD_WIDTH; ++lane) {
    uint chosen = tile * CLRAD_WIDTH + lane;
    valid_lanes[lane] = chosen < origin_count ? -1 : 0;
    chosen = chosen < origin_count ? chosen : origin_count - 1;
    __global const CLRAD_POINT_T* p = origins + (use_active ? active[chosen] : chosen);
    const clrad_end s = clrad_snap_point(p);
    a[0][lane] = s.x;
    a[1][lane] = s.y;
    a[2][lane] = s.z;
    a[3][lane] = s.x_lo;
    a[4][lane] = s.y_lo;
    a[5][lane] = s.z_lo;
    a_plane_lanes[lane] = (int)s.plane;
  }
  const clrad_floats ax = CLRAD_LOAD(a[0]), ay = CLRAD_LOAD(a[1]), az = CLRAD_LOAD(a[2]);
  const clrad_floats ax_lo = CLRAD_LOAD(a[3]), ay_lo = CLRAD_LOAD(a[4]), az_lo = CLRAD_LOAD(a[5]);
  const clrad_ints a_plane = CLRAD_LOAD(a_plane_lanes), valid = CLRAD_LOAD(valid_lanes);

  const uint first = word * 32, in_word = min(samples - first, 32u);
  uint undecided_count = 0;
  clrad_ints result = 0;
  for (uint begin = 0; begin < in_word; begin += CHUNK) {
    const uint in_chunk = min(in_word - begin, (uint)CHUNK);
    float b[6][CHUNK];
    uint b_plane[CHUNK];
    clrad_floats dx[CHUNK], dy[CHUNK], dz[CHUNK], size[CHUNK];
    int one_plane = 1;
    for (uint k = 0; k < CHUNK; ++k) {
      const uint sample = first + begin + min(k, in_chunk - 1);
      __global const CLRAD_POINT_T* p = targets + sample;
      const clrad_end s = clrad_snap_point(p);
      b[0][k] = s.x;
      b[1][k] = s.y;
      b[2][k] = s.z;
      b[3][k] = s.x_lo;
      b[4][k] = s.y_lo;
      b[5][k] = s.z_lo;
      b_plane[k] = s.plane;
      one_plane &= s.plane == b_plane[0];
      dx[k] = CLRAD_DIFFERENCE(s.x, s.x_lo, ax, ax_lo);
      dy[k] = CLRAD_DIFFERENCE(s.y, s.y_lo, ay, ay_lo);
      dz[k] = CLRAD_DIFFERENCE(s.z, s.z_lo, az, az_lo);
      const clrad_floats mx = fabs(dx[k]), my = fabs(dy[k]), mz = fabs(dz[k]), mxy = CLRAD_MAX(mx, my);
      size[k] = CLRAD_MAX(mxy, mz);
    }

    clrad_ints todo = valid & (int)((1u << in_chunk) - 1); /* bit k: sample k is not known to be blocked */
    const clrad_ints asked = todo;
    for (uint i = first_triangle; i < last_triangle; ++i) {
      __global const clrad_triangle* t = triangles + i;
      __global const clrad_facet* f = facets + i;

      /* Sides of the plane: the samples' as two uniform bit masks, the origins' as lane masks. */
      clrad_ints side_bits = 0;
      for (int k = 0; k < CHUNK; k += CLRAD_WIDTH) {
        const clrad_floats rx = CLRAD_DIFFERENCE(CLRAD_LOAD(b[0] + k), CLRAD_LOAD(b[3] + k), t->x0, t->x0_lo);
        const clrad_floats ry = CLRAD_DIFFERENCE(CLRAD_LOAD(b[1] + k), CLRAD_LOAD(b[4] + k), t->y0, t->y0_lo);
        const clrad_floats rz = CLRAD_DIFFERENCE(CLRAD_LOAD(b[2] + k), CLRAD_LOAD(b[5] + k), t->z0, t->z0_lo);
        const clrad_floats norm = CLRAD_NORM_1(rx, ry, rz), error = CLRAD_SIDE_BOUND(norm, f->normal_size);
        const clrad_floats side = CLRAD_DOT(f->nx, f->ny, f->nz, rx, ry, rz);
        const clrad_ints bit = CLRAD_LANE_BITS(k);
        side_bits |= (CLRAD_IS(side > error) & bit) | (CLRAD_IS(side < -error) & (bit << CHUNK));
      }
      const int sides = clrad_bits_of_any(side_bits);
      const int front_b = sides & ((1 << CHUNK) - 1), back_b = (int)((uint)sides >> CHUNK);
      const uint plane = t->plane;
      int ignored_b = plane != CLRAD_NONE && one_plane && plane == b_plane[0] ? -1 : 0;
      if (plane != CLRAD_NONE && !one_plane)
        for (int k = 0; k < CHUNK; ++k) ignored_b |= plane == b_plane[k] ? 1 << k : 0;

      const clrad_floats px = CLRAD_DIFFERENCE(t->x0, t->x0_lo, ax, ax_lo);
      const clrad_floats py = CLRAD_DIFFERENCE(t->y0, t->y0_lo, ay, ay_lo);
      const clrad_floats pz = CLRAD_DIFFERENCE(t->z0, t->z0_lo, az, az_lo);
      const clrad_floats norm_a = CLRAD_NORM_1(px, py, pz), error_a = CLRAD_SIDE_BOUND(norm_a, f->normal_size);
      const clrad_floats side_a = -CLRAD_DOT(f->nx, f->ny, f->nz, px, py, pz);
      const clrad_ints front_a = CLRAD_IS(side_a > error_a), back_a = CLRAD_IS(side_a < -error_a);
      const clrad_ints ignored_a = CLRAD_IS(a_plane == (int)plane) & (plane != CLRAD_NONE ? -1 : 0);
      const clrad_ints open = todo & ~(ignored_a | ignored_b | (front_a & front_b) | (back_a & back_b));
      const int needed = clrad_bits_of_any(open);
      if (needed == 0) continue;
      const clrad_ints crossed = (front_a & back_b) | (back_a & front_b);

      const clrad_floats qx = CLRAD_DIFFERENCE(t->x1, t->x1_lo, ax, ax_lo);
      const clrad_floats qy = CLRAD_DIFFERENCE(t->y1, t->y1_lo, ay, ay_lo);
      const clrad_floats qz = CLRAD_DIFFERENCE(t->z1, t->z1_lo, az, az_lo);
      const clrad_floats c0x = CLRAD_CROSS(f->e0y, f->e0z, py, pz), c0y = CLRAD_CROSS(f->e0z, f->e0x, pz, px),
                         c0z = CLRAD_CROSS(f->e0x, f->e0y, px, py);
      const clrad_floats c1x = CLRAD_CROSS(f->e1y, f->e1z, qy, qz), c1y = CLRAD_CROSS(f->e1z, f->e1x, qz, qx),
                         c1z = CLRAD_CROSS(f->e1x, f->e1y, qx, qy);
      const clrad_floats c2x = CLRAD_CROSS(f->e2y, f->e2z, py, pz), c2y = CLRAD_CROSS(f->e2z, f->e2x, pz, px),
                         c2z = CLRAD_CROSS(f->e2x, f->e2y, px, py);
      const clrad_floats scale = CLRAD_VOLUME_SCALE(norm_a, f->edge_size);

      /* Only what the vectors decide is in this loop, so that they stay in registers. Sign bits are combined instead of
       * comparing: the sign of a rounded sum is that of the exact one, so U + E < 0 as floats says U < -E. */
      clrad_ints blocked = 0, undecided = 0;
      for (uint k = 0; k < in_chunk; ++k) {
        const int bit = 1 << k;
        if ((needed & bit) == 0) continue;
        const clrad_floats x = dx[k], y = dy[k], z = dz[k], error = size[k] * scale;
        const clrad_floats u0 = CLRAD_DOT(x, y, z, c0x, c0y, c0z), u1 = CLRAD_DOT(x, y, z, c1x, c1y, c1z),
                           u2 = CLRAD_DOT(x, y, z, c2x, c2y, c2z);
        const clrad_ints below_0 = CLRAD_BITS(u0 + error), below_1 = CLRAD_BITS(u1 + error), below_2 = CLRAD_BITS(u2 + error);
        const clrad_ints above_0 = CLRAD_BITS(error - u0), above_1 = CLRAD_BITS(error - u1), above_2 = CLRAD_BITS(error - u2);
        const clrad_ints outside = (below_0 | below_1 | below_2) & (above_0 | above_1 | above_2);
        const clrad_ints near = open & bit & ~(outside >> 31);
        if (clrad_bits_of_any(near) == 0) continue;
        const clrad_ints inside = (below_0 & below_1 & below_2) | (above_0 & above_1 & above_2);
        const clrad_ints sure = near & crossed & (inside >> 31);
        blocked |= sure;
        undecided |= near & ~sure;
      }
      if (clrad_bits_of_any(undecided) != 0) {
        int undecided_lanes[CLRAD_WIDTH], blocked_lanes[CLRAD_WIDTH];
        CLRAD_STORE(undecided, undecided_lanes);
        for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
          blocked_lanes[lane] = 0;
          for (uint k = 0; k < in_chunk; ++k) {
            if ((undecided_lanes[lane] & (1 << k)) == 0) continue;
            const clrad_segment s = {a[0][lane], a[1][lane], a[2][lane], a[3][lane], a[4][lane],
                                     a[5][lane], b[0][k],    b[1][k],    b[2][k],    b[3][k],
                                     b[4][k],    b[5][k],    (uint)a_plane_lanes[lane], b_plane[k]};
            if (clrad_blocked(s, *t)) blocked_lanes[lane] |= 1 << k;
            ++undecided_count;
          }
        }
        blocked |= CLRAD_LOAD(blocked_lanes);
      }
      todo &= ~blocked;
      if (clrad_bits_of_any(todo) == 0) break;
    }
    result |= (asked & ~todo) << (int)begin;
  }

  int words_of_lanes[CLRAD_WIDTH];
  CLRAD_STORE(result, words_of_lanes);
  for (uint lane = 0; lane < CLRAD_WIDTH && tile * CLRAD_WIDTH + lane < origin_count; ++lane)
    masks[((ulong)range * origin_count + tile * CLRAD_WIDTH + lane) * words + word] = (uint)words_of_lanes[lane];
  clrad_count(exact, undecided_count);
}

/* Triangles in blocks as shared/block.cl has them. Work-item = lane; those past the last triangle repeat it.
 * pre: triangle_count > 0. */
__kernel void serial_packets(uint lanes, uint triangle_count, __global const clrad_triangle* triangles,
                             __global const clrad_facet* facets, __global float* packets) {
  const uint i = get_global_id(0);
  if (i >= lanes) return;
  const uint chosen = min(i, triangle_count - 1u);
  put_lane(triangles[chosen], facets[chosen], packets, i);
}

/* What serial_occluded answers, for few origins: lanes are triangles. However few the rays, no lane is idle, loads and what
 * depends on (origin, triangle) alone are shared by a whole vector, and a pair is three dot products without a branch: only
 * one whose volumes do not surely have both signs goes on, to the scalar test.
 * Volumes are those of shared/block.cl as D . (e x A), which has the same bound (shared/triangle.cl, step 3); it is taken for
 * the longest D of the chunk's samples. A ray meets triangles in their order, whatever the width, so `exact` does not depend
 * on it. Work-item = (run, tile of FEW origins, word of samples). pre and post: those of serial_occluded; packets: see
 * serial_packets. */
__kernel void serial_occluded_few(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                                  uint origin_count, __global const CLRAD_POINT_T* targets, uint samples, uint words,
                                  __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                  __global const float* packets, uint triangle_count, uint ranges, __global uint* masks,
                                  volatile __global uint* exact) {
  const uint tiles = (origin_count + FEW - 1) / FEW;
  const ulong item = get_global_id(0);
  const uint range = (uint)(item / ((ulong)tiles * words)), rest = (uint)(item - (ulong)range * tiles * words);
  if (range >= ranges) return;
  const uint tile = rest / words, word = rest % words;
  const uint units = (triangle_count + CHUNK - 1) / CHUNK; /* runs begin with a packet, however wide */
  const uint first_triangle = CHUNK * (uint)((ulong)units * range / ranges);
  const uint last_triangle = min(triangle_count, CHUNK * (uint)((ulong)units * (range + 1) / ranges));
  const uint first_origin = tile * FEW, in_tile = min(origin_count - first_origin, (uint)FEW);
  const uint first = word * 32, in_word = min(samples - first, 32u);

  clrad_end a[FEW];
  uint result[FEW];
  for (uint o = 0; o < in_tile; ++o) {
    a[o] = clrad_snap_point(origins + (use_active ? active[first_origin + o] : first_origin + o));
    result[o] = 0;
  }
  uint undecided_count = 0;
  for (uint begin = 0; begin < in_word; begin += CHUNK) {
    const uint in_chunk = min(in_word - begin, (uint)CHUNK);
    clrad_end b[CHUNK];
    for (uint k = 0; k < in_chunk; ++k) b[k] = clrad_snap_point(targets + first + begin + k);
    float d[FEW][3][CHUNK], size[FEW], length[FEW];
    uint todo[FEW], unfinished = in_tile; /* bit k of todo: sample k is not known to be blocked */
    for (uint o = 0; o < in_tile; ++o) {
      size[o] = length[o] = 0.0f;
      todo[o] = (1u << in_chunk) - 1u;
      for (uint k = 0; k < in_chunk; ++k) {
        const float x = CLRAD_DIFFERENCE(b[k].x, b[k].x_lo, a[o].x, a[o].x_lo);
        const float y = CLRAD_DIFFERENCE(b[k].y, b[k].y_lo, a[o].y, a[o].y_lo);
        const float z = CLRAD_DIFFERENCE(b[k].z, b[k].z_lo, a[o].z, a[o].z_lo);
        d[o][0][k] = x;
        d[o][1][k] = y;
        d[o][2][k] = z;
        const float mx = fabs(x), my = fabs(y), mz = fabs(z), mxy = CLRAD_MAX(mx, my), most = CLRAD_MAX(mxy, mz);
        const float sum = CLRAD_NORM_1(x, y, z);
        size[o] = CLRAD_MAX(size[o], most);
        length[o] = CLRAD_MAX(length[o], sum);
      }
    }

    for (uint i = first_triangle; i < last_triangle && unfinished != 0; i += CLRAD_WIDTH) {
      const clrad_ints there = CLRAD_IS(CLRAD_LANES < (int)min(last_triangle - i, (uint)CLRAD_WIDTH));
      __global const float* q = packets + (size_t)(i / CLRAD_WIDTH) * (PACKET_FLOATS * CLRAD_WIDTH);
      const clrad_floats e0x = LOAD_FLOATS(6, q), e0y = LOAD_FLOATS(7, q), e0z = LOAD_FLOATS(8, q);
      const clrad_floats e2x = LOAD_FLOATS(9, q), e2y = LOAD_FLOATS(10, q), e2z = LOAD_FLOATS(11, q);
      const clrad_floats nx = -LOAD_FLOATS(12, q), ny = -LOAD_FLOATS(13, q), nz = -LOAD_FLOATS(14, q);
      for (uint o = 0; o < in_tile; ++o) {
        if (todo[o] == 0) continue;
        const clrad_floats x = CLRAD_DIFFERENCE(LOAD_FLOATS(0, q), LOAD_FLOATS(3, q), a[o].x, a[o].x_lo);
        const clrad_floats y = CLRAD_DIFFERENCE(LOAD_FLOATS(1, q), LOAD_FLOATS(4, q), a[o].y, a[o].y_lo);
        const clrad_floats z = CLRAD_DIFFERENCE(LOAD_FLOATS(2, q), LOAD_FLOATS(5, q), a[o].z, a[o].z_lo);
        const clrad_floats c0x = CLRAD_CROSS(e0y, e0z, y, z), c0y = CLRAD_CROSS(e0z, e0x, z, x),
                           c0z = CLRAD_CROSS(e0x, e0y, x, y);
        const clrad_floats c2x = CLRAD_CROSS(e2y, e2z, y, z), c2y = CLRAD_CROSS(e2z, e2x, z, x),
                           c2z = CLRAD_CROSS(e2x, e2y, x, y);
        const clrad_floats error = CLRAD_NORM_1(x, y, z) * LOAD_FLOATS(15, q) * (size[o] * BLOCK_VOLUME_ERROR) +
                                   LOAD_FLOATS(16, q) * (length[o] * BLOCK_PLANE_ERROR) + size[o] * CLRAD_VOLUME_FLOOR;

        /* Sign bits instead of comparing, as above. Only what all pairs need is in this loop. */
        clrad_ints outside[CHUNK], all_outside = -1;
        for (uint left = todo[o]; left != 0; left &= left - 1u) {
          const uint k = 31u - clz(left & (0u - left));
          const float dx = d[o][0][k], dy = d[o][1][k], dz = d[o][2][k];
          const clrad_floats u0 = CLRAD_DOT(c0x, c0y, c0z, dx, dy, dz), u2 = CLRAD_DOT(c2x, c2y, c2z, dx, dy, dz);
          const clrad_floats u1 = (CLRAD_DOT(nx, ny, nz, dx, dy, dz) - u0) - u2; /* N is negative here */
          const clrad_floats low = CLRAD_MIN(u0, u1), high = CLRAD_MAX(u0, u1);
          const clrad_floats least = CLRAD_MIN(low, u2), most = CLRAD_MAX(high, u2);
          outside[k] = CLRAD_BITS(least + error) & CLRAD_BITS(error - most);
          all_outside &= outside[k];
        }
        if (clrad_bits_of_any(there & ~all_outside) >= 0) continue;

        clrad_ints near = 0; /* bit k: sample k */
        for (uint left = todo[o]; left != 0; left &= left - 1u) {
          const uint k = 31u - clz(left & (0u - left));
          near |= there & ~(outside[k] >> 31) & (int)(1u << k);
        }
        for (uint some = (uint)clrad_bits_of_any(near); some != 0; some &= some - 1u) {
          const uint bit = some & (0u - some), k = 31u - clz(bit);
          const clrad_segment s = {a[o].x, a[o].y, a[o].z,    a[o].x_lo, a[o].y_lo, a[o].z_lo, b[k].x,
                                   b[k].y, b[k].z, b[k].x_lo, b[k].y_lo, b[k].z_lo, a[o].plane, b[k].plane};
          uint lanes = (uint)clrad_bits_of_any(CLRAD_IS((near & (int)bit) != 0) & CLRAD_LANE_BITS(0));
          for (; lanes != 0; lanes &= lanes - 1u) {
            const uint chosen = i + 31u - clz(lanes & (0u - lanes));
            if (!clrad_test(s, triangles[chosen], facets[chosen], &undecided_count)) continue;
            todo[o] &= ~bit;
            break;
          }
        }
        unfinished -= todo[o] == 0;
      }
    }
    for (uint o = 0; o < in_tile; ++o) result[o] |= (((1u << in_chunk) - 1u) & ~todo[o]) << begin;
  }
  for (uint o = 0; o < in_tile; ++o)
    masks[((ulong)range * origin_count + first_origin + o) * words + word] = result[o];
  clrad_count(exact, undecided_count);
}

/* masks[i] = any of the `ranges` parts of word i; part r of it is parts[r * words + i]. */
__kernel void serial_merge(uint words, uint ranges, __global const uint* parts, __global uint* masks) {
  const uint i = get_global_id(0);
  if (i >= words) return;
  uint bits = 0;
  for (uint r = 0; r < ranges; ++r) bits |= parts[(ulong)r * words + i];
  masks[i] = bits;
}

/* Occlusion of pairs (Segments::samples == 0): origin i against target i; work-item = (run of triangles, CLRAD_WIDTH
 * segments). post: masks[range * origin_count + i] is 1 or 0. */
__kernel void serial_occluded_pairs(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                                    uint origin_count, __global const CLRAD_POINT_T* targets,
                                    __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                                    uint triangle_count, uint ranges, __global uint* masks,
                                    volatile __global uint* exact) {
  const uint tiles = (origin_count + CLRAD_WIDTH - 1) / CLRAD_WIDTH;
  const ulong item = get_global_id(0);
  const uint range = (uint)(item / tiles), begin = (uint)(item - (ulong)range * tiles) * CLRAD_WIDTH;
  if (range >= ranges) return;
  const uint first_triangle = (uint)((ulong)triangle_count * range / ranges);
  const uint last_triangle = (uint)((ulong)triangle_count * (range + 1) / ranges);
  clrad_segment s[CLRAD_WIDTH];
  int live_lanes[CLRAD_WIDTH], hits[CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    s[lane] = clrad_fetch_segment(origins, active, use_active, targets, 0, min(begin + lane, origin_count - 1));
    live_lanes[lane] = begin + lane < origin_count ? -1 : 0;
  }
  packet p;
  load_packet(s, &p);
  const clrad_ints asked = CLRAD_LOAD(live_lanes);
  clrad_ints live = asked;
  uint undecided_count = 0;
  for (uint i = first_triangle; i < last_triangle && clrad_bits_of_any(live) != 0; ++i)
    live &= ~packet_blocked(s, &p, triangles + i, facets + i, live, &undecided_count);
  const clrad_ints blocked = asked & ~live;
  CLRAD_STORE(blocked, hits);
  for (uint lane = 0; lane < CLRAD_WIDTH && begin + lane < origin_count; ++lane)
    masks[(ulong)range * origin_count + begin + lane] = hits[lane] & 1;
  clrad_count(exact, undecided_count);
}

/* The nearest hit of each segment by (t, triangle); work-item = CLRAD_WIDTH consecutive segments of any form.
 * post: triangle[r] indexes the input triangles or is CLRAD_NONE, t[r] in [0, 1] (1 where there is none). */
__kernel void serial_closest(__global const CLRAD_POINT_T* origins, __global const uint* active, uint use_active,
                             ulong segment_count, __global const CLRAD_POINT_T* targets, uint samples,
                             __global const clrad_triangle* triangles, __global const clrad_facet* facets,
                             uint triangle_count, __global const uint* input_index, __global uint* triangle,
                             __global float* t, volatile __global uint* exact) {
  const ulong begin = (ulong)get_global_id(0) * CLRAD_WIDTH;
  if (begin >= segment_count) return;
  nearest_hits n;
  load_nearest(&n, origins, active, use_active, targets, samples, begin, segment_count);
  for (uint i = 0; i < triangle_count; ++i) meet(&n, triangles + i, facets + i, input_index[i]);
  store_nearest(&n, begin, triangle, t);
  clrad_count(exact, n.exact);
}
