/* What the device's compiler made of the shared structs; the first test compares it with the host's view.
 * Pre: out holds 6 values, 9 with CLRAD_FP64. One work-item. */
#define OFFSET(type, field) ((uint)(size_t)((__global char*)&base_##type->field - (__global char*)base_##type))

__kernel void layout(__global uint* out, __global const clrad_point_float* base_clrad_point_float,
                     __global const clrad_triangle* base_clrad_triangle
#ifdef CLRAD_FP64
                     , __global const clrad_point_double* base_clrad_point_double
#endif
) {
  if (get_global_id(0) != 0) return;
  out[0] = sizeof(clrad_point_float);
  out[1] = OFFSET(clrad_point_float, nx);
  out[2] = OFFSET(clrad_point_float, plane);
  out[3] = sizeof(clrad_triangle);
  out[4] = OFFSET(clrad_triangle, x0_lo);
  out[5] = OFFSET(clrad_triangle, plane);
#ifdef CLRAD_FP64
  out[6] = sizeof(clrad_point_double);
  out[7] = OFFSET(clrad_point_double, nx);
  out[8] = OFFSET(clrad_point_double, plane);
#endif
}
