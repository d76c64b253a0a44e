/* Adaptive subdivision of the element quadtree (section 1.4 and Fig. 1.3 of Drucker & Schroeder): elements that are to
 * be split ask for processors, one for each new vertex and one for each child, and processor allocation inserts the
 * children at their parent's place in the one linear array of leaves.
 *
 * Neighbours differ by one level at most: an element whose neighbour gets finer than that is split, too. A vertex is
 * known by its polygon and its lattice coordinates (in patches / 2^15); neighbours that split the same edge name the same
 * vertex, which is made once, as a head in the sorted list of names.
 *
 * ask_vertices    per element: how many vertices it needs made
 * name_vertices   per wanted vertex: its name, in two words of Morton code and the polygon
 * gather_words    names in the order of the sort so far
 * find_heads      first of each run of equal names
 * number_vertices every wanted vertex gets the number of its run; the run's head says where it lies
 * balance         elements that a finer neighbour forces to split
 * ask_children    4 places for an element that is split, 1 for one that stays
 * place_children  the new array
 * find_middles    T-vertices on edges whose neighbour has become finer
 *
 * Arrays: vertex[4 e + k], middle[4 e + k] (CLRAD_NONE: none); lattice[2 v] = i, lattice[2 v + 1] = j. */

#define CLRAD_DEPTH 15

static inline uint corners_of(__global const uint* vertex, uint e) { return vertex[4 * e + 3] == CLRAD_NONE ? 3 : 4; }

/* Edge k of element e goes from corner k to the next. */
static inline uint edge_end(__global const uint* vertex, uint e, uint k) {
  return vertex[4 * e + (k + 1 == corners_of(vertex, e) ? 0 : k + 1)];
}

/* The low 32 bits of x, each followed by a 0. */
static inline ulong spread(uint x) {
  ulong v = x;
  v = (v | v << 16) & 0x0000ffff0000ffffUL;
  v = (v | v << 8) & 0x00ff00ff00ff00ffUL;
  v = (v | v << 4) & 0x0f0f0f0f0f0f0f0fUL;
  v = (v | v << 2) & 0x3333333333333333UL;
  return (v | v << 1) & 0x5555555555555555UL;
}

static inline ulong morton(uint i, uint j, uint shift) { return spread(i >> shift) | spread(j >> shift) << 1; }

/* Whole numbers up to 2^32 - 1: the sum does not fit. */
static inline uint half_way(uint a, uint b) { return (a >> 1) + (b >> 1) + (a & b & 1); }

__kernel void ask_vertices(__global const uint* split, __global const uint* vertex, __global const uint* middle,
                           __global uint* counts, uint elements) {
  const uint e = get_global_id(0);
  if (e >= elements) return;
  uint count = 0;
  if (split[e]) {
    const uint corners = corners_of(vertex, e);
    for (uint k = 0; k < corners; k++) count += middle[4 * e + k] == CLRAD_NONE;
    count += corners == 4;
  }
  counts[e] = count;
}

/* parents[4 slot + k]: whose mean the bilinear interpolant has at the new vertex. */
__kernel void name_vertices(__global const uint* owner, __global const uint* rank, __global const uint* vertex,
                            __global const uint* middle, __global const uint* lattice,
                            __global const uint* polygon_of, uint shift, __global uint* low, __global uint* high,
                            __global uint* polygon, __global uint* coordinates, __global uint* parents,
                            __global uint* order, uint slots) {
  const uint slot = get_global_id(0);
  if (slot >= slots) return;
  const uint e = owner[slot], corners = corners_of(vertex, e);
  uint edge = 0, left = rank[slot];
  for (; edge < corners; edge++)
    if (middle[4 * e + edge] == CLRAD_NONE && left-- == 0) break;
  /* Past the edges: a quad's centre, half-way between opposite corners in lattice coordinates. */
  const uint a = vertex[4 * e + (edge < corners ? edge : 0)];
  const uint b = edge < corners ? edge_end(vertex, e, edge) : vertex[4 * e + 2];
  const uint i = half_way(lattice[2 * a], lattice[2 * b]), j = half_way(lattice[2 * a + 1], lattice[2 * b + 1]);
  const ulong code = morton(i, j, shift);
  low[slot] = (uint)code;
  high[slot] = (uint)(code >> 32);
  polygon[slot] = polygon_of[a];
  coordinates[2 * slot] = i;
  coordinates[2 * slot + 1] = j;
  for (uint k = 0; k < 4; k++)
    parents[4 * slot + k] = edge < corners ? (k & 1 ? b : a) : vertex[4 * e + k];
  order[slot] = slot;
}

__kernel void gather_words(__global const uint* words, __global const uint* order, __global uint* keys, uint slots) {
  const uint i = get_global_id(0);
  if (i < slots) keys[i] = words[order[i]];
}

static inline int same_name(__global const uint* low, __global const uint* high, __global const uint* polygon, uint a,
                            uint b) {
  return low[a] == low[b] && high[a] == high[b] && polygon[a] == polygon[b];
}

__kernel void find_heads(__global const uint* low, __global const uint* high, __global const uint* polygon,
                         __global const uint* order, __global uint* heads, uint slots) {
  const uint i = get_global_id(0);
  if (i < slots) heads[i] = i == 0 || !same_name(low, high, polygon, order[i - 1], order[i]);
}

/* runs: inclusive scan of heads. number[slot] for place_children; made[run] = the slot that speaks for the vertex. */
__kernel void number_vertices(__global const uint* order, __global const uint* heads, __global const uint* runs,
                              uint first_vertex, __global uint* number, __global uint* made, uint slots) {
  const uint i = get_global_id(0);
  if (i >= slots) return;
  number[order[i]] = first_vertex + runs[i] - 1;
  if (heads[i]) made[runs[i] - 1] = order[i];
}

/* Place in `order` of the first slot with this name, or CLRAD_NONE. */
static inline uint find(__global const uint* low, __global const uint* high, __global const uint* polygon,
                        __global const uint* order, uint slots, ulong code, uint of) {
  uint begin = 0, end = slots;
  while (begin < end) {
    const uint at = begin + (end - begin) / 2, s = order[at];
    const ulong c = (ulong)high[s] << 32 | low[s];
    if (polygon[s] < of || (polygon[s] == of && c < code))
      begin = at + 1;
    else
      end = at;
  }
  if (begin == slots) return CLRAD_NONE;
  const uint s = order[begin];
  return polygon[s] == of && ((ulong)high[s] << 32 | low[s]) == code ? begin : CLRAD_NONE;
}

/* forced[e] = 1 where an unsplit element has a T-vertex on an edge and a vertex is about to be made half-way between
 * that and a corner. */
__kernel void balance(__global uint* split, __global const uint* vertex, __global const uint* middle,
                      __global const uint* lattice, __global const uint* polygon_of, uint shift,
                      __global const uint* low, __global const uint* high, __global const uint* polygon,
                      __global const uint* order, uint slots, __global uint* forced, uint elements) {
  const uint e = get_global_id(0);
  if (e >= elements) return;
  uint found = 0;
  const uint corners = split[e] ? 0 : corners_of(vertex, e);
  for (uint k = 0; k < corners && !found; k++) {
    const uint m = middle[4 * e + k];
    if (m == CLRAD_NONE) continue;
    for (uint side = 0; side < 2; side++) {
      const uint c = side ? edge_end(vertex, e, k) : vertex[4 * e + k];
      const ulong code = morton(half_way(lattice[2 * c], lattice[2 * m]),
                                half_way(lattice[2 * c + 1], lattice[2 * m + 1]), shift);
      found |= find(low, high, polygon, order, slots, code, polygon_of[c]) != CLRAD_NONE;
    }
  }
  forced[e] = found;
  if (found) split[e] = 1;
}

__kernel void ask_children(__global const uint* split, __global uint* counts, uint elements) {
  const uint e = get_global_id(0);
  if (e < elements) counts[e] = split[e] ? 4 : 1;
}

/* The vertex half-way along edge k (k = 4: the centre) of an element that is split. */
static inline uint half_vertex(__global const uint* vertex, __global const uint* middle, __global const uint* number,
                               uint first_slot, uint e, uint k) {
  if (k < 4 && middle[4 * e + k] != CLRAD_NONE) return middle[4 * e + k];
  uint before = 0;
  const uint corners = corners_of(vertex, e);
  for (uint i = 0; i < k && i < corners; i++) before += middle[4 * e + i] == CLRAD_NONE;
  return number[first_slot + before];
}

__kernel void place_children(__global const uint* owner, __global const uint* rank, __global const uint* split,
                             __global const uint* vertex, __global const uint* middle, __global const uint* level,
                             __global const uint* code, __global const uint* slot_offsets,
                             __global const uint* number, __global uint* new_vertex, __global uint* new_middle,
                             __global uint* new_level, __global uint* new_code, uint places) {
  const uint place = get_global_id(0);
  if (place >= places) return;
  const uint e = owner[place], child = rank[place];
  if (!split[e]) {
    for (uint k = 0; k < 4; k++) {
      new_vertex[4 * place + k] = vertex[4 * e + k];
      new_middle[4 * place + k] = middle[4 * e + k];
    }
    new_level[place] = level[e];
    new_code[place] = code[e];
    return;
  }
  const uint corners = corners_of(vertex, e);
  uint half_of[5], c[4];
  for (uint k = 0; k < 4; k++) c[k] = vertex[4 * e + k];
  for (uint k = 0; k < 5; k++)
    half_of[k] = k < corners || (k == 4 && corners == 4)
                     ? half_vertex(vertex, middle, number, slot_offsets[e], e, k)
                     : CLRAD_NONE;
  uint v[4];
  if (corners == 4) {
    /* The child at corner `child`, its own corner in that place: the others are half-way along the two edges there and
     * the centre opposite. */
    v[child] = c[child];
    v[(child + 1) & 3] = half_of[child];
    v[(child + 2) & 3] = half_of[4];
    v[(child + 3) & 3] = half_of[(child + 3) & 3];
  } else {
    v[3] = CLRAD_NONE;
    v[0] = child == 0 ? c[0] : child == 1 ? half_of[0] : child == 2 ? half_of[2] : half_of[1];
    v[1] = child == 0 ? half_of[0] : child == 1 ? c[1] : child == 2 ? half_of[1] : half_of[2];
    v[2] = child == 0 ? half_of[2] : child == 1 ? half_of[1] : child == 2 ? c[2] : half_of[0];
  }
  for (uint k = 0; k < 4; k++) {
    new_vertex[4 * place + k] = v[k];
    new_middle[4 * place + k] = CLRAD_NONE;
  }
  new_level[place] = level[e] + 1;
  new_code[place] = code[e] | child << 2 * (CLRAD_DEPTH - 1 - level[e]);
}

/* lattice, polygon_of: of old and new vertices. */
__kernel void find_middles(__global const uint* vertex, __global uint* middle, __global const uint* level,
                           __global const uint* lattice, __global const uint* polygon_of, uint shift,
                           __global const uint* low, __global const uint* high, __global const uint* polygon,
                           __global const uint* order, __global const uint* number, uint slots, uint elements) {
  const uint e = get_global_id(0);
  if (e >= elements || level[e] == CLRAD_DEPTH) return;
  const uint corners = corners_of(vertex, e);
  for (uint k = 0; k < corners; k++) {
    if (middle[4 * e + k] != CLRAD_NONE) continue;
    const uint a = vertex[4 * e + k], b = edge_end(vertex, e, k);
    const uint i = half_way(lattice[2 * a], lattice[2 * b]), j = half_way(lattice[2 * a + 1], lattice[2 * b + 1]);
    /* Finer than any vertex made now: its code would be cut off to another's. */
    if ((i | j) & ((1u << shift) - 1)) continue;
    const uint at = find(low, high, polygon, order, slots, morton(i, j, shift), polygon_of[a]);
    if (at != CLRAD_NONE) middle[4 * e + k] = number[order[at]];
  }
}
