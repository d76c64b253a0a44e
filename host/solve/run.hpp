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
  double seconds_before = 0;         ///< of runs that this one goes on from
  VisibilityCounts counts_before{};  ///< of those
  double next_checkpoint = 0;        ///< seconds() from which one is due

  /// Notes how far it is, tells the caller and keeps a checkpoint when one is due; false when the caller says stop.
  bool goes_on(double unshot_relative);
  /// Splits elements when that is asked for and due (or the solution has converged); true when that changed anything.
  bool refined(bool converged);
  double seconds() const;
  VisibilityCounts counts() const;
  /// Keeps a checkpoint, and sets when the next is due: by options.checkpoint_every_s, and so that they take at most a
  /// twentieth of the time.
  void keep_checkpoint();
};

/// Unshot / emitted power; leaves every patch's unshot power in state.power.
double unshot_relative(SolveState& state);

/// The solvers: true when converged (or no more can be done), false when stopped.
bool shoot_until_converged(Run& run);
bool gather_until_converged(Run& run);

}  // namespace clrad
