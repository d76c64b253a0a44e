/* Which elements adaptive subdivision splits: "during each iteration of the solution algorithm all elements evaluate in
 * parallel the radiosity difference across their respective surface" (section 1.4 of Drucker & Schroeder), with lower
 * limits on the element's area and on its projected area from a viewpoint (Heckbert 1990).
 *
 * expect           one work-item a vertex and band: by how much it surprises, were the level above displayed
 * mark_elements    one work-item an element: difference[e] = the largest difference of radiosity between its corners, over
 *                  bands, in units of what is tolerated; 0 where it is at most 1, and where what is displayed is not expected
 *                  to be off by more than tolerated_error: an even gradient or bend needs no finer elements. A covered corner
 *                  reflects nothing, so the outline of what stands on a surface is found like a shadow's. verdict[e]:
 *                  CLRAD_KEEP, CLRAD_SPLIT, or what forbids the split.
 * interpolate_new  one work-item a new vertex: the mean of its parents (the alternative that the paper warns of)
 *
 * camera: eye, forward, right / (tan half width), up / (tan half height) in the frame, then half width and half height in
 * pixels; a child's projected area is taken as a quarter of its parent's. */

#define CLRAD_KEEP 0
#define CLRAD_SPLIT 1
#define CLRAD_AT_MAX_LEVEL 2
#define CLRAD_AT_MIN_AREA 3
#define CLRAD_AT_MIN_PROJECTED_AREA 4

/* [pixels]; 0 behind the camera, beside the picture or seen from the back; huge where it reaches behind the camera. */
static REAL projected_area(__global const REAL* camera, __global const CLRAD_POINT_T* receivers,
                           __global const uint* vertex, uint corners) {
  REAL x[4], y[4];
  int in_front = 0, left = 1, right = 1, below = 1, above = 1;
  for (uint k = 0; k < corners; k++) {
    const CLRAD_POINT_T p = receivers[vertex[k]];
    const REAL d[3] = {p.x - camera[0], p.y - camera[1], p.z - camera[2]};
    const REAL depth = d[0] * camera[3] + d[1] * camera[4] + d[2] * camera[5];
    const REAL across = d[0] * camera[6] + d[1] * camera[7] + d[2] * camera[8];
    const REAL up = d[0] * camera[9] + d[1] * camera[10] + d[2] * camera[11];
    in_front += depth > (REAL)1e-6f;
    left &= across < -depth;
    right &= across > depth;
    below &= up < -depth;
    above &= up > depth;
    x[k] = across / depth * camera[12];
    y[k] = up / depth * camera[13];
  }
  if (in_front == 0 || left || right || below || above) return 0;
  if (in_front < (int)corners) return (REAL)1e30f;
  REAL twice = 0;
  for (uint k = 0; k < corners; k++) {
    const uint next = k + 1 == corners ? 0 : k + 1;
    twice += x[k] * y[next] - x[next] * y[k];
  }
  return twice > 0 ? twice / 2 : 0; /* counter-clockwise: the front is seen */
}

/* Along an edge from a to b: what is displayed in its middle (host/mesh/bend.hpp), from values one and two edges before a and
 * after b, as far as there are any. */
static REAL displayed_middle(REAL a, REAL b, __global const REAL* values, __global const uint* around) {
  const int before = around[0] != CLRAD_NONE, after = around[1] != CLRAD_NONE;
  REAL p = 0, q = 0;
  if (before) p = values[around[0]] - 2 * a + b;
  if (after) q = a - 2 * b + values[around[1]];
  if (before && !after && around[2] != CLRAD_NONE) q = values[around[2]] - 2 * values[around[0]] + a;
  if (after && !before && around[3] != CLRAD_NONE) p = b - 2 * values[around[1]] + values[around[3]];
  const REAL bend = p * q > 0 ? -p / (p + q) * q : 0;
  return (a + b) / 2 + bend / 4;
}

/* surprise[b * vertices + v]: by how much irradiance differs from what the level above displayed at v; huge where there is no level
 * above, or where something covers v or one of its parents. */
__kernel void expect(__global const REAL* irradiance, __global const uint* parents, __global const uint* around,
                     __global const uint* covered, __global REAL* surprise, uint vertices, uint bands) {
  const ulong i = get_global_id(0);
  if (i >= (ulong)vertices * bands) return;
  const uint band = (uint)(i / vertices), v = (uint)(i % vertices);
  __global const REAL* h = irradiance + (ulong)band * vertices;
  __global const uint* of = parents + 4 * v;
  __global const uint* near = around + 4 * v;
  REAL result = (REAL)1e30f;
  if (of[0] != CLRAD_NONE && !(covered[v] | covered[of[0]] | covered[of[1]] | covered[of[2]] | covered[of[3]])) {
    const REAL mean = (h[of[0]] + h[of[1]] + h[of[2]] + h[of[3]]) / 4;
    REAL foreseen = mean;
    if (of[0] == of[2])
      foreseen = displayed_middle(h[of[0]], h[of[1]], h, near);
    else if (near[0] != CLRAD_NONE && near[1] != CLRAD_NONE && near[2] != CLRAD_NONE && near[3] != CLRAD_NONE)
      foreseen = (h[near[0]] + h[near[1]] + h[near[2]] + h[near[3]]) / 2 - mean;
    result = fabs(h[v] - foreseen);
  }
  surprise[i] = result;
}

/* The most surprise at the corners that were made at `level`; negative where none was. */
static REAL most_surprise(__global const REAL* surprise, __global const uint* vertex, __global const uint* made_at,
                          uint corners, uint level) {
  REAL most = -1;
  for (uint k = 0; k < corners; k++) {
    const uint v = vertex[k];
    if (v == CLRAD_NONE || made_at[v] != level) continue;
    most = surprise[v] > most ? surprise[v] : most;
  }
  return most;
}

/* How far off what is displayed in the element seems to be: its own vertices' surprise, times by how much a level lessens it.
 * Where irradiance is smooth it helps (a quarter is taken at best, an eighth is the limit); at a shadow's edge it hardly does. */
static REAL expected_error(__global const REAL* surprise, __global const uint* vertex, __global const uint* made_at,
                           __global const uint* parents, uint corners, uint level) {
  const REAL here = most_surprise(surprise, vertex, made_at, corners, level);
  if (here < 0 || here > (REAL)1e29f || level == 0) return (REAL)1e30f;
  REAL above = -1;
  for (uint k = 0; k < corners; k++) { /* the corners of the element that this one is a child of are parents of its own */
    if (made_at[vertex[k]] != level) continue;
    const REAL s = most_surprise(surprise, parents + 4 * vertex[k], made_at, 4, level - 1);
    above = s > above ? s : above;
  }
  if (above > (REAL)1e29f || here >= above) return here;
  return 4 * here < above ? here / 4 : here * (here / above);
}

/* What T-vertices on an element's edges surprise by is seen, not foreseen: one sample an edge of what is displayed there without
 * them. A kink that lies between an element's own vertices (a shadow's edge) shows there, so that splits follow it from
 * element to element. The sample may lie beside the worst: times seen_times. */
__kernel void mark_elements(__global const REAL* irradiance, __global const REAL* surprise, __global const uint* vertex,
                            __global const uint* middle,
                            __global const uint* made_at, __global const uint* parents,
                            __global const uint* covered, __global const uint* patch_of,
                            __global const REAL* reflectance, __global const REAL* area,
                            __global const uint* level, __global const uint* levels_left, __global const CLRAD_POINT_T* receivers,
                            __global const REAL* camera, uint vertices, uint patches, uint bands, REAL tolerated, REAL tolerated_error, REAL seen_times,
                            REAL least_area, REAL least_projected, __global float* difference,
                            __global uint* verdict, uint elements) {
  const uint e = get_global_id(0);
  if (e >= elements) return;
  __global const uint* v = vertex + 4 * e;
  const uint corners = v[3] == CLRAD_NONE ? 3 : 4;
  REAL most = 0, unexpected = 0;
  for (uint b = 0; b < bands; b++) {
    REAL low = 0, high = 0;
    for (uint k = 0; k < corners; k++) {
      const REAL h = covered[v[k]] ? 0 : irradiance[(ulong)b * vertices + v[k]];
      low = k == 0 || h < low ? h : low;
      high = k == 0 || h > high ? h : high;
    }
    const REAL d = reflectance[b * patches + patch_of[e]] * (high - low);
    most = d > most ? d : most;
    __global const REAL* of_band = surprise + (ulong)b * vertices;
    const REAL foreseen = expected_error(of_band, v, made_at, parents, corners, level[e]),
               at_middles = most_surprise(of_band, middle + 4 * e, made_at, corners, level[e] + 1),
               seen = at_middles < (REAL)1e29f ? seen_times * at_middles : 0; /* else: covered, nothing was seen */
    const REAL s = reflectance[b * patches + patch_of[e]] * (seen > foreseen ? seen : foreseen);
    unexpected = s > unexpected ? s : unexpected;
  }
  most /= tolerated;
  const int over = most > 1 && unexpected > tolerated_error;
  difference[e] = over ? (float)most : 0.0f;
  uint result = over ? CLRAD_SPLIT : CLRAD_KEEP;
  if (over && levels_left[e] == 0)
    result = CLRAD_AT_MAX_LEVEL;
  else if (over && area[e] < 4 * least_area)
    result = CLRAD_AT_MIN_AREA;
  else if (over && least_projected > 0 && projected_area(camera, receivers, v, corners) < 4 * least_projected)
    result = CLRAD_AT_MIN_PROJECTED_AREA;
  verdict[e] = result;
}

__kernel void interpolate_new(__global REAL* values, ulong at, __global const uint* parents, uint first, uint vertices) {
  const uint i = get_global_id(0);
  if (first + i >= vertices) return;
  REAL sum = 0;
  for (int k = 0; k < 4; k++) sum += values[at + parents[4 * i + k]];
  values[at + first + i] = sum / 4;
}
