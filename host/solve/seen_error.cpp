#include "solve/seen_error.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

// Enough for a mean; transport costs the square of the places for each sensor.
constexpr std::size_t most_places = 192, most_sensors = 16;
// Reflections after which, or less than this share of what was handed on before is left, it is cut off.
constexpr int most_reflections = 60;
constexpr double little = 0.02;

// Neighbouring check points taken together.
struct Clusters {
  std::vector<Point> point;
  std::vector<double> area;  // frame units
  std::vector<std::uint32_t> polygon;
  std::vector<double> first, second, by_chance;  // [place * bands + band]
};

Clusters clusters_of(const SolveState& state, const Solution& solution, std::span<const CheckPoint> points,
                     std::span<const double> first, std::span<const double> second) {
  const std::size_t bands = solution.bands, count = std::min(points.size(), most_places);
  double area = 0;
  for (const Polygon& p : solution.scene.polygons) area += p.area_m2();
  area /= state.metres_per_unit * state.metres_per_unit;
  Clusters places;
  for (std::size_t place = 0; place < count; ++place) {
    const std::size_t begin = place * points.size() / count, end = (place + 1) * points.size() / count;
    double weight = 0;
    std::vector<double> a(bands, 0), b(bands, 0), chance(bands, 0);
    for (std::size_t k = begin; k < end; ++k) {
      const double w = points[k].weight;
      weight += w;
      for (std::size_t band = 0; band < bands; ++band) {
        const double x = w * first[k * bands + band], y = w * second[k * bands + band];
        a[band] += x, b[band] += y, chance[band] += x * y;
      }
    }
    const CheckPoint& middle = points[(begin + end) / 2];
    places.point.push_back(middle.point);
    places.polygon.push_back(middle.polygon);
    places.area.push_back(weight * area);
    for (std::size_t band = 0; band < bands; ++band) {
      places.first.push_back(a[band] / weight), places.second.push_back(b[band] / weight);
      places.by_chance.push_back(chance[band] / (weight * weight));
    }
  }
  return places;
}

// [origin * places + place]: form factors from points to places. The share of a place is spread over a disk (Wallace et al. 1989, eq. 3), rows
// that are known to be 1 or that exceed it are made 1.
std::vector<double> factors_to(SolveState& state, const std::vector<Point>& origins, const Clusters& places) {
  const std::size_t count = places.point.size();
  const PointArray from(state.device, origins, "places"), to(state.device, places.point, "places");
  const Segments segments{&from, nullptr, std::uint32_t(origins.size()), &to, std::uint32_t(count)};
  Array<std::uint32_t> masks(state.device, origins.size() * segments.words_per_origin(), "what places see");
  state.engine.occluded(segments, masks);
  const std::vector<std::uint32_t> hidden = masks.download();
  const std::uint32_t words = segments.words_per_origin();
  std::vector<double> factor(origins.size() * count, 0);
  for (std::size_t o = 0; o < origins.size(); ++o) {
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const glm::dvec3 r = places.point[k].position - origins[o].position;
      const double r2 = glm::dot(r, r), above = glm::dot(r, origins[o].normal),
                   facing = -glm::dot(r, places.point[k].normal);
      if (!(above > 0 && facing > 0)) continue;
      if (hidden[o * words + k / 32] >> (k % 32) & 1) continue;
      const double f = above * facing / r2 * places.area[k] / (M_PI * r2 + places.area[k]);
      factor[o * count + k] = f;
      sum += f;
    }
    if (sum > 1 || (state.enclosure.closed && sum > 0))
      for (std::size_t k = 0; k < count; ++k) factor[o * count + k] /= sum;
  }
  return factor;
}

std::vector<Point> some_sensors(const Solution& solution) {
  std::vector<Point> points;
  const std::size_t all = solution.sensors.size(), count = std::min(all, most_sensors);
  for (std::size_t k = 0; k < count; ++k) {
    const SensorResult& s = solution.sensors[k * all / count];
    points.push_back({solution.frame.to_frame(s.position_m), s.normal, 0xffffffffu, 0xffffffffu});
  }
  return points;
}

// One more reflection, from the sensor's side: what a place's error counts by way of those that see it.
std::vector<double> handed_on(const std::vector<double>& counts, const std::vector<double>& between,
                              const std::vector<double>& reflectance) {
  const std::size_t n = counts.size();
  std::vector<double> next(n, 0);
  for (std::size_t j = 0; j < n; ++j)
    if (counts[j] != 0)
      for (std::size_t k = 0; k < n; ++k) next[k] += counts[j] * between[j * n + k];
  for (std::size_t k = 0; k < n; ++k) next[k] *= reflectance[k];
  return next;
}

double sum_of(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum;
}

}  // namespace

std::vector<double> seen_error_square(SolveState& state, const Solution& solution,
                                      std::span<const CheckPoint> points, std::span<const double> first,
                                      std::span<const double> second, bool regathered) {
  const std::size_t bands = solution.bands;
  const Clusters places = clusters_of(state, solution, points, first, second);
  const std::size_t n = places.point.size();
  const std::vector<Point> sensors = some_sensors(solution);
  std::vector<double> result(bands, 0);
  if (n == 0 || sensors.empty()) return result;
  const std::vector<double> to_sensors = factors_to(state, sensors, places);
  const bool further = state.interreflection && (regathered || !state.balanced);
  std::vector<double> between;
  if (further) between = factors_to(state, places.point, places);
  for (std::size_t b = 0; b < bands; ++b) {
    std::vector<double> reflectance(n);
    for (std::size_t k = 0; k < n; ++k)
      reflectance[k] = solution.material_of(places.polygon[k]).reflectance[b];
    double squares = 0;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      std::vector<double> counts(n), all(n, 0);
      for (std::size_t k = 0; k < n; ++k) counts[k] = to_sensors[s * n + k] * reflectance[k];
      if (!regathered) all = counts;
      for (int m = 0; further && m < most_reflections; ++m) {
        counts = handed_on(counts, between, reflectance);
        for (std::size_t k = 0; k < n; ++k) all[k] += counts[k];
        // Where rows are closed, an error that is the same everywhere is not handed on.
        if (state.balanced || sum_of(counts) < little * sum_of(all)) break;
      }
      double x = 0, y = 0, chance = 0;
      for (std::size_t k = 0; k < n; ++k) {
        x += all[k] * places.first[k * bands + b], y += all[k] * places.second[k * bands + b];
        chance += all[k] * all[k] * places.by_chance[k * bands + b];
      }
      squares += x * y - chance;
    }
    result[b] = std::max(0.0, squares / double(sensors.size()));
  }
  return result;
}

}  // namespace clrad
