// Adaptive integration of many pairs at once on the device. Launches kernels/viewfactors/integrate.cl.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "clrad/device.hpp"
#include "viewfactors/pairs.hpp"

namespace clrad {

/// What is asked of one pair, and the parts that make it up.
struct PairTask {
  std::vector<PairPart> parts;
  double least = 0;     ///< an error below this is good enough whatever the value [frame units squared]
  bool hidden = false;  ///< some part has occluders
};

/// A F of one pair [frame units squared].
struct PairIntegral {
  double value = 0;
  double error = 0;   ///< estimate; holds `unsure`
  double unsure = 0;  ///< of that, what the kernel had no room to resolve: halve the shooter
  std::uint32_t cells = 0;
  bool done = false;  ///< nothing was left to split that had to be; false only when stopped
};

struct IntegrationLimits {
  double relative = 1e-4;               ///< asked of each pair's error / value
  std::uint32_t most_cells = 50000;     ///< a pair
  std::uint32_t stack_pieces = 64;      ///< pieces of a shooter that a point may have waiting
  std::uint64_t points_at_once = 4096;  ///< with occluders: each has a stack of its own
};

struct IntegrationCounts {
  std::uint64_t rounds = 0, cells = 0, points = 0;
};

/// Cells are split, all pairs' in the same rounds, until each pair's error is at most max(relative x value, least) or
/// nothing more can be split. `go_on` is asked before each round; when it says no the result is what there is, with its
/// error; of pairs that have not been looked at, 0.
std::vector<PairIntegral> integrate(Device& device, const std::vector<PairTask>& tasks,
                                    const IntegrationLimits& limits, IntegrationCounts& counts,
                                    const std::function<bool()>& go_on = {});

/// Device bytes that a part takes.
std::uint64_t bytes_of(const PairPart& part);

}  // namespace clrad
