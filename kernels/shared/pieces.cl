/* Convex pieces of a polygon, corners relative to a point that looks at it: cut by planes through that point, and the form factor
 * of what is left. Corners run counter-clockwise seen from the polygon's front; arrays that are cut into hold one corner more
 * than the piece that is cut.
 *
 * Shadows cut out of sources: Nishita & Nakamae, "Continuous Tone Representation of Three-Dimensional Objects Taking Account of
 * Shadows and Interreflection", SIGGRAPH 1985. */
#ifndef CLRAD_PIECES_CL
#define CLRAD_PIECES_CL
#include "shared/factor.cl"

/* 2 pi F of a piece by its contour; *size: sum of the terms' absolute values. */
REAL contour_of(const clrad_vector* p, int n, clrad_vector normal, REAL* size) {
  REAL sum = 0;
  for (int i = 0; i < n; i++) {
    const clrad_vector a = p[i], b = p[i + 1 < n ? i + 1 : 0];
    const clrad_vector c = clrad_cross(clrad_minus(b, a), clrad_dot(a, a) < clrad_dot(b, b) ? a : b);
    const REAL length = sqrt(clrad_dot(c, c));
    if (!(length > 0)) continue;
    const REAL term = clrad_atan2(length, clrad_dot(a, b)) * (clrad_dot(normal, c) / length);
    sum += term;
    *size += term < 0 ? -term : term;
  }
  return sum;
}

/* 2 pi F by the area form in pairs, for pieces whose contour cancels: seen at a grazing angle, small or far. */
REAL careful_of(const clrad_vector* p, int n, clrad_vector normal) {
  REAL largest = 0;
  for (int i = 0; i < n; i++) {
    const REAL l = clrad_largest(p[i]);
    largest = l > largest ? l : largest;
  }
  const REAL unit = clrad_power_of_two(largest);
  if (!(unit > 0)) return 0;
  REAL sum = 0;
  for (int first = 1; first + 1 < n; first += 2) { /* quads 0, first, first + 1, first + 2; a triangle may be last */
    clrad_pair_vector r[4];
    clrad_pair z[4];
    for (int k = 0; k < 4; k++) {
      const int at = k == 0 ? 0 : first + k - 1 < n ? first + k - 1 : n - 1;
      r[k] = clrad_pair_of(clrad_scaled(p[at], 1 / unit));
      z[k] = clrad_pair_dot(clrad_pair_of(normal), r[k]);
      if (z[k].hi < 0) z[k].hi = z[k].lo = 0; /* on the horizon, but for rounding */
    }
    sum += clrad_area_form(r, z);
  }
  return 2 * sum;
}

/* Heights d of a piece's corners over the plane h . v = 0; a corner that is on the plane but for rounding is at 0. Returns
 * bits: 1 something is over it, 2 something is below. */
int heights_of(const clrad_vector* p, int n, clrad_vector h, REAL* d) {
  const REAL doubt = 16 * CLRAD_EPSILON * clrad_largest(h);
  int where = 0;
  for (int i = 0; i < n; i++) {
    const REAL height = clrad_dot(h, p[i]), allowed = doubt * clrad_largest(p[i]);
    d[i] = height <= allowed && height >= -allowed ? 0 : height;
    where |= (d[i] > 0) | (d[i] < 0) << 1;
  }
  return where;
}

/* Cuts a piece with corners on both sides of the plane, their heights being d, into what is in front and what is behind; a
 * part without area has 0 corners. Corners on the plane belong to both. */
void cut_piece(const clrad_vector* p, int n, const REAL* d, clrad_vector* front, int* fronts, clrad_vector* back,
               int* backs) {
  int a = 0, b = 0;
  for (int i = 0; i < n; i++) {
    const int next = i + 1 < n ? i + 1 : 0;
    if (d[i] >= 0) front[a++] = p[i];
    if (d[i] <= 0) back[b++] = p[i];
    if ((d[i] > 0 && d[next] < 0) || (d[i] < 0 && d[next] > 0)) {
      const clrad_vector x = clrad_plus(p[i], clrad_scaled(clrad_minus(p[next], p[i]), d[i] / (d[i] - d[next])));
      front[a++] = x;
      back[b++] = x;
    }
  }
  *fronts = a >= 3 ? a : 0;
  *backs = b >= 3 ? b : 0;
}
#endif
