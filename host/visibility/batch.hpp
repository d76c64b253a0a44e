/// What the engines share: what they ask of segments, which of them a batch has, and scratch arrays that only grow.
#pragma once
#include <algorithm>
#include <cstdint>

#include "clrad/device.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

/// Throws UsageError when segments name more ends than there are.
void check_segments(const Segments& segments);

/// Segments of chosen origins [first_origin, ...) and samples [first_sample, first_sample + run).
struct Batch {
  std::uint32_t first_origin = 0, origins = 0, first_sample = 0, run = 1;
  std::uint32_t rays() const { return origins * run; }
};

/// Makes `array` at least `count` long; its contents are lost when it has to grow.
template <class T>
void need(Device& device, Array<T>& array, std::uint64_t count, const char* what) {
  if (array.size() >= count && array.size() > 0) return;
  const std::uint64_t room = std::max<std::uint64_t>(count + count / 8, 1024);
  array = {};  // first: the budget need not hold both
  array = Array<T>(device, room, what);
}

}  // namespace clrad
