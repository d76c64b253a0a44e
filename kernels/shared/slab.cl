/* Clipping of rays to a box. */
#ifndef CLRAD_SLAB_CL
#define CLRAD_SLAB_CL

/* Narrows [*enter, *leave] to the part of base + s direction inside one slab. */
void clrad_slab(REAL base, REAL direction, REAL low, REAL high, REAL* enter, REAL* leave) {
  if (direction == (REAL)0) {
    if (base < low || base > high) *leave = *enter - (REAL)1;
    return;
  }
  const REAL a = (low - base) / direction, b = (high - base) / direction;
  const REAL near = a < b ? a : b, far = a < b ? b : a;
  *enter = near > *enter ? near : *enter;
  *leave = far < *leave ? far : *leave;
}

#endif
