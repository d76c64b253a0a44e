#include "solve/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "solve/seen_places.hpp"
#include "solve/transmission.hpp"
#include "solve/vertex_gather.hpp"

namespace clrad {
namespace {

constexpr const char *sensor_kernels = "solve/sensor.cl", *pair_kernels = "solve/sensor_pairs.cl";
// The share of a sensor's rays by which the others are shared out.
constexpr double first_share = 0.125;
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

// The pairs of some sensors with the patches that may light them, and what their rays found so far.
class Gather {
 public:
  Gather(Device& device, const Solution& solution, const Surroundings& around, const PointArray& sensors,
         VisibilityEngine& engine, const Way& way, const Glass* glass, Lights* lights)
      : device_(device),
        around_(around),
        sensors_(sensors),
        engine_(engine),
        way_(way),
        glass_(glass),
        lights_(lights),
        bands_(solution.bands),
        colours_(glass ? glass->colours() : 1),
        open_(engine.name() == "none") {}

  /// For sensors first .. first + count - 1: [sensor * bands + band].
  void run(std::uint32_t first, std::uint32_t count, RealArray& irradiance, RealArray& error) {
    first_ = first;
    find_pairs(count);
    const auto rays = double(way_.rays);
    cast(way_.first_share * rays, 1);
    if (way_.first_share < 1) {
      device_.run(sensor_kernels, "sensor_spread", pairs_.total, pairs_.owner, factor_, moments_, done_,
                  around_.radiosity[way_.without_lamps], weight_, pairs_.total, around_.patches, bands_);
      segmented_reduce_sum(device_, weight_.buffer(), segments_.buffer(), total_.buffer(), count);
      cast((1 - way_.first_share) * rays, 0);
    }
    device_.run(sensor_kernels, "sensor_sum", std::uint64_t(count) * bands_, pairs_.total, pairs_.offsets,
                pairs_.owner, factor_, moments_, done_, around_.radiosity[way_.without_lamps], irradiance,
                error, first, count, around_.patches, bands_, open_, std::uint32_t(way_.few));
  }

  /// Adds where their rays end.
  void look(std::uint32_t first, std::uint32_t count, RayEnds& ends) {
    first_ = first;
    find_pairs(count);
    ends_of_rays_ = &ends;
    cast(way_.rays, 1);
    ends_of_rays_ = nullptr;
  }

 private:
  Device& device_;
  const Surroundings& around_;
  const PointArray& sensors_;
  VisibilityEngine& engine_;
  const Way way_;
  const Glass* const glass_;
  Lights* const lights_;
  const std::uint32_t bands_, colours_, open_;
  RayEnds* ends_of_rays_ = nullptr;  // null: they are not looked at
  std::uint32_t first_ = 0;
  Allocation pairs_;
  Array<std::uint32_t> counts_, segments_, ray_counts_, done_;  // of pairs
  Array<float> total_, weight_;
  RealArray factor_, moments_;
  Array<std::uint32_t> masks_, lamp_masks_, idle_, asks_, asking_, lamp_;  // of rays
  RealArray ray_weight_, place_, light_, found_;
  PointArray origins_, ends_, targets_;

  // Work-items of kernels that take a packet each, so that a work-group is that much smaller.
  std::uint64_t packets(std::uint64_t count) const {
    const unsigned width = device_.options().packet_width;
    return (count + width - 1) / width;
  }
  template <class... Args>
  void run_packets(const char* file, const char* kernel, std::uint64_t items, const Args&... args) {
    const DeviceOptions& o = device_.options();
    device_.run_local(file, kernel, items, std::max(1u, o.work_group_size / o.packet_width), args...);
  }

  void find_pairs(std::uint32_t count) {
    const std::uint32_t patches = around_.patches;
    grow(counts_, device_, std::uint64_t(count) * patches, "patches of sensors");
    grow(segments_, device_, count + 1, "sensor segments");
    grow(total_, device_, count, "sensor totals");
    device_.run(pair_kernels, "sensor_pairs", std::uint64_t(count) * patches, sensors_, around_.corners,
                around_.brightness[way_.without_lamps], counts_, first_, count, patches);
    pairs_ = allocate(device_, counts_.buffer(), std::uint64_t(count) * patches, "pairs of sensor and patch");
    const std::uint64_t total = pairs_.total;
    grow(factor_, device_, total, "pairs"), grow(weight_, device_, total, "pairs");
    grow(ray_counts_, device_, total, "pairs"), grow(done_, device_, total, "pairs");
    grow(moments_, device_, (1 + 2 * std::uint64_t(bands_)) * total, "pairs");
    if (total > 0) done_.fill_zero(), moments_.fill_zero();
    if (total > 0)
      run_packets(pair_kernels, "sensor_factors", packets(count) * patches, sensors_, around_.shooters,
                  pairs_.offsets, around_.brightness[way_.without_lamps], factor_, weight_, first_, count,
                  patches);
    device_.run(pair_kernels, "sensor_segments", count + 1, pairs_.offsets, segments_, count, patches);
    segmented_reduce_sum(device_, weight_.buffer(), segments_.buffer(), total_.buffer(), count);
  }

  void cast(double rays_of_sensor, std::uint32_t least) {
    const std::uint32_t patches = around_.patches;
    device_.run(pair_kernels, "sensor_ray_counts", pairs_.total, pairs_.owner, weight_, total_,
                float(rays_of_sensor), least, ray_counts_, pairs_.total, patches);
    const Allocation rays = allocate(device_, ray_counts_.buffer(), pairs_.total, "rays of sensors");
    if (rays.total == 0) return;
    grow(origins_, device_, rays.total, "sensor rays"), grow(ends_, device_, rays.total, "sensor rays");
    grow(ray_weight_, device_, rays.total, "sensor rays"), grow(masks_, device_, rays.total, "sensor rays");
    grow(place_, device_, 2 * std::uint64_t(rays.total), "sensor rays");
    grow(found_, device_, std::uint64_t(bands_) * rays.total, "sensor rays");
    run_packets(sensor_kernels, "sensor_rays", packets(rays.total), sensors_, around_.corners, pairs_.owner,
                done_, rays.owner, rays.rank, origins_, ends_, ray_weight_, place_, first_, rays.total,
                patches, way_.seed);
    const Segments segments{&origins_, nullptr, rays.total, &ends_, 0};
    engine_.occluded(segments, masks_);
    const RealArray passes = glass_ ? glass_->pass_pairs(segments, masks_) : RealArray();
    const bool use_lamps = way_.asks && around_.any_reflects && around_.lamp_count > 0,
               use_lights = way_.asks && around_.any_reflects && lights_ && lights_->count() > 0;
    if (use_lamps || use_lights) {
      grow(idle_, device_, rays.total, "sensor rays");
      device_.run(sensor_kernels, "sensor_idle", rays.total, pairs_.owner, rays.owner, masks_,
                  around_.reflects, idle_, rays.total, patches);
    }
    if (use_lamps) ask_lamps(rays);
    const RealArray from_lights = use_lights ? ask_lights(rays.total) : RealArray();
    // What is not there is not read, but has to be some buffer.
    device_.run(sensor_kernels, "sensor_found", rays.total, pairs_.owner, rays.owner, place_, masks_,
                std::uint32_t(glass_ != nullptr), glass_ ? passes : place_, colours_, around_.quads,
                around_.reflects, around_.patch_first, around_.code, around_.level, around_.vertex,
                around_.middle, around_.edge, around_.irradiance, around_.bend,
                around_.emitted[way_.without_lamps], around_.rho, std::uint32_t(use_lamps),
                use_lamps ? lamp_ : masks_, use_lamps ? light_ : place_, around_.lamp_exitance,
                around_.lamp_count, std::uint32_t(use_lights), use_lights ? from_lights : place_, found_,
                rays.total, patches, around_.elements, around_.vertices, around_.edge_count, bands_,
                around_.depth);
    device_.run(sensor_kernels, "sensor_tally", pairs_.total, rays.offsets, ray_weight_, found_, factor_,
                moments_, done_, pairs_.total, rays.total, bands_);
    if (ends_of_rays_) note_ends(rays);
  }

  void note_ends(const Allocation& rays) {
    const std::uint32_t total = rays.total;
    Array<std::uint32_t> element(device_, total, "rays' ends"), vertex(device_, 8ull * total, "rays' ends");
    RealArray weight(device_, 16ull * total, "rays' ends"), share(device_, total, "rays' ends");
    device_.run(sensor_kernels, "sensor_ends", total, pairs_.owner, rays.owner, place_, ray_weight_, moments_,
                masks_, around_.quads, around_.reflects, around_.patch_first, around_.code, around_.level,
                around_.vertex, around_.middle, element, vertex, weight, share, total, around_.patches,
                around_.depth);
    const auto pair = rays.owner.download(0, total), owner = pairs_.owner.download(0, pairs_.total);
    for (const std::uint32_t p : pair) ends_of_rays_->sensor.push_back(first_ + owner[p] / around_.patches);
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(ends_of_rays_->element, element.download()), append(ends_of_rays_->vertex, vertex.download());
    append(ends_of_rays_->weight, weight.download()), append(ends_of_rays_->share, share.download());
  }

  void ask_lamps(const Allocation& rays) {
    grow(targets_, device_, rays.total, "rays to lamps"), grow(asks_, device_, rays.total, "rays to lamps");
    grow(asking_, device_, rays.total, "rays to lamps"), grow(lamp_, device_, rays.total, "rays to lamps");
    grow(lamp_masks_, device_, rays.total, "rays to lamps");
    grow(light_, device_, std::uint64_t(colours_) * rays.total, "rays to lamps");
    run_packets(sensor_kernels, "sensor_lamps", packets(rays.total), ends_, pairs_.owner, done_, rays.owner,
                rays.rank, idle_, around_.lamp_corners, around_.lamps, around_.lamp_count, targets_, asks_,
                lamp_, light_, colours_, first_, rays.total, around_.patches, way_.seed);
    const std::uint32_t count = compact(device_, asks_.buffer(), rays.total, asking_.buffer());
    const Segments segments{&ends_, &asking_, count, &targets_, 0};
    if (count > 0) engine_.occluded(segments, lamp_masks_);
    const RealArray passes = glass_ && count > 0 ? glass_->pass_pairs(segments, lamp_masks_) : RealArray();
    device_.run(sensor_kernels, "sensor_lamps_seen", count, asking_, lamp_masks_,
                std::uint32_t(glass_ != nullptr), glass_ && count > 0 ? passes : place_, light_, colours_,
                count, rays.total);
  }

  RealArray ask_lights(std::uint32_t rays) {
    const std::uint64_t size = std::uint64_t(bands_) * rays;
    RealArray irradiance(device_, size, "light from lights"), lost(device_, size, "light from lights");
    irradiance.fill_zero(), lost.fill_zero();
    lights_->irradiate(engine_, ends_, &idle_, 0, rays, irradiance, lost, rays);
    return irradiance;
  }
};

std::uint32_t points_at_a_time(const Device& device, double patches, double bands, std::uint64_t count,
                               std::uint32_t rays, std::uint64_t most_bytes) {
  const std::uint64_t room = std::min(
      most_bytes, (device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held)) / 4);
  // Rays dominate: three points, weights, masks and owners take some 200 bytes each in float, what is found 4 a band, in double twice
  // that.
  const double per_point = (rays + 4 * patches) * (400 + 16 * bands);
  const double most = std::min(double(count), double(1u << 30) / patches);
  return std::uint32_t(std::max(1.0, std::min(double(room) / per_point, most)));
}

}  // namespace

void gather_at(Device& device, const Solution& solution, const Surroundings& around, const PointArray& points,
               VisibilityEngine& engine, const Way& way, const Glass* glass, Lights* lights,
               RealArray& irradiance, RealArray& error, std::uint64_t most_bytes) {
  const auto count = std::uint32_t(points.size());
  const std::uint32_t batch =
      points_at_a_time(device, around.patches, solution.bands, count, way.rays, most_bytes);
  Gather gather(device, solution, around, points, engine, way, glass, lights);
  for (std::uint32_t first = 0; first < count; first += batch)
    gather.run(first, std::min(batch, count - first), irradiance, error);
}

void look_from(Device& device, const Solution& solution, const Surroundings& around, const PointArray& points,
               VisibilityEngine& engine, const Way& way, const Glass* glass,
               const std::function<void(const RayEnds&)>& see) {
  // One ray goes to each patch at least, however few are asked for.
  constexpr std::uint32_t at_a_time = 1u << 18;
  const auto count = std::uint32_t(points.size());
  const std::uint32_t batch = std::clamp(
      at_a_time / (way.rays + around.patches), 1u,
      points_at_a_time(device, around.patches, solution.bands, count, way.rays, ~std::uint64_t(0)));
  Gather gather(device, solution, around, points, engine, way, glass, nullptr);
  for (std::uint32_t first = 0; first < count; first += batch) {
    RayEnds ends;
    gather.look(first, std::min(batch, count - first), ends);
    see(ends);
  }
}

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

double gather_bytes(const Device& device, double patches, double bands, std::uint64_t points,
                    std::uint32_t rays, double first) {
  if (points == 0) return 0;
  const double real = device.options().precision == Precision::float64 ? 8 : 4;
  const double together = points_at_a_time(device, patches, bands, points, rays, ~std::uint64_t(0));
  // Of a ray two points, its weight, place and what it found, and six masks, owners and numbers; where lamps are asked, a third point, their
  // light and five more numbers, which counts for the most of it as it is not known before. Of a pair its numbers and moments. A patch that
  // faces the point gets a ray at first, however few there are; half of all do.
  const double point = 9 * real + 8, to_lamps = 0.7 * (point + real + 5 * 4);
  const double ray = 2 * point + (3 + bands) * real + 6 * 4 + to_lamps, pair = 5 * 4 + (3 + 2 * bands) * real;
  const double rays_at_once = std::max(first * rays + patches / 2, (1 - first) * rays);
  return together * (rays_at_once * ray + patches * pair);
}

double sensor_gather_bytes(const Device& device, double patches, double bands, std::uint64_t sensors,
                           std::uint32_t rays) {
  return gather_bytes(device, patches, bands, sensors, rays, first_share);
}

Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors) {
  Frame frame = frame_of(scene);
  for (const Sensor& sensor : sensors) frame = reaching(frame, sensor.position_m);
  for (const PunctualLight& light : scene.lights)
    if (light.kind != PunctualLight::Kind::directional) frame = reaching(frame, light.position_m);
  return frame;
}

namespace {

Way way_of(const SolveOptions& options) {
  return {options.sensor_rays, std::uint32_t(options.seed), false, true, false, first_share};
}

}  // namespace

std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, SensorGather& gathered,
                                            const Glass* glass, Lights* lights) {
  if (options.sensors.empty()) return {};
  const auto stage = device.stage("gather at sensors");
  std::vector<Point>& points = gathered.sensors;
  points.clear(), gathered.of_vertices.clear();
  for (const Sensor& s : options.sensors) {
    const glm::dvec3 position = solution.frame.to_frame(s.position_m), normal = glm::normalize(s.normal);
    points.push_back({position, normal, plane_under(solution, planes, position, normal), 0xffffffffu});
  }
  const LampLight& lamps = gathered.lamps;
  const std::uint64_t before = engine.counts().rays;
  Surroundings& around = gathered.around.emplace(surroundings_of(device, solution, planes, &lamps));
  if (lamps.interreflection && around.any_reflects)
    gathered.of_vertices =
        gather_at_vertices(device, solution, around, engine, way_of(options), points, glass, lights, lamps);
  std::vector<SensorResult> results =
      gather_again(device, solution, engine, options, gathered, glass, lights);
  gathered.rays = engine.counts().rays - before;
  return results;
}

std::vector<SensorResult> gather_again(Device& device, const Solution& solution, VisibilityEngine& engine,
                                       const SolveOptions& options, const SensorGather& gathered,
                                       const Glass* glass, Lights* lights) {
  const auto stage = device.stage("gather at sensors");
  const PointArray sensor(device, gathered.sensors, "sensors");
  const auto sensors = std::uint32_t(gathered.sensors.size());
  RealArray irradiance(device, std::uint64_t(sensors) * solution.bands, "sensor irradiance");
  RealArray error(device, std::uint64_t(sensors) * solution.bands, "sensor errors");
  gather_at(device, solution, *gathered.around, sensor, engine, way_of(options), glass, lights, irradiance,
            error);
  auto h = irradiance.download();
  auto e = error.download();
  for (std::size_t i = 0; i < gathered.of_vertices.size(); ++i)
    e[i] = std::sqrt(e[i] * e[i] + gathered.of_vertices[i]);
  if (lights) add_light_of(*lights, device, engine, sensor, solution.bands, h);
  std::vector<SensorResult> results;
  for (std::uint32_t s = 0; s < sensors; ++s) {
    const auto at = std::ptrdiff_t(s) * solution.bands;
    results.push_back({options.sensors[s].position_m,
                       glm::normalize(options.sensors[s].normal),
                       {h.begin() + at, h.begin() + at + solution.bands},
                       {e.begin() + at, e.begin() + at + solution.bands}});
  }
  return results;
}

}  // namespace clrad
