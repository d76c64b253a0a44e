/* Receivers that a shooter's rays go to: those facing it (form_factor.cl), less those that something
 * covers, which see nothing. */

__kernel void drop_covered(__global uint* flags, __global const uint* covered, uint receivers) {
  const uint i = get_global_id(0);
  if (i < receivers && covered[i]) flags[i] = 0;
}
