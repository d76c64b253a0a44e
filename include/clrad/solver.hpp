/// The solve itself.
#pragma once
#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/scene.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Progressive radiosity (Cohen et al. 1988; section 1.3 of Drucker & Schroeder): shoots the patch with the
/// most unshot power until unshot / emitted power < options.converge. Deterministic: same device and options,
/// same bits. Throws UsageError, InputError or DeviceError.
Solution solve(Device& device, const Scene& scene, const SolveOptions& options = {});

/// Where a solve to a target or in a time is to end up.
struct TargetForecast {
  SolveOptions options;       ///< settings of its last solve: mesh, samples, rays from sensors
  double error_relative = 0;  ///< estimated, of what options.target_of says
  bool meets = false;         ///< the target error, if one was asked for
  /// Of all solves until then, extrapolated from coarse ones. Of 120 (`./run bench targets`) 117 took within a factor of 1.5 of it;
  /// where a solve more is needed than was foreseen, twice as long.
  double seconds = 0;
  double probing_seconds = 0;  ///< what the forecast took
};

/// Foretells solve() with options.target_error or options.time_budget_s from one or two coarse solves: how the parts of their errors, and
/// their times, go on with finer settings. options.checkpoint and resume are left out. Throws as solve() does, and UsageError without a target.
TargetForecast forecast(Device& device, const Scene& scene, const SolveOptions& options);

}  // namespace clrad
