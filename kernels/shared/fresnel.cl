/* Fresnel's equations for unpolarised light (Born & Wolf, section 1.5), for the picture and for the solve alike. */
#ifndef CLRAD_FRESNEL_CL
#define CLRAD_FRESNEL_CL

/* The share R that a surface between indices n1 (where the light comes from) and n2 reflects at cos_i, the cosine of
 * incidence; cos_t gets that of refraction, 0 at total reflection (the share is then 1):
 *     cos^2 t = 1 - (n1 / n2)^2 (1 - cos^2 i),   R = (r_s^2 + r_p^2) / 2,
 *     r_s = (n1 cos i - n2 cos t) / (n1 cos i + n2 cos t),  r_p = (n2 cos i - n1 cos t) / (n2 cos i + n1 cos t) */
static inline REAL clrad_fresnel(REAL n1, REAL n2, REAL cos_i, REAL* cos_t) {
  const REAL eta = n1 / n2, square = (REAL)1 - eta * eta * ((REAL)1 - cos_i * cos_i);
  *cos_t = 0;
  if (!(square > (REAL)0)) return 1;
  const REAL c = sqrt(square);
  const REAL r_s = (n1 * cos_i - n2 * c) / (n1 * cos_i + n2 * c);
  const REAL r_p = (n2 * cos_i - n1 * c) / (n2 * cos_i + n1 * c);
  *cos_t = c;
  return (REAL)0.5f * (r_s * r_s + r_p * r_p);
}

/* A sheet is two such surfaces in one: light between them goes to and fro, which sums to 2 R / (1 + R). */
static inline REAL clrad_sheet_reflects(REAL fresnel) { return (REAL)2 * fresnel / ((REAL)1 + fresnel); }

#endif
