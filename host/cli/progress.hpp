// The line that shows how far a solve is, and Ctrl-C.
#pragma once
#include <chrono>

#include "clrad/options.hpp"

namespace clrad::cli {

/// Redraws one line on stderr when that is a terminal, a few times a second; says nothing otherwise.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet, double converge);
  ~ProgressLine() { clear(); }
  void show(const Progress& progress);
  void say(const char* stage);
  void clear();

 private:
  bool on_;
  bool drawn_ = false;
  double converge_;
  std::chrono::steady_clock::time_point last_{};
};

/// From the first Ctrl-C (or SIGTERM) on, interrupted() is true; a second one ends the program at once.
void watch_for_interrupt();
bool interrupted();

}  // namespace clrad::cli
