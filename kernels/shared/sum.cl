/* Compensated addition (Kahan 1965, "Further remarks on reducing truncation errors"): *sum + *lost is the running total,
 * its error a few units in the last place however many terms there were. FP_CONTRACT is off, so the compiler keeps the
 * order. */
#ifndef CLRAD_SUM_CL
#define CLRAD_SUM_CL

void clrad_add(REAL* sum, REAL* lost, REAL term) {
  const REAL y = term - *lost;
  const REAL t = *sum + y;
  *lost = (t - *sum) - y;
  *sum = t;
}

#endif
