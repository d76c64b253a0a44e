#pragma once
#include "clrad/device.hpp"

namespace clrad::test {

/// For DeviceOptions::cores: one compute unit where the device can be divided, else 0, all of it. GPUs mostly cannot be.
inline unsigned one_core() {
  static const unsigned cores = [] {
    try {
      return Device({.cores = 1}).options().cores;
    } catch (const UsageError&) {
      return 0u;
    }
  }();
  return cores;
}

}  // namespace clrad::test
