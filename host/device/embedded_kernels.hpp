// Kernel texts compiled into the library by kernels/embed.cmake.
#pragma once

namespace clrad {

struct EmbeddedKernel {
  const char* path;  // relative to kernels/, with forward slashes
  const char* text;
};
extern const EmbeddedKernel embedded_kernels[];
extern const unsigned embedded_kernel_count;

}  // namespace clrad
