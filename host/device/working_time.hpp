// Time by the clock, without what compiling and loading kernels took: at their first use that is most of a small solve.
#pragma once
#include <chrono>

#include "clrad/device.hpp"

namespace clrad {

class WorkingTime {
 public:
  explicit WorkingTime(const Device& device) : device_(device) { restart(); }
  void restart() { start_ = Clock::now(), loading_before_ = device_.loading_seconds(); }
  /// Since the last restart.
  double seconds() const {
    return std::chrono::duration<double>(Clock::now() - start_).count() -
           (device_.loading_seconds() - loading_before_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Device& device_;
  Clock::time_point start_;
  double loading_before_ = 0;
};

}  // namespace clrad
