/* Is a vertex inside something? It sends rays over its hemisphere; covered.cpp counts as covered the vertices whose every ray meets
 * the back of a surface first. Few vertices are, and most are told by one ray: the others follow only where that one met a back. */

/* Ray k goes where a regular spiral puts it (no built-in transcendental: directions are stored, not computed), so far
 * that it leaves the scene: frame coordinates lie in [-1, 1), and ends may go out to 4.
 * direction[k] is on the hemisphere about +z; the frame (t, s, n) turns it to the vertex's normal. Work-item: one of the rays
 * [first_probe, first_probe + probes) of `count` vertices from asked[first] on. */
__kernel void probe_rays(__global const CLRAD_POINT_T* receivers, __global const uint* asked, __global const float* direction,
                         __global CLRAD_POINT_T* origins, __global CLRAD_POINT_T* ends, uint first, uint count, uint first_probe,
                         uint probes) {
  const uint i = get_global_id(0);
  if (i >= count * probes) return;
  const CLRAD_POINT_T r = receivers[asked[first + i / probes]];
  const uint k = first_probe + i % probes;
  const REAL dx = direction[3 * k], dy = direction[3 * k + 1], dz = direction[3 * k + 2];
  /* Duff et al. 2017, "Building an Orthonormal Basis, Revisited" */
  const REAL sign = r.nz >= 0 ? (REAL)1 : (REAL)-1;
  const REAL a = -1 / (sign + r.nz);
  const REAL b = r.nx * r.ny * a;
  const REAL length = (REAL)2.9;
  CLRAD_POINT_T end = r;
  end.plane = CLRAD_NONE;
  end.surface = CLRAD_NONE;
  end.x = r.x + length * (dx * (1 + sign * r.nx * r.nx * a) + dy * b + dz * r.nx);
  end.y = r.y + length * (dx * sign * b + dy * (sign + r.ny * r.ny * a) + dz * r.ny);
  end.z = r.z + length * (dx * -sign * r.nx + dy * -r.ny + dz * r.nz);
  end.x_lo = end.y_lo = end.z_lo = 0;
  origins[i] = r;
  ends[i] = end;
}

/* backs[v] = 1 when every ray of vertex v met a back face; normal[3 t ..] is the triangle's, 0 where it has two sides. */
__kernel void probe_verdict(__global const CLRAD_POINT_T* origins, __global const CLRAD_POINT_T* ends,
                            __global const uint* hit, __global const float* normal, __global uint* backs, uint first,
                            uint count, uint probes) {
  const uint v = get_global_id(0);
  if (v >= count) return;
  uint met = 0;
  for (uint k = 0; k < probes; ++k) {
    const uint i = v * probes + k;
    const uint t = hit[i];
    if (t == CLRAD_NONE) continue;
    const REAL along = (ends[i].x - origins[i].x) * normal[3 * t] + (ends[i].y - origins[i].y) * normal[3 * t + 1] +
                       (ends[i].z - origins[i].z) * normal[3 * t + 2];
    met += along > 0;
  }
  backs[first + v] = met == probes;
}
