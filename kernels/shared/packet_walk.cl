/* A packet of any segments through the tree, leaf after leaf: the hull of all segments against the eight children of a node at once,
 * then each segment against those that it meets. */
#ifndef CLRAD_PACKET_WALK_CL
#define CLRAD_PACKET_WALK_CL
#include "shared/packet_test.cl"
#include "shared/slabs.cl"

typedef struct packet_walk {
  slabs lanes;
  shaft hull;
  uint code[STACK + WIDE]; /* nodes and leaves to come, the last first... */
  float entry[STACK + WIDE]; /* ... and where the first segment enters them */
  uint top;
} packet_walk;

static inline void begin_walk(packet_walk* w, const packet* p) {
  w->lanes = slabs_of(p->ax, p->ay, p->az, p->dx, p->dy, p->dz);
  w->hull = shaft_between(box_of_lanes(p->ax, p->ay, p->az), box_of_lanes(p->bx, p->by, p->bz));
  w->code[0] = 0;
  w->entry[0] = 0.0f;
  w->top = 1;
}

/* The next leaf that some segment may meet before its `until`, those entered first before others: its first triangle, and how many
 * there are; CLRAD_NONE at the end. last: the greatest of until. */
static inline uint next_leaf(packet_walk* w, clrad_floats until, float last, __global const uint* nodes, uint* triangles) {
  while (w->top > 0) {
    const uint code = w->code[--w->top], begin = w->top;
    if (w->entry[w->top] > last) continue;
    if (code & 7u) {
      *triangles = code & 7u;
      return code >> 3;
    }
    __global const uint* node = nodes + (ulong)WIDE_WORDS * (code >> 3);
    uint met = children_met(&w->hull, (__global const float*)node);
    for (; met; met &= met - 1) {
      const uint child = lowest_bit(met);
      const clrad_floats nowhere = 2.0f;
      clrad_floats entry;
      const clrad_ints m = meets(&w->lanes, (__global const float*)node, child, until, &entry);
      if (clrad_bits_of_any(m) == 0) continue;
      const float first = least_lane(m ? entry : nowhere);
      uint at = w->top++;
      for (; at > begin && w->entry[at - 1] < first; --at) {
        w->code[at] = w->code[at - 1];
        w->entry[at] = w->entry[at - 1];
      }
      w->code[at] = node[6 * WIDE + child];
      w->entry[at] = first;
    }
  }
  return CLRAD_NONE;
}

#endif
