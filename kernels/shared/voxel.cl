/* The uniform grid that `chop` cuts rays with: one function for the place of a plane, one for the parameter
 * at which a segment crosses it, one for the voxel of a point on it. All float, whatever REAL is: the list of
 * a voxel is padded by more than all of this can be off.
 *
 * The pad, with u = 2^-24 and every coordinate within +-4 (segments: |direction| <= 8):
 *   end point, rounded to its high part      2 u      direction, rounded                 16 u (at t <= 1)
 *   plane - origin 8 u, then / direction     16 u     so a crossing is off by at most    34 u
 *   origin + t * direction                   12 u     minus the grid's corner             8 u
 *   times 1 / cell size                      16 u     place of the plane, rounded        12 u
 * so the voxel taken for a point of a segment, or the piece that a parameter falls in, is off by at most 66
 * u, below 128 u. The triangle/voxel overlap test rounds corners (2 u), the voxel's middle and the difference
 * (16 u), and the projections (60 u): again below 128 u. Together CLRAD_VOXEL_PAD = 256 u = 2^-16.
 */
#ifndef CLRAD_VOXEL_CL
#define CLRAD_VOXEL_CL

#define CLRAD_VOXEL_PAD 0x1p-16f

/* A frame is 12 floats: the grid's lower corner, the cell's size, its reciprocal, and the number of cells,
 * per axis. */
#define CLRAD_FRAME_FLOATS 12

/* Plane i of the axis: cell i lies between planes i and i + 1. */
static inline float clrad_plane(__global const float* frame, uint axis, int i) {
  return frame[axis] + convert_float(i) * frame[3 + axis];
}

/* The cell of coordinate x, clamped to [low, high]. NaN falls into cell `low`. */
static inline int clrad_cell(__global const float* frame, uint axis, float x, int low, int high) {
  float c = floor((x - frame[axis]) * frame[6 + axis]);
  float l = convert_float(low), h = convert_float(high);
  c = c > l ? c : l;
  c = c < h ? c : h;
  return convert_int(c);
}

/* Where the segment crosses plane i, from the integer i alone: both neighbours of a plane get the same
 * parameter. Infinite or NaN where the direction is (almost) along the plane; such a segment is in one cell
 * and crosses none. */
static inline float clrad_crossing(__global const float* frame, uint axis, int i, float origin, float direction) {
  return (clrad_plane(frame, axis, i) - origin) / direction;
}

#endif
