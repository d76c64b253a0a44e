// Irradiance at points: a gather over the solved surfaces, not an interpolation of neighbouring vertices.
#pragma once
#include <span>
#include <vector>

#include "clrad/frame.hpp"
#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "clrad/visibility.hpp"
#include "solve/lights.hpp"

namespace clrad {

class Glass;
struct LampLight;

/// frame_of(scene), made larger where a sensor or a point or spot light stands far outside the scene.
Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors);

/// H = sum over patches of form factor x mean over rays of visibility x radiosity, at each of options.sensors
/// (kernels/solve/sensor.cl). About options.sensor_rays rays go from a sensor to surfaces, an eighth of them by what each patch may bring and the
/// others by what varies; of each arrives what `glass` lets pass (null: there is none). With `lamps`, each ray's end asks anew
/// what they and `lights` bring to it, by up to one more ray, and to one light each; without, the mesh says. The error is one standard error of all these rays; what the mesh says of the rest has its own. What `lights` (null: none) bring to the sensors is added; its visibility is exact.
/// `regathered` says whether light at the vertices was gathered anew, too.
/// `solution` needs scene, mesh, frame, vertex and patch irradiance. Sensors lie in no plane of the scene unless they are
/// within the snapping grid of a polygon that faces their way.
std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, const Glass* glass = nullptr,
                                            Lights* lights = nullptr, const LampLight* lamps = nullptr,
                                            bool* regathered = nullptr);

/// How to gather for a check of the solution by itself.
struct CheckGather {
  const PointArray* points = nullptr;  ///< frame
  std::uint32_t rays = 64;             ///< about, from a point
  std::uint64_t seed = 1;
  bool flat = false;  ///< patches have that same radiosity everywhere
};

/// H at points by the solution's own radiosities, lamps and all, one way after the other: [point * bands + band]. With the same seed, flat or
/// not, the same rays. `shot`: the radiosity [band][patch] that patches have shot, of which B between vertices is a variation [W/m^2];
/// `reflecting`: it is, else B is that everywhere.
std::vector<std::vector<double>> gather_for_check(Device& device, const Solution& solution,
                                                  VisibilityEngine& engine, std::span<const double> shot,
                                                  bool reflecting, std::span<const CheckGather> ways,
                                                  const Glass* glass = nullptr, Lights* lights = nullptr);

}  // namespace clrad
