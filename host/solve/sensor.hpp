// Irradiance at points: a gather over the solved surfaces, not an interpolation of neighbouring vertices.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "clrad/frame.hpp"
#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "clrad/visibility.hpp"
#include "mesh/build.hpp"
#include "solve/lights.hpp"
#include "solve/surroundings.hpp"

namespace clrad {

class Glass;
struct RayEnds;

/// frame_of(scene), made larger where a sensor or a point or spot light stands far outside the scene.
Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors);

/// How light was gathered at the sensors.
struct SensorGather {
  LampLight lamps;             ///< what comes straight from these was asked for anew at every ray's end
  std::vector<Point> sensors;  ///< frame
  std::uint64_t rays = 0;      ///< all in all
  std::optional<Surroundings> around;  ///< what the rays saw
  /// Squares of what the errors of light that was gathered anew at vertices make at the sensors, [sensor * bands + band]; empty: it was not.
  std::vector<double> of_vertices;
};

/// H = sum over patches of form factor x mean over rays of visibility x radiosity, at each of options.sensors
/// (kernels/solve/sensor.cl). About options.sensor_rays rays go from a sensor to surfaces, an eighth of them by what each patch may bring and the
/// others by what varies; of each arrives what `glass` lets pass (null: there is none). Each ray's end asks anew
/// what `gathered.lamps` and `lights` bring to it, by up to one more ray, and to one light each. The error is one standard error of all these rays; what the mesh says of the rest has its own. What `lights` (null: none) bring to the sensors is added; its visibility is exact.
/// Notes the rest of `gathered`.
/// `solution` needs scene, mesh, frame, vertex and patch irradiance. Sensors lie in no plane of the scene unless they are
/// within the snapping grid of a polygon that faces their way.
std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, SensorGather& gathered,
                                            const Glass* glass = nullptr, Lights* lights = nullptr);

/// The same with options.sensor_rays of their own, which see what those before saw.
std::vector<SensorResult> gather_again(Device& device, const Solution& solution, VisibilityEngine& engine,
                                       const SolveOptions& options, const SensorGather& gathered,
                                       const Glass* glass = nullptr, Lights* lights = nullptr);

/// How to gather at points.
struct Way {
  std::uint32_t rays = 0, seed = 0;
  bool without_lamps = false;  ///< Surroundings' [1]: what lamps emit is left out
  bool asks = false;           ///< lamps and lights are asked at rays' ends
  bool few = false;            ///< rays for a patch
  double first_share = 1;  ///< of the rays, shared out by what patches bring; the others by what these find
};

/// H at `points` and one standard error of it by their rays, [point * bands + band], in batches of at most `most_bytes` (and a quarter of
/// what memory is left). Without what lights bring.
void gather_at(Device& device, const Solution& solution, const Surroundings& around, const PointArray& points,
               VisibilityEngine& engine, const Way& way, const Glass* glass, Lights* lights,
               RealArray& irradiance, RealArray& error, std::uint64_t most_bytes = ~std::uint64_t(0));

/// About what gather_at() takes of the device's memory while it lasts, beside the solution, when `first` of the rays are shared out by what patches
/// bring: as many points at a time as the memory that is left now has room for.
double gather_bytes(const Device& device, double patches, double bands, std::uint64_t points,
                    std::uint32_t rays, double first);
/// The same of gather_at_sensors(), but for the vertices.
double sensor_gather_bytes(const Device& device, double patches, double bands, std::uint64_t sensors,
                           std::uint32_t rays);

/// Tells `see` where rays from `points` end, some points at a time.
void look_from(Device& device, const Solution& solution, const Surroundings& around, const PointArray& points,
               VisibilityEngine& engine, const Way& way, const Glass* glass,
               const std::function<void(const RayEnds&)>& see);

/// Adds what lights bring to irradiance[point * bands + band]; their visibility is exact.
void add_light_of(Lights& lights, Device& device, VisibilityEngine& engine, const PointArray& points,
                  std::uint32_t bands, std::vector<double>& irradiance);

}  // namespace clrad
