#include "device/choose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>

namespace clrad {
namespace {

std::vector<cl::Device> all_devices() {
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {  // the loader reports "no platform" as an error
  }
  std::vector<cl::Device> devices;
  for (const auto& platform : platforms) {
    std::vector<cl::Device> found;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
    } catch (const cl::Error&) {  // a platform without devices
    }
    devices.insert(devices.end(), found.begin(), found.end());
  }
  return devices;
}

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
  return s;
}

std::string device_lines() {
  std::string text;
  for (const auto& d : list_devices()) text += fmt::format("\n  {}: {} ({})", d.index, d.name, d.platform);
  return text;
}

}  // namespace

DeviceInfo describe_device(const cl::Device& device, unsigned index) {
  DeviceInfo info;
  info.index = index;
  info.name = device.getInfo<CL_DEVICE_NAME>();
  info.platform = cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>();
  info.driver = device.getInfo<CL_DRIVER_VERSION>();
  info.version = device.getInfo<CL_DEVICE_VERSION>();
  info.gpu = device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_GPU;
  info.fp64 = device.getInfo<CL_DEVICE_EXTENSIONS>().find("cl_khr_fp64") != std::string::npos;
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.largest_buffer_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  return info;
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (const auto& device : all_devices()) infos.push_back(describe_device(device, unsigned(infos.size())));
  return infos;
}

namespace {

// A sub-device of `cores` compute units, the same one for the whole life of the process: PoCL 3.1's worker threads still
// look at the device of a command after clFinish has returned, and crash where it has been released by then.
cl::Device part_of(const cl::Device& device, unsigned cores) {
  static std::mutex guard;
  static auto& parts = *new std::map<std::pair<cl_device_id, unsigned>, cl::Device>;
  const std::lock_guard lock(guard);
  cl::Device& part = parts[{device(), cores}];
  if (part()) return part;
  const cl_device_partition_property by_counts[] = {CL_DEVICE_PARTITION_BY_COUNTS,
                                                    cl_device_partition_property(cores),
                                                    CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
  std::vector<cl::Device> made;
  cl::Device(device).createSubDevices(by_counts, &made);
  return part = made.at(0);
}

}  // namespace

ChosenDevice choose_device(const DeviceOptions& options) {
  const auto devices = all_devices();
  if (devices.empty())
    throw DeviceError(
        "no OpenCL device found. On Debian, `apt install pocl-opencl-icd` gives one that runs on the CPU; "
        "a GPU needs its vendor's driver. `clrad devices` lists what there is.");
  std::vector<DeviceInfo> infos;
  infos.reserve(devices.size());
  for (const auto& device : devices) infos.push_back(describe_device(device, unsigned(infos.size())));

  std::size_t chosen = devices.size();
  const std::string& wish = options.device;
  if (wish.empty()) {
    for (std::size_t i = devices.size(); i-- > 0;)
      if (infos[i].gpu) chosen = i;
    if (chosen == devices.size()) chosen = 0;
  } else if (std::all_of(wish.begin(), wish.end(), [](unsigned char c) { return std::isdigit(c); })) {
    if (wish.size() < 6) chosen = std::min<std::size_t>(std::stoul(wish), devices.size());
  } else {
    for (std::size_t i = devices.size(); i-- > 0;)
      if (lower(infos[i].name).find(lower(wish)) != std::string::npos ||
          lower(infos[i].platform).find(lower(wish)) != std::string::npos)
        chosen = i;
  }
  if (chosen == devices.size())
    throw UsageError(fmt::format("no OpenCL device is called '{}'. There are:{}", wish, device_lines()));

  cl::Device device = devices[chosen];
  DeviceInfo info = infos[chosen];
  if (options.cores && options.cores != info.compute_units) {
    if (options.cores > info.compute_units)
      throw UsageError(fmt::format("--cores {} is more than the {} compute units of {}", options.cores,
                                   info.compute_units, info.name));
    try {
      device = part_of(device, options.cores);
    } catch (const cl::Error& e) {
      throw UsageError(fmt::format("{} cannot be divided for --cores {} (OpenCL error {})", info.name,
                                   options.cores, e.err()));
    }
    info.compute_units = options.cores;
  }
  return {device, info};
}

DeviceOptions resolve_options(const DeviceOptions& options, const DeviceInfo& info) {
  DeviceOptions o = options;
  if (o.precision == Precision::float64 && !info.fp64)
    throw DeviceError(fmt::format(
        "{} has no double precision (cl_khr_fp64); use --precision float or another --device", info.name));
  if (o.cores == 0) o.cores = info.compute_units;
  if (o.memory_bytes == 0) o.memory_bytes = info.memory_bytes / 2;
  if (o.memory_bytes > info.memory_bytes)
    throw UsageError(fmt::format("--memory {} is more than the {} bytes of {}", o.memory_bytes,
                                 info.memory_bytes, info.name));
  if (o.shape == Shape::automatic) o.shape = info.gpu ? Shape::trees : Shape::blocks;
  if (o.work_group_size == 0) o.work_group_size = info.gpu ? 128 : 64;
  if (o.packet_width == 0) o.packet_width = info.gpu ? 1 : 16;
  return o;
}

}  // namespace clrad
