// The order in which a shooter goes through its receivers: neighbours in space one after another, so that those that a packet takes
// together see much the same.
#pragma once
#include <cstdint>

#include "clrad/device.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

/// Receivers by the Morton code of their place in the frame (1024 cells a side; of one cell as they are numbered).
Array<std::uint32_t> in_order(Device& device, const PointArray& receivers);

}  // namespace clrad
