/* Points of quadrilaterals as receivers see them, denser where the kernel cos cos / r^2 is high: down a quadtree of parts, each of which gets
 * as much of the unit square as it may have of the kernel (Clarberg et al. 2005). CLRAD_WIDTH receivers and quadrilaterals at once, one a
 * lane; lanes that are done wait for the others. */
#ifndef CLRAD_AIM_CL
#define CLRAD_AIM_CL
#include "shared/math.cl"
#include "shared/reals.cl"

typedef struct aims {
  clrad_vectors x;     /* from the receiver */
  clrad_reals u, v;    /* bilinear in the quadrilateral's corners */
  clrad_reals above;   /* sine of its height above the receiver's horizon */
  clrad_reals weight;  /* kernel x area / density of such points, without `above` */
} aims;

#define NEAR CLRAD_R(0.25) /* parts whose diagonal's square is less than this x their distance's are not divided */
#define MOST_LEVELS 12

static inline clrad_reals positive(clrad_reals x) { return x > 0 ? x : (clrad_reals)0; }
static inline clrad_reals at_most_one(clrad_reals x) { return x < 1 ? x : (clrad_reals)1; }

/* Of a bilinear function by its values at the corners: at the middle of quarter k, which is at corner k. */
static inline clrad_reals at_quarter(const clrad_reals* c, int k) {
  return (9 * c[k] + 3 * (c[(k + 1) & 3] + c[(k + 3) & 3]) + c[k ^ 2]) / 16;
}

static inline clrad_reals bilinear_at(const clrad_reals* c, clrad_reals u, clrad_reals v) {
  return (1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[3] + u * c[2]);
}

/* Of the lanes that go on: the values at the corners of the chosen quarter of a bilinear function with those of the whole. */
static inline void take_quarter(clrad_reals* c, clrad_masks right, clrad_masks top, clrad_masks go) {
  const clrad_reals e0 = (c[0] + c[1]) / 2, e1 = (c[1] + c[2]) / 2, e2 = (c[2] + c[3]) / 2, e3 = (c[3] + c[0]) / 2;
  const clrad_reals middle = (e0 + e2) / 2;
  const clrad_reals low_0 = right ? e0 : c[0], low_1 = right ? c[1] : e0, low_2 = right ? e1 : middle, low_3 = right ? middle : e3;
  const clrad_reals top_0 = right ? middle : e3, top_1 = right ? e1 : middle, top_2 = right ? c[2] : e2, top_3 = right ? e2 : c[3];
  const clrad_masks up = go & top, down = go & ~top;
  c[0] = up ? top_0 : down ? low_0 : c[0];
  c[1] = up ? top_1 : down ? low_1 : c[1];
  c[2] = up ? top_2 : down ? low_2 : c[2];
  c[3] = up ? top_3 : down ? low_3 : c[3];
}

/* A point for (u, v) in the unit square. r: corners from the receiver; up: the receiver's normal, n: the quadrilateral's. */
static aims aimed(const clrad_vectors* r, clrad_vectors up, clrad_vectors n, clrad_reals u, clrad_reals v) {
  clrad_reals x[4], y[4], z[4], height[4], area[4];
  for (int k = 0; k < 4; k++) {
    x[k] = r[k].x;
    y[k] = r[k].y;
    z[k] = r[k].z;
    height[k] = clrad_dots(up, r[k]);
  }
  const clrad_vectors e01 = clrad_differences(r[1], r[0]), e32 = clrad_differences(r[2], r[3]);
  const clrad_vectors e03 = clrad_differences(r[3], r[0]), e12 = clrad_differences(r[2], r[1]);
  /* Area per parameter area; bilinear, too. Lost in rounding: the same all over. */
  area[0] = clrad_dots(n, clrad_crosses(e01, e03));
  area[1] = clrad_dots(n, clrad_crosses(e01, e12));
  area[2] = clrad_dots(n, clrad_crosses(e32, e12));
  area[3] = clrad_dots(n, clrad_crosses(e32, e03));
  const clrad_masks flat = ~CLRAD_IS(area[0] + area[1] + area[2] + area[3] > 0);
  for (int k = 0; k < 4; k++) area[k] = flat ? (clrad_reals)1 : area[k];
  const clrad_vectors a = clrad_differences(r[2], r[0]), b = clrad_differences(r[3], r[1]);
  const clrad_reals a2 = clrad_dots(a, a), b2 = clrad_dots(b, b);
  clrad_reals d2 = a2 > b2 ? a2 : b2, u0 = 0, v0 = 0, width = 1, chance = 1;
  clrad_masks go = -1;
  for (int level = 0; level < MOST_LEVELS; level++) {
    const clrad_reals mx = (x[0] + x[1] + x[2] + x[3]) / 4, my = (y[0] + y[1] + y[2] + y[3]) / 4,
                      mz = (z[0] + z[1] + z[2] + z[3]) / 4;
    go &= ~CLRAD_IS(d2 <= NEAR * (mx * mx + my * my + mz * mz));
    if (!clrad_some(go)) break;
    d2 = d2 / 4;
    const clrad_reals middle = positive((height[0] + height[1] + height[2] + height[3]) / 4);
    clrad_reals edge[4], w[4];
    for (int k = 0; k < 4; k++) edge[k] = positive((height[k] + height[(k + 1) & 3]) / 2);
    for (int k = 0; k < 4; k++) {
      const clrad_reals qx = at_quarter(x, k), qy = at_quarter(y, k), qz = at_quarter(z, k);
      const clrad_reals q = qx * qx + qy * qy + qz * qz + d2 / 16;
      w[k] = ((positive(height[k]) + edge[k] + edge[(k + 3) & 3] + middle) / q) * (positive(at_quarter(area, k)) / q);
    }
    const clrad_reals left = w[0] + w[3], all = left + w[1] + w[2];
    go &= CLRAD_IS(all > 0);
    /* u may be 1 (rounding): a half without weight is never chosen. */
    const clrad_masks right = CLRAD_IS(left < all) & CLRAD_IS(u * all >= left);
    const clrad_reals column = right ? all - left : left, low = right ? w[1] : w[0], both = low + (right ? w[2] : w[3]);
    go &= CLRAD_IS(both > 0);
    if (!clrad_some(go)) break;
    const clrad_masks top = CLRAD_IS(low < both) & CLRAD_IS(v * both >= low);
    const clrad_reals row = top ? both - low : low;
    const clrad_reals next_u = at_most_one((right ? u * all - left : u * all) / column);
    const clrad_reals next_v = at_most_one((top ? v * both - low : v * both) / row);
    const clrad_reals next_chance = chance * (4 * (column / all) * (row / both));
    u = go ? next_u : u;
    v = go ? next_v : v;
    chance = go ? next_chance : chance;
    width = go ? width / 2 : width;
    u0 = go & right ? u0 + width : u0;
    v0 = go & top ? v0 + width : v0;
    take_quarter(x, right, top, go);
    take_quarter(y, right, top, go);
    take_quarter(z, right, top, go);
    take_quarter(height, right, top, go);
    take_quarter(area, right, top, go);
  }
  aims p;
  p.x.x = bilinear_at(x, u, v);
  p.x.y = bilinear_at(y, u, v);
  p.x.z = bilinear_at(z, u, v);
  p.u = u0 + width * u;
  p.v = v0 + width * v;
  const clrad_reals r2 = clrad_dots(p.x, p.x), distance = sqrt(r2);
  /* The same all over the plane. Where rounding loses it the factor knows better, and only that it is the same matters. */
  const clrad_reals toward = -clrad_dots(n, r[0]), facing = toward > 0 ? toward : CLRAD_R(1e-6) * distance;
  const clrad_masks apart = CLRAD_IS(distance > 0);
  p.above = apart ? bilinear_at(height, u, v) / distance : (clrad_reals)0;
  /* In this order nothing overflows or underflows at 1e-12 of the frame, where r2 r2 would. */
  p.weight = apart ? (facing / distance) * (bilinear_at(area, u, v) / r2) / chance : (clrad_reals)0;
  return p;
}

#endif
