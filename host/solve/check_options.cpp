#include "solve/check_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "clrad/error.hpp"
#include "clrad/visibility.hpp"
#include "effects/effects.hpp"

namespace clrad {

void check_options(const SolveOptions& o) {
  if (!(o.converge > 0 && o.converge < 1))
    throw UsageError(fmt::format("--converge {} is not between 0 and 1", o.converge));
  const std::vector<std::string> engines = engine_names();
  if (o.engine != "auto" && std::find(engines.begin(), engines.end(), o.engine) == engines.end())
    throw UsageError(fmt::format("--engine '{}' does not exist; choose auto or one of: {}", o.engine,
                                 fmt::join(engines, ", ")));
  if (o.light_samples > 1u << 24)
    throw UsageError(fmt::format("--light-samples {} is more than {}", o.light_samples, 1u << 24));
  if (o.sensor_rays == 0 || o.sensor_rays > 1u << 28)
    throw UsageError(fmt::format("--sensor-rays {} is not between 1 and {}", o.sensor_rays, 1u << 28));
  if (!(o.checkpoint_every_s >= 0) || !std::isfinite(o.checkpoint_every_s))
    throw UsageError(fmt::format("--checkpoint-every {} is not a time in seconds", o.checkpoint_every_s));
  if (o.visibility_exact && o.estimator != Estimator::exact)
    throw UsageError(
        "--visibility-exact needs --form-factor exact: the other estimators are sums over samples");
  if (o.samples == 0 || o.samples > 4096)
    throw UsageError(fmt::format("--samples {} is not between 1 and 4096", o.samples));
  if (o.mesh.patch_edge_m < 0 || o.mesh.element_edge_m < 0 || !std::isfinite(o.mesh.patch_edge_m) ||
      !std::isfinite(o.mesh.element_edge_m))
    throw UsageError("--patch-edge and --element-edge are lengths in metres and cannot be negative");
  if (!(o.target_error >= 0 && o.target_error < 1))
    throw UsageError(
        fmt::format("--target-error {} is not a relative error between 0 and 1", o.target_error));
  if (!(o.time_budget_s >= 0) || !std::isfinite(o.time_budget_s))
    throw UsageError(fmt::format("--time-budget {} is not a time in seconds", o.time_budget_s));
  if (!o.error && (o.target_error > 0 || o.time_budget_s > 0))
    throw UsageError("--target-error and --time-budget need the estimate that --no-error switches off");
  if (o.shooters == 0) throw UsageError("--shooters 0: at least one patch shoots at a time");
  check_effect_names(o);
  const AdaptiveOptions& a = o.adaptive;
  if (!(a.tolerance >= 0) || !std::isfinite(a.tolerance))
    throw UsageError(fmt::format("--adaptive {} is not a relative difference of radiosity", a.tolerance));
  if (!std::isfinite(a.min_area_m2) || !std::isfinite(a.min_projected_area_px))
    throw UsageError("--min-area and --min-projected-area are finite numbers");
  if (!(a.min_area_m2 >= 0) || !(a.min_projected_area_px >= 0) || a.every == 0 || a.max_level > lattice_depth)
    throw UsageError(fmt::format(
        "--min-area and --min-projected-area cannot be negative, --refine-every is at least 1 and "
        "--max-level at most {}",
        lattice_depth));
  if (a.min_projected_area_px > 0 && (a.width == 0 || a.height == 0))
    throw UsageError("--min-projected-area needs a camera and a picture's size");
}

}  // namespace clrad
