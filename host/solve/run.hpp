// A solve under way, and the solvers that drive it.
#pragma once
#include <chrono>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/state.hpp"

namespace clrad {

struct Run {
  SolveState& state;
  Solution& solution;
  const std::vector<OccluderTriangle>& triangles;
  std::chrono::steady_clock::time_point start;
  double seconds_before = 0;  ///< of runs that this one goes on from

  /// Notes how far it is, tells the caller and keeps a checkpoint when one is due; false when the caller says stop.
  bool goes_on(double unshot_relative);
  /// Splits elements when that is asked for and due (or the solution has converged); true when that changed anything.
  bool refined(bool converged);
  double seconds() const;
};

/// Unshot / emitted power; leaves every patch's unshot power in state.power.
double unshot_relative(SolveState& state);

/// The solvers: true when converged, false when stopped.
bool shoot_until_converged(Run& run);
bool gather_until_converged(Run& run);

}  // namespace clrad
