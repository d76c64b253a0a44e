/* What the kernels of view factors read: pairs of polygons, their occluders, and cells of receivers. All positions of a
 * pair are relative to an origin of its own. */
#ifndef CLRAD_VIEWFACTORS_TABLES_CL
#define CLRAD_VIEWFACTORS_TABLES_CL
#include "shared/math.cl"

#define CELL_WORDS 8     /* pair, quad, u, v, level_u, level_v: the cell is [u, u + 1] / 2^level_u ... of the quad; where its
                            list of occluders starts, and their number */
#define PAIR_WORDS 2     /* first corner of the shooter, corners */
#define OCCLUDER_WORDS 5 /* first corner, corners; first plane; first side, sides: 0 for a flat polygon, whose corners are in
                            order; else the edges of a closed convex body */
#define SIDE_WORDS 4     /* of a body's edge: the corners and the planes of the faces that meet there, from the first */
#define OCCLUDER_REALS 5 /* a plane: unit normal, its offset (n . x of its points), height at which it counts as seen edge-on */
#define MOST_SIDES 16    /* of what an occluder shows to a point; the host takes no larger ones */
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

/* The planes through x, being the origin, and the sides of what the occluder shows to x, normals to the inside: of a flat
 * polygon its sides, of a body those edges where a face that x sees meets one that it does not. Returns their number; -1
 * for a flat polygon seen edge-on, which hides nothing. A body is wholly in front of the receiver's and the shooter's plane,
 * so that x is outside of it or on its surface; 0 sides, x being under a face on the receiver: it hides all. *size: largest
 * component of the products that each plane's normal is the difference of. */
int shown_sides(__global const uint* occluder, __global const uint* side, __global const REAL* plane,
                __global const REAL* vertex, uint o, clrad_vector x, clrad_vector* h, REAL* size) {
  __global const uint* mine = occluder + OCCLUDER_WORDS * o;
  __global const REAL* corner = vertex + 3 * mine[0];
  plane += OCCLUDER_REALS * mine[2];
  if (mine[4] == 0) {
    const REAL height = clrad_dot(load_vector(plane), x) - plane[3];
    if (!(height > plane[4] || height < -plane[4])) return -1;
    const int n = (int)mine[1];
    clrad_vector a = clrad_minus(load_vector(corner + 3 * (n - 1)), x);
    for (int e = 0; e < n; e++) {
      const clrad_vector b = clrad_minus(load_vector(corner + 3 * e), x), along = clrad_minus(b, a);
      const clrad_vector nearer = clrad_dot(a, a) < clrad_dot(b, b) ? a : b;
      h[e] = height > 0 ? clrad_cross(along, nearer) : clrad_cross(nearer, along);
      size[e] = clrad_largest(along) * clrad_largest(nearer);
      a = b;
    }
    return n;
  }
  side += SIDE_WORDS * mine[3];
  clrad_vector middle = clrad_make(0, 0, 0);
  for (uint k = 0; k < mine[1]; k++) middle = clrad_plus(middle, load_vector(corner + 3 * k));
  middle = clrad_minus(clrad_scaled(middle, 1 / (REAL)mine[1]), x);
  int found = 0;
  for (uint e = 0; e < mine[4]; e++) {
    __global const uint* s = side + SIDE_WORDS * e;
    __global const REAL *f = plane + OCCLUDER_REALS * s[2], *g = plane + OCCLUDER_REALS * s[3];
    if ((clrad_dot(load_vector(f), x) > f[3]) == (clrad_dot(load_vector(g), x) > g[3])) continue;
    const clrad_vector a = clrad_minus(load_vector(corner + 3 * s[0]), x);
    const clrad_vector b = clrad_minus(load_vector(corner + 3 * s[1]), x);
    const clrad_vector along = clrad_minus(b, a), nearer = clrad_dot(a, a) < clrad_dot(b, b) ? a : b;
    const clrad_vector c = clrad_cross(along, nearer);
    if (found == MOST_SIDES) return -1;
    size[found] = clrad_largest(along) * clrad_largest(nearer);
    h[found++] = clrad_dot(c, middle) < 0 ? clrad_scaled(c, -1) : c;
  }
  return found;
}
#endif
