// From a kernel file to a built cl::Program: includes resolved, defines prepended, build log in the
// exception.
#pragma once
#include <string>

#include "clrad/device.hpp"

namespace clrad {

/// The text of kernels/<path>: embedded, or read from the folder CLRAD_KERNEL_DIR while developing.
std::string kernel_text(const std::string& path);

/// The whole program of one kernel file: defines, types.h, and each `#include "shared/x"` replaced, once, by
/// its text, with #line so that the log names the real file and line.
std::string program_source(const std::string& path, const DeviceOptions& options);

/// A compiler's log with the places of `source` that it calls "<kernel>:10" by their file and line: what NVIDIA's says, which
/// does not follow #line.
std::string name_places(const std::string& source, const std::string& log);

/// Throws DeviceError with file, options, device, driver and the full log.
cl::Program build_program(const cl::Context& context, const cl::Device& device, const DeviceInfo& info,
                          const DeviceOptions& options, const std::string& path);

}  // namespace clrad
