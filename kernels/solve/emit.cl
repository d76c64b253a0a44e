/* Receivers that a shooter's rays go to, in the order in which neighbours are neighbours (order.cl): those facing it (form_factor.cl),
 * less those that something covers, which see nothing. Of the receivers from `first` on: re-shooting goes to new vertices only. */

/* chosen[i]: whether rays go to receiver order[i]. facing[r - first] is of receiver r; those before `first` are left out. */
__kernel void choose(__global const uint* facing, __global const uint* covered, __global const uint* order, uint first, uint receivers,
                     __global uint* chosen) {
  const uint i = get_global_id(0);
  if (i >= receivers) return;
  const uint receiver = order[i];
  chosen[i] = receiver >= first && facing[receiver - first] && !covered[receiver];
}

/* Places in the order -> receivers. */
__kernel void receivers_at(__global uint* active, __global const uint* order, uint count) {
  const uint i = get_global_id(0);
  if (i < count) active[i] = order[active[i]];
}

/* chosen[i]: whether receiver order[i] is one of those from `first` on. */
__kernel void newer(__global const uint* order, uint first, uint receivers, __global uint* chosen) {
  const uint i = get_global_id(0);
  if (i < receivers) chosen[i] = order[i] >= first;
}
