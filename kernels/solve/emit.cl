/* Receivers that a shooter's rays go to: those facing it (form_factor.cl), less those overlaid by a coplanar polygon
 * drawn on top of them, which see nothing. */

__kernel void drop_overlaid(__global uint* flags, __global const uint* overlaid, uint receivers) {
  const uint i = get_global_id(0);
  if (i < receivers && overlaid[i]) flags[i] = 0;
}
