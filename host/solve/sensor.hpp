// Irradiance at points: a gather over the solved surfaces, not an interpolation of neighbouring vertices.
#pragma once
#include <span>
#include <vector>

#include "clrad/frame.hpp"
#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "clrad/visibility.hpp"
#include "solve/lights.hpp"
#include "solve/nodes.hpp"

namespace clrad {

class Glass;

/// frame_of(scene), made larger where a sensor or a point or spot light stands far outside the scene.
Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors);

/// Points at which light is gathered, and how.
struct Gather {
  std::span<const Point> points;  ///< frame
  const Nodes& nodes;
  std::uint32_t rays = 8192;    ///< from a point, shared out by what each surface brings
  double near_diameters = 6.0;  ///< a patch closer than this many of its diameters is gathered by elements
  std::uint64_t seed = 1;
  std::uint32_t bands = 1;
};

/// [point * bands + band]
struct Gathered {
  std::vector<double> irradiance;
  std::vector<double> error;  ///< one standard error of the visibility sampling
  std::vector<double>
      flat;  ///< irradiance, were every element as bright as the mean of its patch; the same rays
};

/// H = sum over nodes of B x form factor x visible fraction at each point. Of each ray arrives what `glass` lets pass (null: there is
/// none). What `lights` (null: none) bring is added to both irradiances; its visibility is exact.
Gathered gather_at_points(Device& device, const Gather& gather, std::uint32_t patches,
                          VisibilityEngine& engine, const Glass* glass = nullptr, Lights* lights = nullptr);

/// H = sum over surfaces of B x form factor x visible fraction at each of options.sensors: by patches, and by elements
/// where the patch is near (closer than `near_diameters` of its own diameter). Rays (options.sensor_rays) are shared out by each surface's
/// contribution, and of each arrives what `glass` lets pass (null: there is none). The error is one standard error of the visibility sampling. What `lights` (null: none) bring is added; its visibility is exact.
/// `solution` needs scene, mesh, frame, vertex and patch irradiance. Sensors lie in no plane of the scene unless they are
/// within the snapping grid of a polygon that faces their way.
std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, const Glass* glass = nullptr,
                                            Lights* lights = nullptr);

}  // namespace clrad
