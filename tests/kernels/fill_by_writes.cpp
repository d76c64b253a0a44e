// For oclgrind's check of uninitialised memory, preloaded by tests/kernels/oclgrind: version 21.10 counts what a kernel or a
// write stored as initialised, but not what clEnqueueFillBuffer did. So fills become writes of the same bytes.
#include <CL/cl.h>

#include <cstring>
#include <vector>

extern "C" cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void* pattern,
                                      size_t pattern_size, size_t offset, size_t size, cl_uint waits,
                                      const cl_event* wait_list, cl_event* event) {
  if (pattern_size == 0 || size % pattern_size != 0) return CL_INVALID_VALUE;
  std::vector<char> bytes(size);
  for (size_t at = 0; at < size; at += pattern_size) std::memcpy(&bytes[at], pattern, pattern_size);
  return clEnqueueWriteBuffer(queue, buffer, CL_TRUE, offset, size, bytes.data(), waits, wait_list, event);
}
