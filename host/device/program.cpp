#include "device/program.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "device/embedded_kernels.hpp"

namespace clrad {
namespace {

void append_resolved(const std::string& path, std::set<std::string>& seen, std::string& out) {
  if (!seen.insert(path).second) return;
  std::istringstream text(kernel_text(path));
  out += fmt::format("#line 1 \"kernels/{}\"\n", path);
  unsigned number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    constexpr std::string_view directive = "#include \"";
    if (line.starts_with(directive)) {
      const auto end = line.find('"', directive.size());
      append_resolved(line.substr(directive.size(), end - directive.size()), seen, out);
      out += fmt::format("#line {} \"kernels/{}\"\n", number + 1, path);
    } else {
      out += line;
      out += '\n';
    }
  }
}

// For tests/kernels/programs: what was built, a line a program. One write, since processes share the file.
void note_build(const std::string& path, const DeviceOptions& options, const std::string& source) {
  const char* log = std::getenv("CLRAD_BUILD_LOG");
  if (!log) return;
  const std::string line =
      fmt::format("{}\t{} width {} group {}\t{:016x}\n", path,
                  options.precision == Precision::float64 ? "double" : "float", options.packet_width,
                  options.work_group_size, std::hash<std::string>()(source));
  std::ofstream(log, std::ios::app) << line << std::flush;
}

}  // namespace

std::string kernel_text(const std::string& path) {
  if (const char* folder = std::getenv("CLRAD_KERNEL_DIR")) {
    std::ifstream file(std::string(folder) + "/" + path);
    if (!file)
      throw DeviceError(fmt::format("CLRAD_KERNEL_DIR is {}, but {} cannot be read there", folder, path));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  for (unsigned i = 0; i < embedded_kernel_count; ++i)
    if (path == embedded_kernels[i].path) return embedded_kernels[i].text;
  throw DeviceError(fmt::format("there is no kernel file {}", path));
}

std::string program_source(const std::string& path, const DeviceOptions& options) {
  const bool fp64 = options.precision == Precision::float64;
  // PoCL fuses a*b+c unless told not to; bit-exactness across widths and devices needs it off everywhere.
  std::string source = fmt::format(
      "{}#pragma OPENCL FP_CONTRACT OFF\n"
      "#define REAL {}\n#define CLRAD_POINT_T clrad_point_{}\n#define CLRAD_WIDTH {}\n#define "
      "CLRAD_WORK_GROUP {}\n",
      fp64 ? "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n#define CLRAD_FP64 1\n" : "",
      fp64 ? "double" : "float", fp64 ? "double" : "float", options.packet_width, options.work_group_size);
  std::set<std::string> seen;
  append_resolved("shared/types.h", seen, source);
  append_resolved(path, seen, source);
  return source;
}

std::string name_places(const std::string& source, const std::string& log) {
  std::vector<std::string> places;  // of each line of the source
  std::istringstream text(source);
  std::string file = "preamble";
  unsigned number = 0;
  for (std::string line; std::getline(text, line);) {
    places.push_back(fmt::format("{}:{}", file, ++number));
    static const std::regex directive("#line ([0-9]+) \"(.*)\"");
    std::smatch given;
    if (!std::regex_match(line, given, directive)) continue;
    number = unsigned(std::stoul(given[1])) - 1;
    file = given[2];
  }
  static const std::regex anonymous("<[a-z ]+>:([0-9]{1,9})");
  std::string named;
  auto end = log.begin();
  for (std::sregex_iterator hit(log.begin(), log.end(), anonymous), none; hit != none; ++hit) {
    const std::size_t line = std::stoul((*hit)[1]);
    named.append(end, (*hit)[0].first);
    named += line >= 1 && line <= places.size() ? places[line - 1] : hit->str();
    end = (*hit)[0].second;
  }
  return named.append(end, log.end());
}

cl::Program build_program(const cl::Context& context, const cl::Device& device, const DeviceInfo& info,
                          const DeviceOptions& options, const std::string& path) {
  std::string flags = "-cl-std=CL1.2";
  cl_device_fp_config config = 0;
  if (device.getInfo(CL_DEVICE_SINGLE_FP_CONFIG, &config) == CL_SUCCESS &&
      (config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT))
    flags += " -cl-fp32-correctly-rounded-divide-sqrt";
  const std::string source = program_source(path, options);
  note_build(path, options, source);
  cl::Program program(context, source);
  try {
    program.build(device, flags.c_str());
  } catch (const cl::Error&) {
    std::string log;
    program.getBuildInfo(device, CL_PROGRAM_BUILD_LOG, &log);
    throw DeviceError(
        fmt::format("kernels/{} does not build.\n  device   {}\n  driver   {} ({})\n  options  {}, {}, width "
                    "{}, work-group {}\n{}",
                    path, info.name, info.driver, info.version, flags,
                    options.precision == Precision::float64 ? "double" : "float", options.packet_width,
                    options.work_group_size, name_places(source, log)));
  }
  return program;
}

}  // namespace clrad
