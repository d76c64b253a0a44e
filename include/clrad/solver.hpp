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

}  // namespace clrad
