#include "solve/more_rays.hpp"

#include <cmath>

namespace clrad {
namespace {

// Beyond that many times the rays a finer solve is the cheaper way.
constexpr std::uint32_t most_times = 16;
// The estimate is to come out below the target, not at it.
constexpr double somewhat_below = 0.95;

// Of the light at vertices, which stays as it is, relative to the mean of all sensors.
double of_vertices_relative(const Solution& solution, const SensorGather& gathered) {
  double irradiance = 0, squares = 0;
  for (const SensorResult& s : solution.sensors)
    for (const double h : s.irradiance) irradiance += h;
  for (const double e : gathered.of_vertices) squares += e;
  const double values = double(solution.sensors.size()) * solution.bands;
  return irradiance > 0 ? std::sqrt(squares / values) / (irradiance / values) : 0;
}

}  // namespace

std::uint32_t rays_for_target(const Solution& solution, const SolveOptions& options,
                              const SensorGather& gathered, double seconds, double seconds_left) {
  const double target = options.target_error;
  if (!(target > 0 && solution.report.error.sensors_relative > target)) return 0;
  if (solution.stopped || options.target_of == TargetOf::worst_sensor) return 0;
  double seen = 0, rays = 0;
  for (const ErrorPart& part : solution.report.error.sensor_parts)
    (part.name == "sensor rays" ? rays : seen) = part.relative;
  const double of_vertices = of_vertices_relative(solution, gathered),
               fixed = seen * seen + of_vertices * of_vertices,
               own = std::max(0.0, rays * rays - of_vertices * of_vertices);
  for (std::uint32_t times = 2; times <= most_times; times *= 2) {
    if (options.sensor_rays > most_sensor_rays / times || seconds * times > seconds_left) return 0;
    if (fixed + own * std::pow(times, -2 * order_of_sensor_rays) <= std::pow(somewhat_below * target, 2))
      return options.sensor_rays * times;
  }
  return 0;
}

}  // namespace clrad
