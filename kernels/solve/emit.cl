/* Receivers that a shooter's rays go to, in the order in which neighbours are neighbours (order.cl): those facing it (form_factor.cl),
 * less those that something covers, which see nothing. Of the receivers from `first` on: re-shooting goes to new vertices only. */

/* chosen[i]: whether rays go to receiver order[first + i]. facing[r - first] is of receiver r. */
__kernel void choose(__global const uint* facing, __global const uint* covered, __global const uint* order, uint first, uint count,
                     __global uint* chosen) {
  const uint i = get_global_id(0);
  if (i >= count) return;
  const uint receiver = order[first + i];
  chosen[i] = facing[receiver - first] && !covered[receiver];
}

/* Places in the order, from `first` on -> receivers. */
__kernel void receivers_at(__global uint* active, __global const uint* order, uint first, uint count) {
  const uint i = get_global_id(0);
  if (i < count) active[i] = order[first + active[i]];
}
