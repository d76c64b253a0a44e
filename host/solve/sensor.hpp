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

/// frame_of(scene), made larger where a sensor or a point or spot light stands far outside the scene.
Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors);

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
