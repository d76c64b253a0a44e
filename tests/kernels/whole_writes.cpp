// For oclgrind's check of uninitialised memory, preloaded by tests/kernels/oclgrind. Version 21.10 knows what kernels store and what a
// write to the whole of a buffer does; but fills count for nothing, and a write or a copy to a part makes it forget the
// rest. So bytes are written to a buffer of their size, and a kernel moves them where they belong. And of a buffer in the place
// of a smaller one that was released it knows no more than that one's size: nothing is released.
#include <CL/cl.h>
#include <dlfcn.h>

#include <cstring>
#include <vector>

namespace {

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

cl_int move_bytes(cl_command_queue queue, cl_mem from, cl_mem to, size_t from_offset, size_t to_offset,
                  size_t size, cl_event* event) {
  static const char* source =
      "kernel void move_bytes(global const uchar* from, ulong from_offset, global uchar* to, ulong "
      "to_offset) {"
      "  to[to_offset + get_global_id(0)] = from[from_offset + get_global_id(0)];"
      "}";
  // clrad has one context a process at a time; a program is kept as long as its context lasts, and that as long as the program.
  static cl_context context = nullptr;
  static cl_kernel kernel = nullptr;
  cl_context here = nullptr;
  cl_int error = clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(here), &here, nullptr);
  if (error != CL_SUCCESS) return error;
  if (here != context) {
    cl_program program = clCreateProgramWithSource(here, 1, &source, nullptr, &error);
    if (error != CL_SUCCESS) return error;
    error = clBuildProgram(program, 0, nullptr, nullptr, nullptr, nullptr);
    if (error != CL_SUCCESS) return error;
    kernel = clCreateKernel(program, "move_bytes", &error);
    if (error != CL_SUCCESS) return error;
    context = here;
  }
  const cl_ulong from_at = from_offset, to_at = to_offset;
  clSetKernelArg(kernel, 0, sizeof(from), &from);
  clSetKernelArg(kernel, 1, sizeof(from_at), &from_at);
  clSetKernelArg(kernel, 2, sizeof(to), &to);
  clSetKernelArg(kernel, 3, sizeof(to_at), &to_at);
  error = clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &size, nullptr, 0, nullptr, event);
  return error == CL_SUCCESS ? clFinish(queue) : error;
}

size_t size_of(cl_mem buffer) {
  size_t size = 0;
  clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof(size), &size, nullptr);
  return size;
}

}  // namespace

extern "C" cl_int clEnqueueCopyBuffer(cl_command_queue queue, cl_mem from, cl_mem to, size_t from_offset,
                                      size_t to_offset, size_t size, cl_uint, const cl_event*,
                                      cl_event* event) {
  const cl_int error = clFinish(queue);
  return error == CL_SUCCESS ? move_bytes(queue, from, to, from_offset, to_offset, size, event) : error;
}

extern "C" cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool, size_t offset,
                                       size_t size, const void* from, cl_uint waits,
                                       const cl_event* wait_list, cl_event* event) {
  static const auto real = next<decltype(clEnqueueWriteBuffer)>("clEnqueueWriteBuffer");
  if (offset == 0 && size == size_of(buffer))
    return real(queue, buffer, CL_TRUE, offset, size, from, waits, wait_list, event);
  cl_context context = nullptr;
  cl_int error = clGetMemObjectInfo(buffer, CL_MEM_CONTEXT, sizeof(context), &context, nullptr);
  if (error != CL_SUCCESS) return error;
  cl_mem whole = clCreateBuffer(context, CL_MEM_READ_WRITE, size, nullptr, &error);
  if (error != CL_SUCCESS) return error;
  error = real(queue, whole, CL_TRUE, 0, size, from, waits, wait_list, nullptr);
  if (error == CL_SUCCESS) error = move_bytes(queue, whole, buffer, 0, offset, size, event);
  return error;
}

extern "C" cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void* pattern,
                                      size_t pattern_size, size_t offset, size_t size, cl_uint waits,
                                      const cl_event* wait_list, cl_event* event) {
  if (pattern_size == 0 || size % pattern_size != 0) return CL_INVALID_VALUE;
  std::vector<char> bytes(size);
  for (size_t at = 0; at < size; at += pattern_size) std::memcpy(&bytes[at], pattern, pattern_size);
  return clEnqueueWriteBuffer(queue, buffer, CL_TRUE, offset, size, bytes.data(), waits, wait_list, event);
}

extern "C" cl_int clReleaseMemObject(cl_mem) {
  return CL_SUCCESS;
}
