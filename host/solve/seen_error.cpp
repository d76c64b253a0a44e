#include "solve/seen_error.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

#include "output/displayed.hpp"
#include "solve/balance.hpp"
#include "solve/check_gather.hpp"
#include "solve/seen_points.hpp"

namespace clrad {
namespace {

// Enough for what is handed on, whose cost is the square of the places.
constexpr std::size_t most_places = 128;
// Reflections after which, or less than this share of what was handed on before is left, it is cut off.
constexpr int most_reflections = 60;
constexpr double little = 0.02;
// Of what the sum over so few points has by chance, that is left in it: what the rest says is not sure to less. From
// solves with 131,072 rays a sensor in the reference's rooms.
constexpr double unsure = 0.5;
// Variances that the square of a mean has to exceed.
constexpr double significant = 4;

// Clusters with a share of the surfaces each: the check points, or neighbours among them taken together.
struct Clusters {
  std::vector<Point> point;
  std::vector<double> area;  // frame units
  std::vector<std::uint32_t> polygon, element;
};

// The `place`-th of `most` is those from ceil(place * points / most) on.
Clusters clusters_of(const SolveState& state, const Solution& solution, std::span<const CheckPoint> points,
                     std::size_t most) {
  const std::size_t n = points.size(), count = std::min(n, most);
  const double area = exposed_area_m2(solution) / (state.metres_per_unit * state.metres_per_unit);
  Clusters places;
  for (std::size_t place = 0; place < count; ++place) {
    const std::size_t begin = (place * n + count - 1) / count, end = ((place + 1) * n + count - 1) / count;
    double weight = 0;
    for (std::size_t k = begin; k < end; ++k) weight += points[k].weight;
    const CheckPoint& middle = points[(begin + end) / 2];
    places.point.push_back(middle.point);
    places.polygon.push_back(middle.polygon);
    places.element.push_back(middle.where.element);
    places.area.push_back(weight * area);
  }
  return places;
}

// [origin * places + place]: form factors from points to places. The share of a place is spread over a disk (Wallace et al. 1989, eq. 3), which
// makes too little of what is near, and few places say little of how much is hidden: rows are made to sum to `row_sum` on average, and to 1 where
// they exceed that.
std::vector<double> factors_to(SolveState& state, const std::vector<Point>& origins, const Clusters& places,
                               double row_sum) {
  const std::size_t count = places.point.size();
  const std::vector<std::uint8_t> seen = sees(state, origins, places.point);
  std::vector<double> factor(origins.size() * count, 0), sums(origins.size(), 0);
  double mean = 0;
  for (std::size_t o = 0; o < origins.size(); ++o) {
    for (std::size_t k = 0; k < count; ++k) {
      const glm::dvec3 r = places.point[k].position - origins[o].position;
      const double r2 = glm::dot(r, r), above = glm::dot(r, origins[o].normal),
                   facing = -glm::dot(r, places.point[k].normal);
      if (!(above > 0 && facing > 0)) continue;
      if (!seen[o * count + k]) continue;
      const double f = above * facing / r2 * places.area[k] / (M_PI * r2 + places.area[k]);
      factor[o * count + k] = f;
      sums[o] += f;
    }
    mean += std::min(1.0, sums[o]) / double(origins.size());
  }
  const double scale = mean > 0 ? std::max(1.0, row_sum / mean) : 1;
  for (std::size_t o = 0; o < origins.size(); ++o) {
    if (sums[o] == 0) continue;
    const double of_row = state.enclosure.closed ? 1 / sums[o] : std::min(scale, 1 / sums[o]);
    for (std::size_t k = 0; k < count; ++k) factor[o * count + k] *= of_row;
  }
  return factor;
}

// counts[sensor * places + place], what a sensor gets of a radiosity of 1 at a place, after one more reflection: by way of those that see the
// place.
std::vector<double> handed_on(const std::vector<double>& counts, const std::vector<double>& between,
                              const std::vector<double>& reflectance) {
  const std::size_t places = reflectance.size();
  std::vector<double> next(counts.size(), 0);
  for (std::size_t s = 0; s < counts.size() / places; ++s)
    for (std::size_t j = 0; j < places; ++j) {
      const double count = counts[s * places + j] * reflectance[j];
      const double* const row = between.data() + j * places;
      for (std::size_t k = 0; k < places; ++k) next[s * places + k] += count * row[k];
    }
  return next;
}

double sum_of(const std::vector<double>& v) {
  return std::accumulate(v.begin(), v.end(), 0.0);
}

// Rows that are closed leave the light as a whole as it is, so that a residual that is the same everywhere is chance, unless it is far more than
// so few points have by chance: this share of it is handed on.
double share_of_mean(const Clusters& places, const std::vector<double>& reflectance, const Residual& residual,
                     std::uint32_t band, std::uint32_t bands) {
  double all = 0, first = 0, second = 0, by_chance = 0;
  for (std::size_t k = 0; k < places.area.size(); ++k) {
    const double w = places.area[k] * reflectance[k];
    all += w, first += w * residual.first[k * bands + band], second += w * residual.second[k * bands + band];
  }
  const double mean = all > 0 ? (first + second) / (2 * all) : 0;
  for (std::size_t k = 0; k < places.area.size(); ++k)
    by_chance += std::pow(places.area[k] * reflectance[k], 2) * (residual.first[k * bands + band] - mean) *
                 (residual.second[k * bands + band] - mean);
  const double square = first * second;
  return square > 0 ? std::sqrt(std::clamp(1 - significant * by_chance / square, 0.0, 1.0)) : 0;
}

// Leaves `share` of what a radiosity that is the same everywhere counts.
void lessen_mean(std::vector<double>& counts, const Clusters& places, const std::vector<double>& reflectance,
                 double share) {
  const std::size_t n = places.area.size();
  const double reflecting =
      std::inner_product(places.area.begin(), places.area.end(), reflectance.begin(), 0.0);
  for (std::size_t s = 0; s < counts.size() / n && reflecting > 0; ++s) {
    double* const row = counts.data() + s * n;
    const double all = std::inner_product(row, row + n, reflectance.begin(), 0.0);
    for (std::size_t k = 0; k < n; ++k) row[k] -= (1 - share) * all * places.area[k] / reflecting;
  }
}

std::vector<double> reflectance_of_places(const Clusters& places, const Solution& solution,
                                          std::uint32_t band) {
  const std::vector<double>& textured = solution.textured.element;
  std::vector<double> result;
  for (std::size_t k = 0; k < places.polygon.size(); ++k)
    result.push_back(textured.empty() ? solution.material_of(places.polygon[k]).reflectance[band]
                                      : textured[band * solution.mesh.elements.size() + places.element[k]]);
  return result;
}

}  // namespace

Residual residual_of_seen(SolveState& state, const Solution& solution, SensorGather& gathered,
                          std::span<const CheckPoint> points, std::uint32_t rays, std::uint64_t seed) {
  if (points.empty()) return {};
  Surroundings& around = *gathered.around;
  const Displayed displayed(around.edges, around.vertices, around.vertex_values, around.edge_values);
  // Each point twice, as rays are told apart by their point's number.
  std::vector<Point> twice;
  twice.reserve(2 * points.size());
  for (int k = 0; k < 2; ++k)
    for (const CheckPoint& p : points) twice.push_back(p.point);
  const PointArray at(state.device, twice, "check points");
  const std::uint64_t values = twice.size() * solution.bands;
  RealArray irradiance(state.device, values, "irradiance at points"),
      error(state.device, values, "irradiance at points");
  Way way;
  way.rays = rays, way.seed = std::uint32_t(seed);
  way.without_lamps = way.few = true, way.asks = state.interreflection;
  // Without interreflection nothing is reflected on the way to what sensors see.
  Array<std::uint32_t> none(state.device, std::vector<std::uint32_t>(around.patches, 0u), "elements");
  if (!state.interreflection) std::swap(around.reflects, none);
  gather_at(state.device, solution, around, at, state.engine, way, state.glass,
            state.direct ? &state.direct->lights : nullptr, irradiance, error, most_check_bytes);
  if (!state.interreflection) std::swap(around.reflects, none);
  const std::vector<double> brought = irradiance.download();
  Residual residual;
  const std::size_t bands = solution.bands;
  for (std::size_t k = 0; k < points.size(); ++k) {
    double light = 0;
    for (std::size_t b = 0; b < bands; ++b)
      light += brought[k * bands + b] + brought[(points.size() + k) * bands + b];
    const std::array<std::uint32_t, 4>& corner = solution.mesh.elements[points[k].where.element].vertex;
    const bool in_part = std::any_of(corner.begin(), corner.end(), [&](std::uint32_t v) {
      return v != 0xffffffffu && solution.vertex_covered[v] != 0;
    });
    // Nobody sees what is under something.
    const bool covered = in_part && light == 0;
    for (std::uint32_t b = 0; b < bands; ++b) {
      const double shown = displayed.at(b, points[k].where);
      residual.first.push_back(covered ? 0 : shown - brought[k * bands + b]);
      residual.second.push_back(covered ? 0 : shown - brought[(points.size() + k) * bands + b]);
    }
  }
  return residual;
}

std::vector<double> seen_error_square(SolveState& state, const Solution& solution,
                                      const std::vector<Point>& sensors, std::span<const CheckPoint> points,
                                      const Residual& residual) {
  std::vector<double> result(solution.bands, 0);
  if (points.empty() || sensors.empty()) return result;
  const std::size_t n = points.size();
  const Clusters all = clusters_of(state, solution, points, n),
                 some = clusters_of(state, solution, points, most_places);
  const double known = mean_row_sum(state), row_sum = std::isfinite(known) ? known : 0;
  const std::vector<double> to_sensors = factors_to(state, sensors, all, row_sum);
  std::vector<double> between, from_some;
  if (state.interreflection)
    between = factors_to(state, some.point, some, row_sum),
    from_some = factors_to(state, sensors, some, row_sum);
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    const std::vector<double> rho = reflectance_of_places(all, solution, b);
    std::vector<double> later(sensors.size() * some.point.size(), 0);
    if (state.interreflection) {
      const std::vector<double> rho_of_some = reflectance_of_places(some, solution, b);
      std::vector<double> counts = from_some;
      for (int m = 0; m < most_reflections; ++m) {
        counts = handed_on(counts, between, rho_of_some);
        for (std::size_t i = 0; i < later.size(); ++i) later[i] += counts[i];
        if (sum_of(counts) <= little * sum_of(later)) break;
      }
      if (state.balanced && state.options.estimator == Estimator::exact)
        lessen_mean(later, some, rho_of_some, share_of_mean(all, rho, residual, b, solution.bands));
    }
    std::vector<double> share_of_place;
    for (std::size_t k = 0; k < n; ++k) {
      const double area = some.area[some.point.size() * k / n];
      share_of_place.push_back(area > 0 ? all.area[k] / area : 0);
    }
    double squares = 0, by_chance = 0, noise = 0;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      double first = 0, second = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const std::size_t of = some.point.size() * k / n;  // the cluster that it is in
        const double counts =
            rho[k] * (to_sensors[s * n + k] + later[s * some.point.size() + of] * share_of_place[k]);
        const double x = counts * residual.first[k * solution.bands + b],
                     y = counts * residual.second[k * solution.bands + b];
        first += x, second += y, by_chance += x * y;
      }
      squares += first * second, noise += std::pow((first - second) / 2, 2);
    }
    const double square = std::max(0.0, squares - by_chance) + unsure * std::max(0.0, by_chance) + noise;
    result[b] = square / double(sensors.size());
  }
  return result;
}

}  // namespace clrad
