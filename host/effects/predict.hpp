/// What a solve will take, before any of it is done.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/effects.hpp"

namespace clrad {

struct Prediction {
  double patches = 0, elements = 0, vertices = 0;  ///< of the first mesh
  double shoots = 0;                               ///< columns that will be traced
  double rays = 0;
  /// One effect, or "mesh and form factors": what any solve does.
  struct Part {
    std::string name;
    double seconds = 0, device_bytes = 0;  ///< NaN: depends on the light
  };
  std::vector<Part>
      parts;  ///< the common part first, then `effects` in their order; 0 where an effect does not run
  double seconds = 0, device_bytes = 0;
};

/// The probe: what one form factor takes on the device.
double seconds_per_factor(Device& device);

/// Counts the mesh, follows unshot power as if every surface saw all others evenly, and multiplies by what each step costs in
/// units of a small probe on the device: the form factors of some thousand receivers. Good to a factor of 2 or so where
/// scenes are like rooms; what adaptive subdivision adds is left out. Takes some tens of milliseconds once the kernel is compiled,
/// nearly all of them for the probe: who predicts often gives `factor_s`, what seconds_per_factor() said.
Prediction predict(Device& device, const Scene& scene, const SolveOptions& options,
                   const std::vector<Effect>& effects, double factor_s = 0);

}  // namespace clrad
