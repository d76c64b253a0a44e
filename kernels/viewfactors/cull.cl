/* Which occluders of its pair concern a cell of the receiver: a list that each cell hands on to its halves.
 *
 *   - An occluder that does not reach into the convex hull of cell and shooter (their shaft) hides nothing of the
 *     shooter from any point of the cell: it leaves the list.
 *   - An occluder that hides the whole shooter from each corner of the cell hides it from all of the cell, since the
 *     points from which a convex polygon hides a given point are a convex set: nothing is left to integrate.
 *
 * Both are proofs but for rounding: an occluder stays unless it is outside, and does not hide unless it is inside, by more
 * than the rounding of the plane tests. What is dropped wrongly is narrower than that.
 *
 * The shaft is given by the planes of its faces: through each edge of the cell and that corner of the shooter which has
 * all the rest behind it, and the other way round. The planes of the two polygons are not needed, since flat
 * occluders are clipped to the front of both, and bodies are there. Source: Haines & Wallace, "Shaft culling for efficient ray-traced radiosity", 1991.
 *
 * Pre: as in integrate.cl. Post: kept[i] of the cell's list remain, in their order; HIDDEN: nothing is visible. */
#include "viewfactors/tables.cl"

#define HIDDEN 0xffffffffu
#define MOST_PLANES 16 /* 4 edges of a cell, 12 of a shooter */

/* A plane of the shaft: h . (p - from) <= 0 inside, off by at most doubt x the largest component of p - from. */
typedef struct shaft_plane {
  clrad_vector h, from;
  REAL doubt;
} shaft_plane;

/* The plane through the edge that turns about it until all `others` are behind it and some on it; `own`: a corner of
 * the edge's own polygon off the edge, which is behind. *is_plane: 0 when there is no such plane, as for an edge without length.
 * (By value: given where in the array to write, NVIDIA's compiler 580.159 unrolls the callers' loops wrongly.) */
shaft_plane turn_plane(clrad_vector from, clrad_vector to, clrad_vector own, const clrad_vector* others, int n,
                       int* is_plane) {
  const clrad_vector along = clrad_minus(to, from), inner = clrad_minus(own, from);
  const REAL length = clrad_largest(along);
  clrad_vector h = clrad_make(0, 0, 0);
  REAL doubt = 0;
  int found = 0;
  for (int i = 0; i < n; i++) {
    const clrad_vector to_it = clrad_minus(others[i], from);
    const REAL size = 16 * CLRAD_EPSILON * length * clrad_largest(to_it);
    if (found && !(clrad_dot(h, to_it) > doubt * clrad_largest(to_it))) continue;
    clrad_vector next = clrad_cross(along, to_it);
    if (!(clrad_largest(next) > size)) continue; /* on the edge's line */
    const REAL side = clrad_dot(next, inner);
    if (!(side > size * clrad_largest(inner) || side < -size * clrad_largest(inner))) continue; /* in its own plane */
    h = side > 0 ? clrad_scaled(next, -1) : next;
    doubt = size;
    found = 1;
  }
  for (int i = 0; i < n && found; i++) { /* those in its own plane, beyond the edge, are behind no such plane */
    const clrad_vector to_it = clrad_minus(others[i], from);
    found = clrad_dot(h, to_it) <= 2 * doubt * clrad_largest(to_it);
  }
  shaft_plane plane;
  plane.h = h;
  plane.from = from;
  plane.doubt = doubt;
  *is_plane = found;
  return plane;
}

REAL over(const shaft_plane* plane, clrad_vector p, REAL* allowed) {
  const clrad_vector to_it = clrad_minus(p, plane->from);
  *allowed = plane->doubt * clrad_largest(to_it);
  return clrad_dot(plane->h, to_it);
}

/* Whether p is over the plane, or on it as far as rounding can tell. */
int not_behind(const shaft_plane* plane, clrad_vector p) {
  REAL allowed;
  const REAL height = over(plane, p, &allowed); /* first: an operand beside a call may be read before the call */
  return height >= -allowed;
}

/* Whether something of the polygon is behind all planes. */
int reaches_in(const shaft_plane* planes, int count, __global const REAL* corner, uint corners) {
  REAL allowed;
  for (int k = 0; k < count; k++) {
    uint outside = 0;
    while (outside < corners && not_behind(&planes[k], load_vector(corner + 3 * outside))) outside++;
    if (outside == corners) return 0;
  }
  clrad_vector p[MOST_CORNERS], q[MOST_CORNERS];
  REAL d[MOST_CORNERS];
  if (corners > MOST_CORNERS) return 1;
  int n = (int)corners;
  for (int i = 0; i < n; i++) p[i] = load_vector(corner + 3 * i);
  for (int k = 0; k < count; k++) {
    int inside = 0, outside = 0, m = 0;
    for (int i = 0; i < n; i++) {
      d[i] = over(&planes[k], p[i], &allowed);
      if (d[i] <= allowed && d[i] >= -allowed) d[i] = 0;
      inside |= d[i] < 0;
      outside |= d[i] > 0;
    }
    if (!inside) return 0;
    if (!outside) continue;
    for (int i = 0; i < n; i++) {
      const int next = i + 1 < n ? i + 1 : 0;
      if (m + 2 > MOST_CORNERS) return 1; /* no room to tell */
      if (d[i] <= 0) q[m++] = p[i];
      if ((d[i] > 0 && d[next] < 0) || (d[i] < 0 && d[next] > 0))
        q[m++] = clrad_plus(p[i], clrad_scaled(clrad_minus(p[next], p[i]), d[i] / (d[i] - d[next])));
    }
    if (m < 3) return 0;
    n = m;
    for (int i = 0; i < n; i++) p[i] = q[i];
  }
  return 1;
}

/* Whether something of a body may be in the hull of both: not when it is beyond one of the shaft's planes, nor when all of
 * cell and shooter are beyond one of its faces. */
int body_reaches_in(const shaft_plane* planes, int count, const clrad_vector* cell, const clrad_vector* shooter, int n,
                    __global const uint* side, uint sides, __global const REAL* plane, __global const REAL* corner,
                    uint corners) {
  for (int k = 0; k < count; k++) {
    uint outside = 0;
    while (outside < corners && not_behind(&planes[k], load_vector(corner + 3 * outside))) outside++;
    if (outside == corners) return 0;
  }
  for (uint e = 0; e < 2 * sides; e++) { /* each face several times */
    __global const REAL* f = plane + OCCLUDER_REALS * side[SIDE_WORDS * (e / 2) + 2 + (e & 1)];
    int inside = 0;
    for (int i = 0; i < 4 && !inside; i++) inside = clrad_dot(load_vector(f), cell[i]) < f[3] - f[4];
    for (int i = 0; i < n && !inside; i++) inside = clrad_dot(load_vector(f), shooter[i]) < f[3] - f[4];
    if (!inside) return 0;
  }
  return 1;
}

/* One work-item a cell. */
__kernel void cull_cells(__global const uint* cells, uint count, __global const REAL* quads, __global const uint* pairs,
                         __global const uint* occluder, __global const uint* side, __global const REAL* plane,
                         __global const REAL* vertex, __global uint* list, __global uint* kept) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  __global const uint* cell = cells + CELL_WORDS * i;
  __global const REAL* quad = quads + 12 * cell[1];
  __global const uint* pair = pairs + PAIR_WORDS * cell[0];
  const REAL width_u = 1 / (REAL)(1u << cell[4]), width_v = 1 / (REAL)(1u << cell[5]);
  const REAL u = (REAL)cell[2] * width_u, v = (REAL)cell[3] * width_v;
  clrad_vector c[4], s[MOST_CORNERS];
  c[0] = quad_point(quad, u, v);
  c[1] = quad_point(quad, u + width_u, v);
  c[2] = quad_point(quad, u + width_u, v + width_v);
  c[3] = quad_point(quad, u, v + width_v);
  const int n = (int)pair[1];
  for (int k = 0; k < n; k++) s[k] = load_vector(vertex + 3 * (pair[0] + k));
  shaft_plane planes[MOST_PLANES];
  int found = 0, is_plane;
  for (int k = 0; k < 4; k++) { /* of a triangle corners 2 and 3 coincide */
    const shaft_plane plane_of = turn_plane(c[k], c[(k + 1) & 3], c[k == 3 ? 1 : (k + 3) & 3], s, n, &is_plane);
    if (is_plane) planes[found++] = plane_of;
  }
  for (int k = 0; k < n; k++) {
    const shaft_plane plane_of = turn_plane(s[k], s[(k + 1) % n], s[(k + n / 2 + 1) % n], c, 4, &is_plane);
    if (is_plane) planes[found++] = plane_of;
  }
  __global uint* mine = list + cell[6];
  uint left = 0;
  for (uint k = 0; k < cell[7]; k++) {
    const uint o = mine[k];
    __global const uint* words = occluder + OCCLUDER_WORDS * o;
    __global const REAL* corner = vertex + 3 * words[0];
    if (words[4] == 0 ? !reaches_in(planes, found, corner, words[1])
                      : !body_reaches_in(planes, found, c, s, n, side + SIDE_WORDS * words[3], words[4],
                                         plane + OCCLUDER_REALS * words[2], corner, words[1]))
      continue;
    int hides = 1; /* all of the shooter from all four corners */
    for (int at = 0; at < 4 && hides; at++) {
      clrad_vector h[MOST_SIDES];
      REAL size[MOST_SIDES];
      const int sides = shown_sides(occluder, side, plane, vertex, o, c[at], h, size);
      hides = sides > 0;
      for (int e = 0; e < sides && hides; e++)
        for (int j = 0; j < n && hides; j++) {
          const clrad_vector to_it = clrad_minus(s[j], c[at]);
          hides = clrad_dot(h[e], to_it) > 16 * CLRAD_EPSILON * size[e] * clrad_largest(to_it);
        }
    }
    if (hides) {
      kept[i] = HIDDEN;
      return;
    }
    mine[left++] = o;
  }
  kept[i] = left;
}
