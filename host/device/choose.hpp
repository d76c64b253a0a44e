// Which device: --device, --cores, and the defaults that depend on it.
#pragma once
#include "clrad/device.hpp"

namespace clrad {

struct ChosenDevice {
  cl::Device device;
  DeviceInfo info;
};

/// Throws DeviceError when there is none, UsageError when `options.device` or `options.cores` fits none.
ChosenDevice choose_device(const DeviceOptions& options);

DeviceInfo describe_device(const cl::Device& device, unsigned index);

/// `options` with nothing left automatic; throws DeviceError when the device lacks what is asked for.
DeviceOptions resolve_options(const DeviceOptions& options, const DeviceInfo& info);

}  // namespace clrad
