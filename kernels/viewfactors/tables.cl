/* What the kernels of view factors read: pairs of polygons, their occluders, and cells of receivers. All positions of a
 * pair are relative to an origin of its own. */
#ifndef CLRAD_VIEWFACTORS_TABLES_CL
#define CLRAD_VIEWFACTORS_TABLES_CL
#include "shared/math.cl"

#define CELL_WORDS 8     /* pair, quad, u, v, level_u, level_v: the cell is [u, u + 1] / 2^level_u ... of the quad; where its
                            list of occluders starts, and their number */
#define PAIR_WORDS 2     /* first corner of the shooter, corners */
#define OCCLUDER_WORDS 2 /* first corner, corners */
#define OCCLUDER_REALS 5 /* unit normal, its offset (n . x of its points), height at which it counts as seen edge-on */
#define MOST_CORNERS 16  /* of a piece of a polygon; the host cuts shooters to 12 */

clrad_vector load_vector(__global const REAL* at) { return clrad_make(at[0], at[1], at[2]); }

clrad_vector mixed(clrad_vector a, clrad_vector b, REAL t) {
  return clrad_plus(clrad_scaled(a, 1 - t), clrad_scaled(b, t));
}

/* The point (u, v) of a quad's bilinear map. */
clrad_vector quad_point(__global const REAL* quad, REAL u, REAL v) {
  return mixed(mixed(load_vector(quad), load_vector(quad + 3), u), mixed(load_vector(quad + 9), load_vector(quad + 6), u),
               v);
}

/* The plane through x and edge e of an occluder, x being the origin, its normal to the inside of the pyramid. */
clrad_vector pyramid_side(__global const REAL* corner, uint corners, uint e, clrad_vector x, int from_front) {
  const clrad_vector a = clrad_minus(load_vector(corner + 3 * e), x);
  const clrad_vector b = clrad_minus(load_vector(corner + 3 * (e + 1 < corners ? e + 1 : 0)), x);
  const clrad_vector c = clrad_cross(clrad_dot(a, a) < clrad_dot(b, b) ? a : b, clrad_minus(b, a));
  return from_front ? clrad_scaled(c, -1) : c;
}
#endif
