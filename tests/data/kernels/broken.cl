/* does not build: used to test the message */
__kernel void broken(__global int* a) { a[0] = undeclared; }
