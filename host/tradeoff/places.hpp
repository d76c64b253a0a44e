// Points of the surfaces at which two answers are compared, and how far apart they are there.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/solution.hpp"

namespace clrad {

struct Place {
  std::uint32_t polygon = 0;
  double u = 0, v = 0;   ///< parameters of the polygon, as PolygonMesh has them
  double weight_m2 = 0;  ///< the area that it stands for
  Sensor sensor;         ///< on the polygon's front
};

/// About `count` points, stratified: each polygon gets its share by area, spread as Roberts' R2 sequence (2018) with a random
/// shift. Weighted means over them estimate means over the scene's area without bias. Covered ones are among them.
std::vector<Place> stratified_places(const Scene& scene, std::uint32_t count, std::uint64_t seed);

/// `count` points, covered ones among them, half of them by area and half where the irradiance of a solution varies, as a few small places can
/// be most of an RMS error (points_in_elements()). Weighted means over them estimate the same.
std::vector<Place> varying_places(const Solution& solution, std::uint32_t count, std::uint64_t seed);

/// On the front of a polygon, at its parameters (u, v).
Sensor sensor_at(const Polygon& polygon, double u, double v);

/// Those that nothing stands on or encloses, by the solve's own test of vertices.
std::vector<Place> exposed_places(Device& device, const Scene& scene, const std::vector<Place>& places);

/// Irradiance as displayed, [place][band] [W/m^2 or lm/m^2].
std::vector<double> irradiance_at(const Solution& solution, std::span<const Place> places);

/// DESIGN's measure of error: sqrt(mean over points and bands of (H - H_ref)^2) / mean(H_ref). Both are [point][band];
/// weights one a point (empty: all alike). NaN where the reference is dark.
double rms_relative(std::span<const double> values, std::span<const double> reference,
                    std::span<const double> weights, std::uint32_t bands);
/// mean(H_ref) of that.
double mean_over(std::span<const double> reference, std::span<const double> weights, std::uint32_t bands);

}  // namespace clrad
