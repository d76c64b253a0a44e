#include "solve/seen_points.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "solve/seen_places.hpp"

namespace clrad {
namespace {

// Enough for an RMS over sensors; and how many rays of each to choose from, for each that is chosen and at least.
constexpr std::size_t enough_sensors = 64;
constexpr double rays_to_choose_from = 4, fewest_rays_of_sensor = 64;

// Ends of a sensor's rays, one for each 1 / `per_sensor` of what it sees.
void choose(const RayEnds& ends, double per_sensor, const Solution& solution, Random& random,
            std::vector<CheckPoint>& chosen) {
  double next = 0, sum = 0;
  for (std::size_t i = 0; i < ends.sensor.size(); ++i) {
    if (i == 0 || ends.sensor[i] != ends.sensor[i - 1]) next = random.unit() / per_sensor, sum = 0;
    sum += ends.share[i];
    int draws = 0;
    for (; sum > next; next += 1 / per_sensor) ++draws;
    if (draws == 0 || ends.element[i] == 0xffffffffu) continue;
    const Element& element = solution.mesh.elements[ends.element[i]];
    CheckPoint p;
    p.where.element = ends.element[i];
    p.polygon = solution.mesh.patches[element.patch].polygon;
    p.point = solution.mesh.receivers[element.vertex[0]];
    p.point.position = {0, 0, 0};
    for (std::size_t k = 0; k < 8; ++k) {
      p.where.vertex[k] = ends.vertex[8 * i + k];
      p.where.weight[k] = ends.weight[16 * i + k], p.where.bend_weight[k] = ends.weight[16 * i + 8 + k];
      if (p.where.weight[k] != 0)
        p.point.position += p.where.weight[k] * solution.mesh.receivers[p.where.vertex[k]].position;
    }
    chosen.insert(chosen.end(), std::size_t(draws), p);
  }
}

}  // namespace

std::vector<Point> some_sensors(const SensorGather& gathered) {
  std::vector<Point> points;
  const std::size_t all = gathered.sensors.size(), count = std::min(all, enough_sensors);
  for (std::size_t k = 0; k < count; ++k) points.push_back(gathered.sensors[k * all / count]);
  return points;
}

std::vector<std::uint8_t> sees(SolveState& state, const std::vector<Point>& origins,
                               const std::vector<Point>& points) {
  const PointArray from(state.device, origins, "places"), to(state.device, points, "places");
  const Segments segments{&from, nullptr, std::uint32_t(origins.size()), &to, std::uint32_t(points.size())};
  const std::uint32_t words = segments.words_per_origin();
  Array<std::uint32_t> masks(state.device, std::uint64_t(origins.size()) * words, "what places see");
  state.engine.occluded(segments, masks);
  const std::vector<std::uint32_t> hidden = masks.download();
  std::vector<std::uint8_t> result;
  result.reserve(origins.size() * points.size());
  for (std::size_t o = 0; o < origins.size(); ++o)
    for (std::size_t k = 0; k < points.size(); ++k)
      result.push_back((hidden[o * words + k / 32] >> (k % 32) & 1) == 0);
  return result;
}

std::vector<CheckPoint> seen_points(SolveState& state, const Solution& solution, const SensorGather& gathered,
                                    std::span<const CheckPoint> spread, std::uint32_t count,
                                    std::uint64_t seed, Random& random) {
  const std::vector<Point> sensors = some_sensors(gathered);
  const double per_sensor = std::max(1.0, double(count) / double(sensors.size()));
  std::vector<CheckPoint> points;
  Way way;
  way.rays = std::uint32_t(std::max(fewest_rays_of_sensor, rays_to_choose_from * per_sensor)),
  way.seed = std::uint32_t(seed), way.without_lamps = true;
  look_from(state.device, solution, *gathered.around, PointArray(state.device, sensors, "sensors"),
            state.engine, way, state.glass,
            [&](const RayEnds& ends) { choose(ends, per_sensor, solution, random, points); });
  // Half of the others.
  for (std::size_t k = 0; k < spread.size(); k += 2) points.push_back(spread[k]);
  std::stable_sort(points.begin(), points.end(), [](const CheckPoint& a, const CheckPoint& b) {
    return a.where.element < b.where.element;
  });

  std::vector<Point> at;
  at.reserve(points.size());
  for (const CheckPoint& p : points) at.push_back(p.point);
  const std::vector<std::uint8_t> seen = sees(state, sensors, at);
  const std::vector<double> density = density_of_points(solution, std::uint32_t((spread.size() + 1) / 2));
  const double area =
      exposed_area_m2(solution) / (state.metres_per_unit * state.metres_per_unit);  // frame units
  for (std::size_t k = 0; k < points.size(); ++k) {
    double drawn = density[points[k].where.element];
    const Material& material = solution.material_of(points[k].polygon);
    const bool reflects = material.texture != no_texture ||
                          std::any_of(material.reflectance.begin(), material.reflectance.end(),
                                      [](double rho) { return rho > 0; });
    // Of rays that end on what reflects nothing none was chosen.
    for (std::size_t s = 0; reflects && s < sensors.size(); ++s) {
      if (!seen[s * points.size() + k]) continue;
      const glm::dvec3 r = at[k].position - sensors[s].position;
      const double above = glm::dot(r, sensors[s].normal), facing = -glm::dot(r, at[k].normal),
                   r2 = glm::dot(r, r);
      if (above > 0 && facing > 0) drawn += per_sensor * above * facing / (M_PI * r2 * r2) * area;
    }
    points[k].weight = drawn > 0 ? 1 / drawn : 0;
  }
  return points;
}

}  // namespace clrad
