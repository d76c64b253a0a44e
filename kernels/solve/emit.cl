/* Receivers that a shooter's rays go to: those facing it (form_factor.cl), less those that something
 * covers, which see nothing. flags[i] is receiver first + i: re-shooting goes to new vertices only. */

__kernel void drop_covered(__global uint* flags, __global const uint* covered, uint first, uint count) {
  const uint i = get_global_id(0);
  if (i < count && covered[first + i]) flags[i] = 0;
}

/* Numbers within the range -> receivers. */
__kernel void number_active(__global uint* active, uint first, uint count) {
  const uint i = get_global_id(0);
  if (i < count) active[i] += first;
}
