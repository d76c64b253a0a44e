/* The rays that mirrors and glass send on: processor allocation, then one work-item a new ray.
 *
 * Why: section 1.5 of Drucker & Schroeder; a specular surface shows what a ray in another direction sees, found by the same
 * intersection kernels. A ray asks for 0 new rays (it ended), 1 (a mirror) or 2 (glass: reflected and refracted), and
 * allocation packs them, so that rays which end leave no idle work-items behind.
 *
 * With cos i = |d . N|, N the normal on the ray's side, and n1, n2 the indices before and behind the surface (Snell; Fresnel
 * for unpolarised light, as in Born & Wolf, section 1.5):
 *     mirrored   d + 2 cos i N
 *     refracted  eta d + (eta cos i - cos t) N,  eta = n1 / n2,  cos^2 t = 1 - eta^2 (1 - cos^2 i); total reflection: < 0
 *     reflected  R of shared/fresnel.cl
 * A solid's front is met from outside, n1 = 1 and n2 = ior, its back from inside, the other way round. A sheet is two such
 * surfaces in one: light between them goes to and fro, which sums to R' = 2 R / (1 + R), and the ray goes straight on.
 * Shares of a band with diffuse reflectance rho, mirror share s and transmission t, rho + s + t <= 1: s + (1 - rho - s) R
 * is reflected and t (1 - R) goes through, so that what glass reflects has no tint and the sum stays below 1 - rho.
 *
 * Pre:  seen[i] of ray i; kinds[polygon] as below; shares[(polygon * 3 + 0, 1, 2) * bands + band] = rho, s, t; box: low x y z,
 *       high x y z, which holds the scene with room to spare; origins' normals are the rays' unit directions.
 * Post: new rays start on the polygon they leave (its plane, hi + lo) and end on the box, in the order of the rays that
 *       asked, reflected before refracted. No new ray where all bands' throughput is below LEAST_THROUGHPUT. */
#include "shared/fresnel.cl"
#include "shared/slab.cl"
#include "shared/surface.cl"

#define MIRROR 1u /* its front reflects; the back is black */
#define SHEET 2u  /* thin glass, both sides alike */
#define SOLID 3u  /* the surface of a solid of glass */

#define LEAST_THROUGHPUT ((REAL)0x1p-12f)

typedef struct fork {
  clrad_vector mirrored, refracted;
  REAL fresnel; /* R, R' or, of a mirror, 0 */
  uint wants;   /* 1: the mirrored ray, 2: the refracted one */
} fork;

REAL share_of(__global const REAL* shares, uint bands, uint band, REAL fresnel, int refracted) {
  const REAL rho = shares[band], s = shares[bands + band], t = shares[2 * bands + band];
  return refracted ? t * ((REAL)1 - fresnel) : s + ((REAL)1 - rho - s) * fresnel;
}

fork fork_of(uint kind, REAL ior, clrad_vector d, __global const REAL* polygon, __global const REAL* shares, uint bands,
             int from_camera, __global const REAL* throughput) {
  fork f;
  clrad_vector normal = clrad_make(polygon[6], polygon[7], polygon[8]);
  REAL cos_i = -clrad_dot(d, normal);
  const int front = cos_i > (REAL)0;
  f.fresnel = 0, f.wants = 0;
  f.mirrored = f.refracted = d;
  if (kind == 0 || (kind == MIRROR && !front)) return f;
  if (!front) cos_i = -cos_i, normal = clrad_scaled(normal, (REAL)-1);
  f.mirrored = clrad_plus(d, clrad_scaled(normal, (REAL)2 * cos_i));
  if (kind != MIRROR) {
    const REAL n1 = kind == SHEET || front ? (REAL)1 : ior, n2 = kind == SHEET || front ? ior : (REAL)1;
    const REAL eta = n1 / n2;
    REAL cos_t;
    f.fresnel = clrad_fresnel(n1, n2, cos_i, &cos_t);
    if (kind == SHEET)
      f.fresnel = clrad_sheet_reflects(f.fresnel);
    else if (cos_t > (REAL)0)
      f.refracted = clrad_plus(clrad_scaled(d, eta), clrad_scaled(normal, eta * cos_i - cos_t));
  }
  for (uint band = 0; band < bands; ++band) {
    const REAL before = from_camera ? (REAL)1 : throughput[band];
    if (before * share_of(shares, bands, band, f.fresnel, 0) >= LEAST_THROUGHPUT) f.wants |= 1u;
    if (before * share_of(shares, bands, band, f.fresnel, 1) >= LEAST_THROUGHPUT) f.wants |= 2u;
  }
  return f;
}

clrad_vector direction_of(CLRAD_POINT_T p) { return clrad_make(p.nx, p.ny, p.nz); }

__kernel void ask_for_rays(__global const CLRAD_POINT_T* origins, __global const uint* seen, uint rays,
                           __global const REAL* polygons, __global const uint* kinds, __global const REAL* ior,
                           __global const REAL* shares, uint bands, uint from_camera, __global const REAL* throughput,
                           __global uint* counts) {
  const uint ray = (uint)get_global_id(0);
  if (ray >= rays) return;
  const uint polygon = seen[ray];
  uint wants = 0;
  if (polygon != CLRAD_NONE && kinds[polygon] != 0)
    wants = fork_of(kinds[polygon], ior[polygon], direction_of(origins[ray]),
                    polygons + (ulong)polygon * CLRAD_POLYGON_REALS, shares + (ulong)polygon * 3 * bands, bands,
                    (int)from_camera, throughput + (from_camera ? 0 : (ulong)ray * bands))
                .wants;
  counts[ray] = (wants & 1u) + (wants >> 1);
}

__kernel void send_rays_on(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* targets,
                           __global const uint* seen, __global const REAL* polygons, __global const REAL* axes,
                           __global const uint* planes, __global const uint* kinds, __global const REAL* ior,
                           __global const REAL* shares, uint bands, uint from_camera, __global const REAL* throughput,
                           __global const REAL* box, __global const uint* owner, __global const uint* rank, uint total,
                           __global CLRAD_POINT_T* new_origins, __global CLRAD_POINT_T* new_targets,
                           __global REAL* new_throughput) {
  const uint i = (uint)get_global_id(0);
  if (i >= total) return;
  const uint ray = owner[i], polygon = seen[ray];
  __global const REAL* table = polygons + (ulong)polygon * CLRAD_POLYGON_REALS;
  __global const REAL* share = shares + (ulong)polygon * 3 * bands;
  __global const REAL* before = throughput + (from_camera ? 0 : (ulong)ray * bands);
  const fork f =
      fork_of(kinds[polygon], ior[polygon], direction_of(origins[ray]), table, share, bands, (int)from_camera, before);
  const int refracted = rank[i] == 1 || f.wants == 2u;
  clrad_vector d = refracted ? f.refracted : f.mirrored;
  d = clrad_scaled(d, (REAL)1 / sqrt(clrad_dot(d, d)));
  for (uint band = 0; band < bands; ++band)
    new_throughput[(ulong)i * bands + band] =
        (from_camera ? (REAL)1 : before[band]) * share_of(share, bands, band, f.fresnel, refracted);

  CLRAD_POINT_T p = clrad_point_on(table, axes + (ulong)polygon * CLRAD_AXES_REALS,
                                   clrad_meet(table, origins + ray, targets + ray), planes[polygon], polygon);
  p.nx = d.x, p.ny = d.y, p.nz = d.z;
  new_origins[i] = p;
  REAL enter = 0, leave = (REAL)1e30f;
  clrad_slab(p.x, d.x, box[0], box[3], &enter, &leave);
  clrad_slab(p.y, d.y, box[1], box[4], &enter, &leave);
  clrad_slab(p.z, d.z, box[2], box[5], &enter, &leave);
  /* Exact products and sums in pairs: the segment has the direction that was computed, however short it is. */
  clrad_pair x, y, z;
  x.hi = p.x, x.lo = p.x_lo;
  y.hi = p.y, y.lo = p.y_lo;
  z.hi = p.z, z.lo = p.z_lo;
  x = clrad_pair_add(x, clrad_two_product(leave, d.x));
  y = clrad_pair_add(y, clrad_two_product(leave, d.y));
  z = clrad_pair_add(z, clrad_two_product(leave, d.z));
  p.x = x.hi, p.y = y.hi, p.z = z.hi;
  p.x_lo = x.lo, p.y_lo = y.lo, p.z_lo = z.lo;
  p.plane = CLRAD_NONE, p.surface = CLRAD_NONE;
  new_targets[i] = p;
}

/* Where each pixel's new rays begin: new_start[pixel] for pixel <= pixels. */
__kernel void find_starts(uint from_camera, uint samples, __global const uint* start, __global const uint* offsets,
                          uint pixels, __global uint* new_start) {
  const uint pixel = (uint)get_global_id(0);
  if (pixel <= pixels) new_start[pixel] = offsets[from_camera ? pixel * samples : start[pixel]];
}
