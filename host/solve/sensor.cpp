#include "solve/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "solve/nodes.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* sensor_kernels = "solve/sensor.cl";

// A sensor within the grid's rounding of a polygon that faces its way lies on it, and ignores its plane.
std::uint32_t plane_under(const Solution& solution, std::span<const std::uint32_t> planes,
                          const glm::dvec3& position, const glm::dvec3& normal) {
  const double touching = std::ldexp(1.0, -34);
  for (std::size_t p = 0; p < solution.scene.polygons.size(); ++p) {
    const Polygon& polygon = solution.scene.polygons[p];
    const glm::dvec3 n = polygon.normal();
    const glm::dvec3 r = position - solution.frame.to_frame(polygon.corner[0]);
    if (glm::dot(n, normal) < 0.99 || std::abs(glm::dot(r, n)) > touching) continue;
    bool inside = true;
    for (std::uint32_t k = 0; k < polygon.corners; ++k) {
      const glm::dvec3 a = solution.frame.to_frame(polygon.corner[k]);
      const glm::dvec3 b = solution.frame.to_frame(polygon.corner[(k + 1) % polygon.corners]);
      inside &= glm::dot(glm::cross(b - a, position - a), n) >= -touching * glm::length(b - a);
    }
    if (inside) return planes[p];
  }
  return 0xffffffffu;
}

// [band][node]: for elements, too, the radiosity of the patch.
std::vector<double> radiosity_of_patches(const Nodes& nodes, std::uint32_t patches, std::uint32_t bands) {
  const std::size_t count = nodes.brightness.size();
  std::vector<double> radiosity = nodes.radiosity;
  for (std::uint32_t b = 0; b < bands; ++b)
    for (std::uint32_t p = 0; p < patches; ++p)
      for (std::uint32_t e = nodes.first_element[p]; e < nodes.first_element[p + 1]; ++e)
        radiosity[b * count + patches + e] = radiosity[b * count + p];
  return radiosity;
}

// irradiance[sensor * bands + band]
void add_light_of(Lights& lights, Device& device, VisibilityEngine& engine, const PointArray& sensors,
                  std::uint32_t bands, std::vector<double>& irradiance) {
  const auto stage = device.stage("light from point, spot and directional lights");
  RealArray direct(device, irradiance.size(), "light from lights"),
      lost(device, irradiance.size(), "light from lights");
  direct.fill_zero(), lost.fill_zero();
  const std::uint64_t count = sensors.size();
  lights.irradiate(engine, sensors, nullptr, 0, std::uint32_t(count), direct, lost, count);
  const std::vector<double> by_band = direct.download();
  for (std::uint64_t s = 0; s < count; ++s)
    for (std::uint32_t b = 0; b < bands; ++b) irradiance[s * bands + b] += by_band[b * count + s];
}

// The frame made larger, by a power of two, until a point outside the scene is within the +-4 that visibility takes.
// Beyond a million times the scene's size it is left as it is: the grid could not tell the scene's parts apart.
Frame reaching(Frame frame, const glm::dvec3& world_m) {
  constexpr double reach = 3.75;  // segments to directional lights go on from there
  constexpr int most_doublings = 20;
  for (int k = 0; k < most_doublings; ++k, ++frame.exponent) {
    const glm::dvec3 p = glm::abs(frame.to_frame(world_m));
    // Written so that NaN changes nothing.
    if (!(std::max({p.x, p.y, p.z}) > reach)) break;
  }
  return frame;
}

}  // namespace

Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors) {
  Frame frame = frame_of(scene);
  for (const Sensor& sensor : sensors) frame = reaching(frame, sensor.position_m);
  for (const PunctualLight& light : scene.lights)
    if (light.kind != PunctualLight::Kind::directional) frame = reaching(frame, light.position_m);
  return frame;
}

Gathered gather_at_points(Device& device, const Gather& gather, std::uint32_t patches,
                          VisibilityEngine& engine, const Glass* glass, Lights* lights) {
  const Nodes& nodes = gather.nodes;
  const std::uint32_t bands = gather.bands;
  const auto node_count = std::uint32_t(nodes.brightness.size());
  const auto sensors = std::uint32_t(gather.points.size());
  const std::uint32_t colours = glass ? glass->colours() : 1;
  const PointArray sensor(device, gather.points, "sensors"), corners(device, nodes.corners, "node corners");
  const RealArray shooters(device, nodes.shooters, "nodes"),
      radiosity(device, nodes.radiosity, "node radiosity"),
      brightness(device, nodes.brightness, "node brightness");
  const Array<std::uint32_t> first_element(device, nodes.first_element, "patch segments");
  const RealArray of_patches(device, radiosity_of_patches(nodes, patches, bands), "node radiosity");
  const std::uint64_t values = std::uint64_t(sensors) * bands;
  RealArray irradiance(device, values, "sensor irradiance"), flat(device, values, "sensor irradiance"),
      error(device, values, "sensor errors");

  // Rays dominate: origins, ends, kernel, mask and owners take some 150 bytes each, what glass lets pass 8 a band; pairs less.
  const std::uint64_t room =
      (device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held)) / 4;
  const std::uint64_t per_sensor =
      (std::uint64_t(gather.rays) + 4 * std::uint64_t(patches)) * (300 + 8 * (colours - 1));
  const auto batch = std::uint32_t(std::clamp<std::uint64_t>(
      room / per_sensor, 1, std::min<std::uint64_t>(sensors, (1u << 30) / patches)));

  Array<std::uint32_t> counts(device, std::uint64_t(batch) * patches, "nodes of sensors"),
      segments(device, batch + 1, "sensor segments");
  Array<float> total(device, batch, "sensor totals"), weight;
  Array<std::uint32_t> node, ray_counts, masks;
  RealArray factor, visible, variance, kernel_of;
  PointArray origins, ends;
  for (std::uint32_t first = 0; first < sensors; first += batch) {
    const std::uint32_t count = std::min(batch, sensors - first);
    device.run(sensor_kernels, "sensor_nodes", std::uint64_t(count) * patches, sensor, corners, first_element,
               brightness, Real{gather.near_diameters * gather.near_diameters}, counts, first, count,
               patches);
    const Allocation pairs =
        allocate(device, counts.buffer(), std::uint64_t(count) * patches, "pairs of sensor and node");
    grow(node, device, pairs.total, "pairs"), grow(factor, device, pairs.total, "pairs"),
        grow(weight, device, pairs.total, "pairs");
    const std::uint64_t shares = std::uint64_t(colours) * pairs.total;
    grow(visible, device, shares, "pairs"), grow(variance, device, shares, "pairs"),
        grow(ray_counts, device, pairs.total, "pairs");
    device.run(sensor_kernels, "sensor_factors", pairs.total, sensor, shooters, pairs.owner, pairs.rank,
               counts, first_element, brightness, node, factor, weight, first, pairs.total, patches);
    device.run(sensor_kernels, "sensor_segments", count + 1, pairs.offsets, segments, count, patches);
    segmented_reduce_sum(device, weight.buffer(), segments.buffer(), total.buffer(), count);
    device.run(sensor_kernels, "sensor_ray_counts", pairs.total, pairs.owner, weight, total,
               float(gather.rays), ray_counts, pairs.total, patches);
    const Allocation rays = allocate(device, ray_counts.buffer(), pairs.total, "rays of sensors");
    grow(origins, device, rays.total, "sensor rays"), grow(ends, device, rays.total, "sensor rays");
    grow(kernel_of, device, rays.total, "sensor rays"), grow(masks, device, rays.total, "sensor rays");
    device.run(sensor_kernels, "sensor_rays", rays.total, sensor, corners, pairs.owner, node, rays.owner,
               rays.rank, origins, ends, kernel_of, first, rays.total, patches, std::uint32_t(gather.seed));
    const Segments segments_of_rays{&origins, nullptr, rays.total, &ends, 0};
    engine.occluded(segments_of_rays, masks);
    const RealArray passes =
        glass && rays.total > 0 ? glass->pass_pairs(segments_of_rays, masks) : RealArray();
    for (std::uint32_t c = 0; c < colours; ++c)
      device.run(sensor_kernels, "sensor_visible", pairs.total, rays.offsets, kernel_of, masks,
                 std::uint32_t(passes.size() > 0), passes.size() > 0 ? passes : factor,
                 std::uint64_t(c) * rays.total, factor, visible, variance, std::uint64_t(c) * pairs.total,
                 pairs.total);
    const auto sum = [&](const RealArray& of_nodes, RealArray& to) {
      device.run(sensor_kernels, "sensor_sum", std::uint64_t(count) * bands, colours, pairs.total,
                 pairs.offsets, node, visible, variance, of_nodes, to, error, first, count, patches,
                 node_count, bands);
    };
    sum(of_patches, flat);
    sum(radiosity, irradiance);
  }

  Gathered result{irradiance.download(), error.download(), flat.download()};
  if (lights) {
    add_light_of(*lights, device, engine, sensor, bands, result.irradiance);
    add_light_of(*lights, device, engine, sensor, bands, result.flat);
  }
  return result;
}

std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, const Glass* glass, Lights* lights) {
  if (options.sensors.empty()) return {};
  const auto stage = device.stage("gather at sensors");
  std::vector<Point> points;
  for (const Sensor& s : options.sensors) {
    const glm::dvec3 position = solution.frame.to_frame(s.position_m), normal = glm::normalize(s.normal);
    points.push_back({position, normal, plane_under(solution, planes, position, normal), 0xffffffffu});
  }
  const Nodes nodes = make_nodes(solution);
  Gather gather{points, nodes};
  gather.rays = options.sensor_rays, gather.seed = options.seed, gather.bands = solution.bands;
  const Gathered h =
      gather_at_points(device, gather, std::uint32_t(solution.mesh.patches.size()), engine, glass, lights);
  std::vector<SensorResult> results;
  for (std::size_t s = 0; s < points.size(); ++s) {
    const auto at = std::ptrdiff_t(s) * solution.bands;
    const auto part = [&](const std::vector<double>& all) {
      return std::vector<double>(all.begin() + at, all.begin() + at + solution.bands);
    };
    results.push_back({options.sensors[s].position_m, glm::normalize(options.sensors[s].normal),
                       part(h.irradiance), part(h.error)});
  }
  return results;
}

}  // namespace clrad
