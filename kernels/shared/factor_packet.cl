/* shared/factor.cl for CLRAD_WIDTH receivers of one shooter at once, one a lane: what that file says of a receiver is said of
 * each, to the bit, as the operations of every lane and their order are those of clrad_exact_factor. What depends on the
 * shooter alone stays scalar, and a Gauss point is taken for all lanes before the next one is.
 *
 * In vectors: receivers that get nothing, far ones (in one cell or in four quarters), and the heights in pairs of those with a
 * grazing view. Lane by lane, by the scalar functions: what the horizon cuts, near receivers and the careful way. Nothing is
 * computed that no lane asks for.
 *
 * pre: CLRAD_WIDTH > 1. */
#ifndef CLRAD_FACTOR_PACKET_CL
#define CLRAD_FACTOR_PACKET_CL
#include "shared/factor.cl"
#include "shared/reals.cl"

#if CLRAD_WIDTH > 1
/* ---- pairs of shared/math.cl, in lanes ------------------------------------------------------------------------------ */

typedef struct clrad_pairs {
  clrad_reals hi, lo;
} clrad_pairs;

static inline clrad_vectors clrad_midpoints(clrad_vectors a, clrad_vectors b) {
  const clrad_vectors m = {(a.x + b.x) * CLRAD_R(0.5), (a.y + b.y) * CLRAD_R(0.5), (a.z + b.z) * CLRAD_R(0.5)};
  return m;
}

static inline clrad_pairs clrad_fast_two_sums(clrad_reals a, clrad_reals b) {
  clrad_pairs r;
  r.hi = a + b;
  r.lo = b - (r.hi - a);
  return r;
}
static inline clrad_pairs clrad_two_sums(clrad_reals a, clrad_reals b) {
  clrad_pairs r;
  r.hi = a + b;
  const clrad_reals part = r.hi - a;
  r.lo = (a - (r.hi - part)) + (b - part);
  return r;
}
static inline clrad_pairs clrad_pairs_add(clrad_pairs a, clrad_pairs b) {
  const clrad_pairs s = clrad_two_sums(a.hi, b.hi), t = clrad_two_sums(a.lo, b.lo);
  const clrad_pairs more = clrad_fast_two_sums(s.hi, s.lo + t.hi);
  return clrad_fast_two_sums(more.hi, more.lo + t.lo);
}
static inline clrad_pairs clrad_pairs_mul(clrad_pairs a, clrad_pairs b) {
  const clrad_reals hi = a.hi * b.hi, ta = CLRAD_SPLIT * a.hi, tb = CLRAD_SPLIT * b.hi;
  const clrad_reals ah = ta - (ta - a.hi), bh = tb - (tb - b.hi), al = a.hi - ah, bl = b.hi - bh;
  const clrad_reals lo = ((ah * bh - hi) + ah * bl + al * bh) + al * bl;
  return clrad_fast_two_sums(hi, lo + (a.hi * b.lo + a.lo * b.hi));
}

/* ---- receivers ---------------------------------------------------------------------------------------------------- */

typedef struct clrad_receivers {
  clrad_vectors p, p_lo, n;
} clrad_receivers;

/* Those whose numbers are listed. */
static inline void clrad_load_receivers(__global const CLRAD_POINT_T* points, const uint* receiver, clrad_receivers* at) {
  REAL v[9][CLRAD_WIDTH];
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    __global const CLRAD_POINT_T* p = points + receiver[lane];
    v[0][lane] = p->x;
    v[1][lane] = p->y;
    v[2][lane] = p->z;
    v[3][lane] = p->x_lo;
    v[4][lane] = p->y_lo;
    v[5][lane] = p->z_lo;
    v[6][lane] = p->nx;
    v[7][lane] = p->ny;
    v[8][lane] = p->nz;
  }
  at->p.x = CLRAD_LOAD(v[0]);
  at->p.y = CLRAD_LOAD(v[1]);
  at->p.z = CLRAD_LOAD(v[2]);
  at->p_lo.x = CLRAD_LOAD(v[3]);
  at->p_lo.y = CLRAD_LOAD(v[4]);
  at->p_lo.z = CLRAD_LOAD(v[5]);
  at->n.x = CLRAD_LOAD(v[6]);
  at->n.y = CLRAD_LOAD(v[7]);
  at->n.z = CLRAD_LOAD(v[8]);
}

/* hi + lo, minus each receiver: differences first, then their sum. */
static inline clrad_vectors clrad_from_receivers(const clrad_receivers* at, REAL x, REAL y, REAL z, REAL x_lo, REAL y_lo,
                                                 REAL z_lo) {
  const clrad_vectors r = {(x - at->p.x) + (x_lo - at->p_lo.x), (y - at->p.y) + (y_lo - at->p_lo.y),
                           (z - at->p.z) + (z_lo - at->p_lo.z)};
  return r;
}

/* normal . (corner - receiver), in pairs: clrad_corner_height. */
static inline clrad_reals clrad_corner_heights(__global const REAL* shooter, uint corner, clrad_pairs nx, clrad_pairs ny,
                                               clrad_pairs nz, const clrad_receivers* at) {
  __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * corner;
  __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * corner;
  const clrad_pairs x = clrad_pairs_add(clrad_two_sums(hi[0], -at->p.x), clrad_two_sums(lo[0], -at->p_lo.x));
  const clrad_pairs y = clrad_pairs_add(clrad_two_sums(hi[1], -at->p.y), clrad_two_sums(lo[1], -at->p_lo.y));
  const clrad_pairs z = clrad_pairs_add(clrad_two_sums(hi[2], -at->p.z), clrad_two_sums(lo[2], -at->p_lo.z));
  return clrad_pairs_add(clrad_pairs_add(clrad_pairs_mul(nx, x), clrad_pairs_mul(ny, y)), clrad_pairs_mul(nz, z)).hi;
}

/* Distances from the shooter's plane: clrad_height. */
static inline clrad_reals clrad_heights(__global const REAL* shooter, const clrad_receivers* at) {
  __global const REAL* n = shooter + CLRAD_SHOOTER_NORMAL;
  return -clrad_corner_heights(shooter, 0, clrad_fast_two_sums(n[0], n[3]), clrad_fast_two_sums(n[1], n[4]),
                               clrad_fast_two_sums(n[2], n[5]), at);
}

/* Whether those heights are positive: clrad_corner_above. */
static inline clrad_masks clrad_corners_above(__global const REAL* shooter, uint corner, clrad_pairs nx, clrad_pairs ny,
                                              clrad_pairs nz, const clrad_receivers* at, clrad_masks asked) {
  __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * corner;
  __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * corner;
  const clrad_vectors r = clrad_from_receivers(at, hi[0], hi[1], hi[2], lo[0], lo[1], lo[2]);
  const clrad_vectors n = {nx.hi, ny.hi, nz.hi};
  const clrad_reals height = clrad_dots(n, r);
  const REAL least = 16 * CLRAD_EPSILON;
  const clrad_masks told = height * height > least * least * clrad_dots(r, r);
  clrad_masks above = height > 0;
  if (clrad_some(asked & ~told)) {
    const clrad_masks accurate = clrad_corner_heights(shooter, corner, nx, ny, nz, at) > 0;
    above = (told & above) | (~told & accurate);
  }
  return above;
}

/* ---- Gauss sums ---------------------------------------------------------------------------------------------------- */

/* One term of clrad_cell_sum. */
static inline clrad_reals clrad_gauss_terms(const clrad_vectors* r, const clrad_reals* z, const REAL* jacobian, int point) {
  const REAL u = clrad_gauss_u[point], v = clrad_gauss_v[point], u_ = 1 - u, v_ = 1 - v;
  const REAL c0 = u_ * v_, c1 = u * v_, c2 = u * v, c3 = u_ * v;
  const clrad_reals x = r[0].x * c0 + r[1].x * c1 + r[2].x * c2 + r[3].x * c3;
  const clrad_reals y = r[0].y * c0 + r[1].y * c1 + r[2].y * c2 + r[3].y * c3;
  const clrad_reals w = r[0].z * c0 + r[1].z * c1 + r[2].z * c2 + r[3].z * c3;
  const clrad_reals above = z[0] * c0 + z[1] * c1 + z[2] * c2 + z[3] * c3;
  const REAL area = jacobian[0] * c0 + jacobian[1] * c1 + jacobian[2] * c2 + jacobian[3] * c3;
  const clrad_reals per = 1 / (x * x + y * y + w * w);
  return clrad_gauss_weight[point] * (above * per) * (area * per);
}

/* clrad_cell_sum; the jacobians are the shooter's. Terms are summed as clrad_lanes_sum does: those 8 apart, then 4, 2, 1. */
static inline clrad_reals clrad_cell_sums(const clrad_vectors* r, const clrad_reals* z, const REAL* jacobian) {
  clrad_reals sum = 0;
  for (int block = 0; block < CLRAD_GAUSS_BLOCKS; block++) {
    clrad_reals of_16 = 0;
    for (int i = 0; i < 2; i++) {
      clrad_reals of_8 = 0;
      for (int j = i; j < 4; j += 2) {
        clrad_reals of_4 = 0;
        for (int k = 16 * block + j; k < 16 * block + 8; k += 4)
          of_4 += clrad_gauss_terms(r, z, jacobian, k) + clrad_gauss_terms(r, z, jacobian, k + 8);
        of_8 += of_4;
      }
      of_16 += of_8;
    }
    sum += of_16;
  }
  return sum;
}

/* clrad_quartered_sum. */
static inline clrad_reals clrad_quartered_sums(const clrad_vectors* r, const clrad_reals* z, const REAL* jacobian) {
  clrad_reals sum = 0;
  for (int q = 0; q < 4; q++) {
    const int next = (q + 1) & 3, previous = (q + 3) & 3, opposite = q ^ 2;
    clrad_vectors quarter[4];
    clrad_reals quarter_z[4];
    REAL quarter_j[4];
    quarter[q] = r[q];
    quarter_z[q] = z[q];
    quarter_j[q] = jacobian[q];
    quarter[next] = clrad_midpoints(r[q], r[next]);
    quarter_z[next] = (z[q] + z[next]) * CLRAD_R(0.5);
    quarter_j[next] = clrad_mean(jacobian, q, next);
    quarter[previous] = clrad_midpoints(r[q], r[previous]);
    quarter_z[previous] = (z[q] + z[previous]) * CLRAD_R(0.5);
    quarter_j[previous] = clrad_mean(jacobian, q, previous);
    quarter[opposite] = clrad_midpoints(clrad_midpoints(r[next], r[opposite]), quarter[previous]);
    quarter_z[opposite] = ((z[next] + z[opposite]) * CLRAD_R(0.5) + quarter_z[previous]) * CLRAD_R(0.5);
    quarter_j[opposite] = (clrad_mean(jacobian, next, opposite) + quarter_j[previous]) * CLRAD_R(0.5);
    sum += clrad_cell_sums(quarter, quarter_z, quarter_j);
  }
  return sum * CLRAD_R(0.25);
}

/* ---- factors ------------------------------------------------------------------------------------------------------ */

/* What the horizon leaves of the shooter seen by far receivers: clrad_far_clipped, lane by lane. */
static clrad_reals clrad_far_clipped_lanes(__global const REAL* shooter, const clrad_vectors* r0, const clrad_reals* z,
                                           clrad_masks lanes, clrad_masks far) {
  const clrad_vector front =
      clrad_plus(clrad_load(shooter + CLRAD_SHOOTER_NORMAL), clrad_load(shooter + CLRAD_SHOOTER_NORMAL + 3));
  REAL at[3][CLRAD_WIDTH], heights[4][CLRAD_WIDTH], sums[CLRAD_WIDTH];
  int asked[CLRAD_WIDTH], in_one_cell[CLRAD_WIDTH];
  CLRAD_STORE(r0->x, at[0]);
  CLRAD_STORE(r0->y, at[1]);
  CLRAD_STORE(r0->z, at[2]);
  for (int i = 0; i < 4; i++) CLRAD_STORE(z[i], heights[i]);
  CLRAD_STORE(CLRAD_TO_INTS(lanes), asked);
  CLRAD_STORE(CLRAD_TO_INTS(far), in_one_cell);
  for (uint lane = 0; lane < CLRAD_WIDTH; ++lane) {
    sums[lane] = 0;
    if (!asked[lane]) continue;
    const REAL here[4] = {heights[0][lane], heights[1][lane], heights[2][lane], heights[3][lane]};
    sums[lane] = clrad_far_clipped(shooter, clrad_make(at[0][lane], at[1][lane], at[2][lane]), here, front,
                                   in_one_cell[lane] != 0);
  }
  return CLRAD_LOAD(sums);
}

/* clrad_exact_factor of the `asked` lanes, and 0 of the others. Lanes of *left are still to be asked one by one. */
static inline clrad_reals clrad_exact_factors(__global const REAL* shooter, const clrad_receivers* at, clrad_masks asked,
                                              clrad_masks* left) {
  const clrad_reals none = 0;
  clrad_vectors r[4];
  clrad_reals z[4], nearest2 = CLRAD_R(1e30);
  clrad_masks steep = -1, above = -1, some_above = 0;
  for (int i = 0; i < 4; i++) {
    __global const REAL* hi = shooter + CLRAD_SHOOTER_HI + 3 * i;
    __global const REAL* lo = shooter + CLRAD_SHOOTER_LO + 3 * i;
    r[i] = clrad_from_receivers(at, hi[0], hi[1], hi[2], lo[0], lo[1], lo[2]);
    z[i] = clrad_dots(at->n, r[i]);
    const clrad_reals r2 = clrad_dots(r[i], r[i]);
    nearest2 = r2 < nearest2 ? r2 : nearest2;
    const clrad_reals z2 = z[i] * z[i], noise2 = (64 * CLRAD_EPSILON * CLRAD_EPSILON) * r2;
    const clrad_masks not_below = (z[i] >= 0) | (z2 <= noise2);
    steep &= (z[i] > 0) & (64 * z2 > r2);
    above &= not_below;
    some_above |= not_below;
  }
  const clrad_masks too_near = asked & ~(nearest2 > CLRAD_R(2.5e-10));
  const clrad_vectors middle = {((r[0].x + r[1].x) + (r[2].x + r[3].x)) * CLRAD_R(0.25),
                                ((r[0].y + r[1].y) + (r[2].y + r[3].y)) * CLRAD_R(0.25),
                                ((r[0].z + r[1].z) + (r[2].z + r[3].z)) * CLRAD_R(0.25)};
  const clrad_reals middle2 = clrad_dots(middle, middle);
  const clrad_vector front =
      clrad_plus(clrad_load(shooter + CLRAD_SHOOTER_NORMAL), clrad_load(shooter + CLRAD_SHOOTER_NORMAL + 3));
  const clrad_reals height = -(front.x * middle.x + front.y * middle.y + front.z * middle.z);
  const clrad_masks off_plane = height * height > 64 * CLRAD_EPSILON * CLRAD_EPSILON * middle2;
  const clrad_masks open = asked & ~too_near & some_above & ~((height < 0) & off_plane);

  const clrad_masks distant = middle2 >= CLRAD_R(0.4012) * shooter[CLRAD_SHOOTER_FAR2];
  const clrad_masks one_cell = middle2 >= shooter[CLRAD_SHOOTER_FAR2];
  *left = too_near | (open & ~distant);
  clrad_masks far = open & distant;
  if (!clrad_some(far)) return none;

  const clrad_masks flat = far & ~(64 * height * height > middle2), low = far & ~steep;
  clrad_reals h = height;
  if (clrad_some(flat)) {
    const clrad_reals accurate = clrad_heights(shooter, at);
    h = flat ? accurate : height;
  }
  far &= h > 0;
  clrad_masks clipped = 0;
  if (clrad_some(low)) {
    const clrad_pairs nx = {at->n.x, none}, ny = {at->n.y, none}, nz = {at->n.z, none};
    clrad_reals highest = 0, lowest = 0;
    for (uint i = 0; i < 4; i++) {
      const clrad_reals accurate = clrad_corner_heights(shooter, i, nx, ny, nz, at);
      z[i] = low ? accurate : z[i];
      highest = z[i] > highest ? z[i] : highest;
      lowest = z[i] < lowest ? z[i] : lowest;
    }
    const clrad_masks sliver = far & low & (highest < CLRAD_R(0.125) * (highest - lowest));
    *left |= sliver;
    far &= ~sliver;
    clipped = far & low & (lowest < 0);
  }
  const clrad_masks whole = far & ~clipped, quartered = whole & ~one_cell;
  clrad_reals sum = 0;
  if (clrad_some(clipped)) sum = clrad_far_clipped_lanes(shooter, &r[0], z, clipped, one_cell);
  REAL j[4];
  for (int i = 0; i < 4; i++) j[i] = shooter[CLRAD_SHOOTER_JACOBIAN + i];
  if (clrad_some(whole & one_cell)) {
    const clrad_reals cell = clrad_cell_sums(r, z, j);
    sum = whole & one_cell ? cell : sum;
  }
  if (clrad_some(quartered)) {
    const clrad_reals cells = clrad_quartered_sums(r, z, j);
    sum = quartered ? cells : sum;
  }
  return far ? sum * h / CLRAD_PI : none;
}
#endif
#endif
