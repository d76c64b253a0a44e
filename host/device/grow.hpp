#pragma once

#include "clrad/device.hpp"

namespace clrad {

// Makes an array at least `count` long; what it held is lost. `what` names it where memory runs out.
template <class ArrayType>
void grow(ArrayType& array, Device& device, std::uint64_t count, const char* what) {
  if (array.size() < count || !array.buffer()()) array = ArrayType(), array = ArrayType(device, count, what);
}

}  // namespace clrad
