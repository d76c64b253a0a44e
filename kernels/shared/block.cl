/* One ray against a block of CLRAD_WIDTH triangles: the fast test of shared/triangle.cl with fewer operations.
 *
 * With A = v0 - a, D = b - a, R = A x D:
 *   U_0 = e_0 . R,  U_2 = e_2 . R,  P = D . N,  U_1 = -P - U_0 - U_2    (the three volumes add up to -D . N)
 *   S_a = -N . A,   S_b = S_a + P
 *
 * Errors, with the notation and the steps of that file, X = |D|_max edge_size |A|_1 and Y = normal_size |D|_1:
 *   U_0, U_2: products 5u, difference 6u, times e 7u and rounded 8u, summed 10u:            10u X
 *   P:        N 1u, D 2u, product 4u, summed 6u:                                            6u Y
 *   U_1:      20u X + 6u Y, and its two roundings u (|P| + |U_0|) + u (|P| + |U_0| + |U_2|) <= 2u Y + 3u X
 *   E_U = 26u X + 10u Y + 2^-80 |D|_max holds for all three, terms in u^2 and the rounding of the bound included.
 *   S_a:      6u normal_size |A|_1
 *   S_b:      that, 6u Y, and a rounding of u (normal_size |A|_1 + Y)
 *   E_S = 10u normal_size (|A|_1 + |D|_1) + 2^-110 holds for both. */
#ifndef CLRAD_BLOCK_CL
#define CLRAD_BLOCK_CL
#include "shared/ends.cl"
#include "shared/packet.cl"
#include "shared/triangle.cl"

#if CLRAD_WIDTH == 1
typedef uint clrad_uints;
#else
typedef CLRAD_PASTE(uint, CLRAD_WIDTH) clrad_uints;
#endif
#define LOAD_FLOATS(at, p) CLRAD_LOAD((p) + (at) * CLRAD_WIDTH)
#define LOAD_UINTS(at, p) CLRAD_LOAD((p) + (at) * CLRAD_WIDTH)

/* Words of a block in `packets`: floats x0 y0 z0 and their low parts, edges 0 and 2, normal, the two sizes. */
#define PACKET_FLOATS 17
#define BLOCK_VOLUME_ERROR 0x1.ap-20f /* 26u */
#define BLOCK_PLANE_ERROR 0x1.4p-21f  /* 10u */

/* Writes lane i % CLRAD_WIDTH of block i / CLRAD_WIDTH. */
static inline void put_lane(clrad_triangle t, clrad_facet f, __global float* packets, uint i) {
  __global float* p = packets + (size_t)(i / CLRAD_WIDTH) * (PACKET_FLOATS * CLRAD_WIDTH) + i % CLRAD_WIDTH;
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

typedef struct ray_data {
  float ax, ay, az, ax_lo, ay_lo, az_lo;
  float dx, dy, dz;
  uint a_plane, b_plane;
} ray_data;

static inline ray_data load_ray(ray_ends e) {
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
static inline void test_block(ray_data s, uint block, __global const float* packets,
                              __global const uint* plane, clrad_ints* hit,
                              clrad_ints* undecided) {
  __global const float* p = packets + block * (PACKET_FLOATS * CLRAD_WIDTH);
  clrad_floats x = (LOAD_FLOATS(0, p) - s.ax) + (LOAD_FLOATS(3, p) - s.ax_lo);
  clrad_floats y = (LOAD_FLOATS(1, p) - s.ay) + (LOAD_FLOATS(4, p) - s.ay_lo);
  clrad_floats z = (LOAD_FLOATS(2, p) - s.az) + (LOAD_FLOATS(5, p) - s.az_lo);
  clrad_floats rx = y * s.dz - z * s.dy, ry = z * s.dx - x * s.dz, rz = x * s.dy - y * s.dx;
  clrad_floats u0 = CLRAD_DOT(LOAD_FLOATS(6, p), LOAD_FLOATS(7, p), LOAD_FLOATS(8, p), rx, ry, rz);
  clrad_floats u2 = CLRAD_DOT(LOAD_FLOATS(9, p), LOAD_FLOATS(10, p), LOAD_FLOATS(11, p), rx, ry, rz);
  clrad_floats nx = LOAD_FLOATS(12, p), ny = LOAD_FLOATS(13, p), nz = LOAD_FLOATS(14, p);
  clrad_floats facing = CLRAD_DOT(nx, ny, nz, s.dx, s.dy, s.dz);
  clrad_floats u1 = -(facing + u0) - u2;
  clrad_floats side_a = -CLRAD_DOT(nx, ny, nz, x, y, z), side_b = side_a + facing;

  clrad_floats edge_size = LOAD_FLOATS(15, p), normal_size = LOAD_FLOATS(16, p);
  clrad_floats norm = CLRAD_NORM_1(x, y, z);
  float length = CLRAD_NORM_1(s.dx, s.dy, s.dz);
  float size = CLRAD_MAX(CLRAD_MAX(fabs(s.dx), fabs(s.dy)), fabs(s.dz));
  clrad_floats error = norm * edge_size * (size * BLOCK_VOLUME_ERROR) +
                      normal_size * (length * BLOCK_PLANE_ERROR) + size * CLRAD_VOLUME_FLOOR;
  clrad_floats error_s = (norm + length) * (normal_size * BLOCK_PLANE_ERROR) + CLRAD_SIDE_FLOOR;

  clrad_floats least = u0 < u1 ? u0 : u1, most = u0 > u1 ? u0 : u1;
  least = least < u2 ? least : u2;
  most = most > u2 ? most : u2;
  clrad_floats near = side_a < side_b ? side_a : side_b, far = side_a > side_b ? side_a : side_b;
  clrad_uints q = LOAD_UINTS(block, plane);
  clrad_ints ignored = CLRAD_IS(q != CLRAD_NONE) & (CLRAD_IS(q == s.a_plane) | CLRAD_IS(q == s.b_plane));
  clrad_ints miss =
      (CLRAD_IS(least < -error) & CLRAD_IS(most > error)) | CLRAD_IS(near > error_s) | CLRAD_IS(far < -error_s) | ignored;
  clrad_ints sure = (CLRAD_IS(least > error) | CLRAD_IS(most < -error)) & CLRAD_IS(near < -error_s) & CLRAD_IS(far > error_s);
  *hit = sure & ~miss;
  *undecided = ~sure & ~miss;
}

#endif
