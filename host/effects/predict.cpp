#include "effects/predict.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "mesh/build.hpp"
#include "scene/enclosure.hpp"
#include "solve/balance.hpp"
#include "solve/form_factor.hpp"
#include "solve/sensor.hpp"
#include "solve/transmission.hpp"
#include "solve/vertex_gather.hpp"

namespace clrad {
namespace {

// Costs in units of one form factor (the probe below), from profiles of the Cornell box, the furnace and the office
// (`./run bench effects` prints predicted and actual side by side).
constexpr double cost_of_factor = 1.6, cost_of_ray = 0.25, cost_of_glass = 0.5, cost_of_weighing = 0.25,
                 cost_of_clip = 4, cost_of_vertex = 0.9, cost_of_near_field = 0.20, cost_of_covered = 110,
                 cost_of_triangle = 4, cost_of_band = 0.02, cost_of_sensor_ray = 4.5,
                 cost_of_element_on_host = 3, cost_of_launch_s = 20e-6;
constexpr double launches_per_shoot = 16;
// From a vertex and the middles of the two edges to each; what the error's estimate takes.
constexpr double share_of_estimate = 0.15;
// Of all vertices, those that are in front of a shooter and face it, in rooms with things in them and without.
constexpr double facing_share = 0.5, facing_share_of_convex = 0.83;

// Patches of one size and material.
struct Group {
  double patches = 0, area = 0;  // of all of them
  double emitted = 0, reflectance = 0;
  double traced = 0;   // patches that have shot
  double shot_at = 0;  // density of light when those last shot, their mean
};

std::vector<Group> groups_of(const Scene& scene, const MeshCounts& counts) {
  std::map<std::tuple<std::uint32_t, int>, Group> groups;
  for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    const Material& m = scene.materials[polygon.material];
    const double area = polygon.area_m2(), patches = counts.polygons[p].patches;
    Group& g = groups[{polygon.material, int(std::floor(2 * std::log2(area / patches)))}];
    g.patches += patches, g.area += area;
    g.emitted = std::accumulate(m.emitted_exitance.begin(), m.emitted_exitance.end(), 0.0);
    g.reflectance = std::accumulate(m.reflectance.begin(), m.reflectance.end(), 0.0);
  }
  std::vector<Group> all;
  all.reserve(groups.size());
  for (auto& [key, g] : groups) all.push_back(g);
  return all;
}

// Mean over bands [W or lm]. Of a directional light, what arrives on surfaces that are turned every way: a quarter of their area
// faces it.
double power_of_lights(const Scene& scene, double area) {
  double power = 0;
  for (const PunctualLight& l : scene.lights) {
    const double intensity =
        std::accumulate(l.intensity.begin(), l.intensity.end(), 0.0) / double(l.intensity.size());
    power += intensity * (l.kind == PunctualLight::Kind::directional ? area / 4 : l.solid_angle_sr());
  }
  return power;
}

struct Shoots {
  double direct = 0, reflected = 0, rays_per_receiver = 0;
};

// Progressive radiosity with F_ij = A_j / A: unshot power per patch decides who shoots next for the first time; those that have do so
// again in every step, more often than the solver has them, which costs no rays.
Shoots count_shoots(const Scene& scene, const MeshCounts& counts, const SolveOptions& options,
                    bool interreflection) {
  std::vector<Group> groups = groups_of(scene, counts);
  const double bands = double(scene.bands.size());
  double area = 0, emitted = 0;
  for (Group& g : groups) {
    g.emitted /= bands, g.reflectance /= bands;
    area += g.area, emitted += g.area * g.emitted;
  }
  // What lights bring is the light that has been shot at first, though by no patch.
  const double from_lights = interreflection ? power_of_lights(scene, area) : 0;
  emitted += from_lights;
  Shoots shoots;
  if (!(emitted > 0)) return shoots;
  const auto samples = [&](const Group& g) {
    double n = options.samples;
    while (n < 4096 && g.area / g.patches * g.emitted * options.light_samples > emitted * n) n *= 4;
    return n;
  };
  const bool all =
      interreflection && closes_rows(largest_reflectance(scene), options,
                                     scene.polygons.size() <= 20'000 && find_enclosure(scene).closed);
  const auto trace = [&](Group& g, double patches) {
    (g.emitted > 0 ? shoots.direct : shoots.reflected) += patches;
    shoots.rays_per_receiver += patches * samples(g);
    g.traced += patches;
  };
  if (all) {
    for (Group& g : groups) trace(g, g.patches);
    return shoots;
  }
  double density = from_lights / area;  // of all light shot so far, per area
  constexpr double steps_per_group = 32;
  for (int step = 0; step < 10000; ++step) {
    // Patches that have shot do so again from their kept columns, which costs no rays.
    double again = 0;
    const double before = density;
    for (Group& g : groups) {
      again += g.area * g.traced / g.patches * (interreflection ? g.reflectance * (before - g.shot_at) : 0);
      g.shot_at = before;
    }
    density += again / area;
    // Unshot, per area, of those that have not: all that they ever got.
    const auto unshot = [&](const Group& g) {
      return g.emitted + (interreflection ? g.reflectance * density : 0);
    };
    double left = 0;
    Group* best = nullptr;
    for (Group& g : groups) {
      const double traced = g.traced / g.patches;
      left += g.area * (1 - traced) * unshot(g);
      if (interreflection) left += g.area * traced * g.reflectance * (density - g.shot_at);
      if (g.traced < g.patches && unshot(g) > 0 &&
          (!best || unshot(g) * g.area / g.patches > unshot(*best) * best->area / best->patches))
        best = &g;
    }
    if (left < options.converge * emitted || !best) break;
    const double patches = std::min(best->patches - best->traced, std::ceil(best->patches / steps_per_group));
    const double shot = best->area * patches / best->patches * unshot(*best);
    best->shot_at = (best->traced * best->shot_at + patches * density) / (best->traced + patches);
    trace(*best, patches);
    density += shot / area;
  }
  return shoots;
}

}  // namespace

double seconds_per_factor(Device& device) {
  constexpr std::uint32_t receivers = 1 << 17;
  Shooter shooter;
  shooter.corners = 4;
  const glm::dvec3 corner[4] = {{-0.1, -0.1, 0.5}, {-0.1, 0.1, 0.5}, {0.1, 0.1, 0.5}, {0.1, -0.1, 0.5}};
  std::copy(corner, corner + 4, shooter.corner);
  shooter.normal = {0, 0, -1};
  shooter.area = 0.04, shooter.plane = 1;
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < receivers; ++i) {
    const std::uint32_t column = i % 512, row = i / 512;
    points.push_back({{column / 512.0 - 0.5, row / 256.0 - 0.5, 0}, {0, 0, 1}, 0, 0});
  }
  const PointArray on_device(device, points, "probe");
  RealArray factors(device, receivers, "probe");
  double best = INFINITY;
  for (int k = 0; k < 4; ++k) {
    device.finish();
    const auto start = std::chrono::steady_clock::now();
    form_factors(device, Estimator::exact, shooter, on_device, nullptr, receivers, on_device, 0, factors);
    device.finish();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best / receivers;
}

Prediction predict(Device& device, const Scene& scene, const SolveOptions& options,
                   const std::vector<Effect>& effects, double factor_s) {
  const MeshCounts counts = count_mesh(scene, options.mesh);
  Prediction result;
  result.patches = counts.patches, result.elements = counts.elements, result.vertices = counts.vertices;
  const bool occlusion = runs(effects, "occlusion"), reflects = runs(effects, "interreflection");
  const double bands = runs(effects, "colour") ? double(scene.bands.size()) : 1;
  const Shoots shoots = count_shoots(scene, counts, options, reflects);
  result.shoots = shoots.direct + shoots.reflected;
  const double facing = (occlusion ? facing_share : facing_share_of_convex) * counts.vertices;
  const bool clips = occlusion && options.visibility_exact && !runs(effects, "transmission");
  const double rays = occlusion && !clips ? shoots.rays_per_receiver * facing : 0;
  result.rays = rays;
  const double unit = factor_s > 0 ? factor_s : seconds_per_factor(device);
  const double real = device.options().precision == Precision::float64 ? 8 : 4;
  const double triangles = 2 * double(scene.polygons.size());

  // A shoot without visibility: its factors, and passes over all vertices and elements.
  const double per_shoot = unit * (facing * cost_of_factor + counts.vertices * cost_of_vertex) +
                           launches_per_shoot * cost_of_launch_s;
  const double per_ray = unit * (cost_of_ray + cost_of_weighing);
  const double ray_share = result.shoots > 0 ? rays / result.shoots : 0;
  const double columns = real * (counts.patches + counts.vertices) * result.shoots;

  Prediction::Part common{"mesh and form factors"};
  common.seconds = shoots.direct * per_shoot + unit * cost_of_element_on_host * counts.elements;
  const std::uint64_t sensors = options.sensors.size();
  if (sensors > 0)
    common.seconds += unit * cost_of_sensor_ray *
                      (reflects ? gather_work(counts, 1, sensors, options.sensor_rays)
                                : double(sensors) * options.sensor_rays);
  // Points, five flags or places, five sums and two columns a vertex; corners, weights, share and value an element.
  common.device_bytes = counts.vertices * (12 * real + 20 + 5 * real + 2 * real) +
                        counts.elements * (16 + 6 * real) + counts.patches * 12 * real +
                        real * (counts.patches + counts.vertices) * shoots.direct;
  common.device_bytes +=
      std::max(sensor_gather_bytes(device, counts.patches, bands, sensors, options.sensor_rays),
               reflects ? vertex_gather_bytes(device, counts, 1, bands, sensors, options.sensor_rays) : 0);
  result.parts.push_back(common);
  for (const Effect& effect : effects) {
    Prediction::Part part{effect.name};
    if (effect.runs && effect.name == "occlusion") {
      part.seconds = rays * per_ray + (clips ? result.shoots * facing * unit * cost_of_clip : 0) +
                     unit * (cost_of_triangle * triangles + cost_of_covered * counts.vertices);
      part.device_bytes = triangles * 300 + facing * 4 * std::ceil(ray_share / std::max(1.0, facing) / 32) +
                          (clips ? facing * (2.0 * 4 * 128 / device.options().packet_width + 7 * 4 + 12) : 0);
    } else if (effect.runs && effect.name == "interreflection") {
      part.seconds = shoots.reflected * per_shoot;
      part.device_bytes = columns - real * (counts.patches + counts.vertices) * shoots.direct;
    } else if (effect.runs && effect.name == "colour") {
      part.seconds = unit * cost_of_band * (bands - 1) * counts.vertices * result.shoots;
      part.device_bytes = (bands - 1) * real * (2 * counts.vertices + 10 * counts.patches);
    } else if (effect.runs && effect.name == "transmission") {
      part.seconds = rays * unit * cost_of_glass;
      // Coloured glass: a column a band.
      if (glass_colours(scene) > 1) part.device_bytes = (bands - 1) * columns;
    } else if (effect.runs && effect.name == "near_field") {
      part.seconds = unit * cost_of_near_field * counts.vertices * result.shoots;
      part.device_bytes = real * (counts.elements * (8 + 4 * bands) + 2 * bands * counts.vertices);
    } else if (effect.runs && effect.name == "lights") {
      part.seconds = unit * (cost_of_vertex + cost_of_ray) * counts.vertices * double(scene.lights.size());
      part.device_bytes = 2 * bands * real * (counts.vertices + counts.patches);
    } else if (effect.runs && (effect.name == "subdivision" || effect.name == "specular")) {
      part.seconds = part.device_bytes = NAN;
    }
    result.parts.push_back(part);
  }
  if (options.error) {
    double all = 0;
    for (const Prediction::Part& part : result.parts)
      if (part.seconds > 0) all += part.seconds;
    result.parts[0].seconds += share_of_estimate * all;
  }
  for (const Prediction::Part& part : result.parts) {
    if (part.seconds > 0) result.seconds += part.seconds;
    if (part.device_bytes > 0) result.device_bytes += part.device_bytes;
  }
  return result;
}

}  // namespace clrad
