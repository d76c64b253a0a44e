/* Lanes of a vector of 16 that were moved down to 8 or up within it.
 *
 * CLRAD_PLAIN is for oclgrind 21.10 (tests/kernels/oclgrind), which takes lane 11 of a named selection for uninitialised and knows no
 * reductions of vectors: lanes are shuffled by the built-in function, and lanes are joined by halves. */
#ifndef CLRAD_LANES_CL
#define CLRAD_LANES_CL

#ifdef CLRAD_PLAIN
#define UPPER(x) shuffle(x, (uint8)(8, 9, 10, 11, 12, 13, 14, 15))
#define UPPER_WIDE(x) shuffle(x, (ulong8)(8, 9, 10, 11, 12, 13, 14, 15))
#define ODDS(x) shuffle(x, (uint8)(1, 3, 5, 7, 9, 11, 13, 15))
#define UP1(x) shuffle(x, (uint16)(0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14))
#define UP2(x) shuffle(x, (uint16)(0, 1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13))
#define UP4(x) shuffle(x, (uint16)(0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11))
#else
#define UPPER(x) ((x).hi)
#define UPPER_WIDE(x) ((x).hi) /* of 8 bytes each */
#define ODDS(x) ((x).odd)
/* Up by d; the first d lanes keep their own value. */
#define UP1(x) ((x).s00123456789abcde)
#define UP2(x) ((x).s010123456789abcd)
#define UP4(x) ((x).s01230123456789ab)
#endif
#define UP8(x) ((x).s0123456701234567)

#endif
