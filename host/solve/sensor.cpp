#include "solve/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "mesh/bend.hpp"
#include "output/display.hpp"
#include "solve/lamps.hpp"
#include "solve/nodes.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* sensor_kernels = "solve/sensor.cl";
// The share of a sensor's rays by which the others are shared out.
constexpr double first_share = 0.125;
// Vertices get as many rays as the sensors altogether, but each no fewer than this, nor more than a share of what a sensor gets.
constexpr std::uint64_t fewest_vertex_rays = 256, sensor_per_vertex_rays = 4;
constexpr std::uint64_t most_patches_per_ray = 2, most_vertex_work = 4, always_vertex_work = 1 << 22;
// A check is not to be what decides how much memory a solve takes.
constexpr std::uint64_t most_check_bytes = 32 << 20;
constexpr double most_alike = 2.5;
// What a patch whose vertices are all dark may have all the same, in shares of the mean irradiance: rays are to find it.
constexpr double dark_share = 0.02;

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

// Patches, what is interpolated on them, and lamps, on the device (kernels/solve/sensor.cl).
struct Surroundings {
  std::uint32_t patches, elements, vertices, edge_count, lamp_count, depth = 0;
  PointArray corners, lamp_corners;
  RealArray shooters, irradiance, bend, rho, lamps, lamp_exitance;
  /// [0]: of everything, [1]: without what lamps emit.
  std::array<RealArray, 2> brightness, radiosity, emitted;
  Array<std::uint32_t> quads, reflects, patch_first, code, level, vertex, middle, edge;
  Edges edges;
  bool any_reflects = false;
};

void add_lamps(Surroundings& s, Device& device, const Solution& solution,
               std::span<const std::uint32_t> polygons, std::span<const std::uint32_t> planes) {
  s.lamp_count = std::uint32_t(polygons.size());
  std::vector<Point> corners;
  std::vector<double> records, exitance;
  for (const std::uint32_t p : polygons) {
    const Polygon& polygon = solution.scene.polygons[p];
    glm::dvec3 middle(0);
    double radius = 0, emitted = 0;
    for (std::uint32_t k = 0; k < 4; ++k) {
      const glm::dvec3 c = solution.frame.to_frame(polygon.corner[std::min(k, polygon.corners - 1)]);
      corners.push_back({c, polygon.normal(), planes[p], p});
      if (k < polygon.corners) middle += c / double(polygon.corners);
    }
    for (std::size_t k = corners.size() - 4; k < corners.size(); ++k)
      radius = std::max(radius, glm::length(corners[k].position - middle));
    for (const double e : solution.material_of(p).emitted_exitance) emitted += e;
    records.insert(records.end(), {middle.x, middle.y, middle.z, radius, emitted * radius * radius});
  }
  for (std::uint32_t b = 0; b < solution.bands; ++b)
    for (const std::uint32_t p : polygons) exitance.push_back(solution.material_of(p).emitted_exitance[b]);
  if (polygons.empty())
    corners.emplace_back(), records.push_back(0), exitance.push_back(0);  // no empty buffers
  s.lamp_corners = PointArray(device, corners, "lamps");
  s.lamps = RealArray(device, records, "lamps");
  s.lamp_exitance = RealArray(device, exitance, "lamps");
}

// What patches emit, and what they have on average, which shares out rays.
void add_radiosity(Surroundings& s, Device& device, const Solution& solution,
                   std::span<const std::uint32_t> lamps) {
  const std::vector<double> nodes = node_radiosity(solution);
  const std::size_t count = s.patches + s.elements;
  for (std::size_t without = 0; without < 2; ++without) {
    std::vector<double> radiosity, emitted, brightness(s.patches);
    for (std::uint32_t b = 0; b < solution.bands; ++b) {
      double arriving = 0, area = 0;
      for (std::uint32_t p = 0; p < s.patches; ++p) {
        const double a = solution.mesh.patches[p].area_m2;
        arriving += a * solution.patch_irradiance[std::size_t(b) * s.patches + p], area += a;
      }
      for (std::uint32_t p = 0; p < s.patches; ++p) {
        const std::uint32_t polygon = solution.mesh.patches[p].polygon;
        const double e = solution.material_of(polygon).emitted_exitance[b];
        const bool left_out = without && std::binary_search(lamps.begin(), lamps.end(), polygon);
        emitted.push_back(left_out ? 0 : e);
        radiosity.push_back(nodes[b * count + p] - (left_out ? e : 0));
        brightness[p] += radiosity.back() + dark_share * solution.patch_reflectance(b, p) * arriving / area;
      }
    }
    s.emitted[without] = RealArray(device, emitted, "emitted exitance");
    s.radiosity[without] = RealArray(device, radiosity, "patch radiosity");
    s.brightness[without] = RealArray(device, brightness, "patch brightness");
  }
}

// What stands between vertices: [band][vertex], and what edges have besides, [band][edge]; empty: by the second differences of vertices.
void interpolate(Surroundings& s, Device& device, const Solution& solution, std::vector<double> irradiance,
                 std::vector<double> bend = {}) {
  fill_covered(solution.mesh, solution.vertex_covered, irradiance, solution.bands);
  if (bend.empty())
    bend = edge_bends(solution.mesh, s.edges, solution.vertex_covered, irradiance, solution.bands);
  s.bend = RealArray(device, bend, "bends of irradiance");
  s.irradiance = RealArray(device, irradiance, "irradiance of vertices");
}

void add_elements(Surroundings& s, Device& device, const Solution& solution) {
  const Mesh& mesh = solution.mesh;
  std::vector<std::uint32_t> quads, reflects, patch_first, code, level, vertex, middle, edge;
  std::vector<double> rho;
  for (const Patch& patch : mesh.patches) {
    quads.push_back(patch.corners == 4);
    patch_first.push_back(patch.first_element);
    bool any = false;
    for (const double r : solution.material_of(patch.polygon).reflectance) any |= r > 0;
    any |= solution.material_of(patch.polygon).texture != no_texture;
    reflects.push_back(any);
    s.any_reflects |= any;
  }
  patch_first.push_back(s.elements);
  for (const Element& e : mesh.elements) {
    code.push_back(e.code);
    level.push_back(e.level);
    s.depth = std::max(s.depth, e.level);
    vertex.insert(vertex.end(), e.vertex.begin(), e.vertex.end());
    middle.insert(middle.end(), e.middle.begin(), e.middle.end());
  }
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    for (std::size_t e = 0; e < s.elements; ++e)
      rho.push_back(solution.textured.element.empty()
                        ? solution.material_of(mesh.patches[mesh.elements[e].patch].polygon).reflectance[b]
                        : solution.textured.element[b * s.elements + e]);
  }
  const auto array = [&](const std::vector<std::uint32_t>& values) {
    return Array<std::uint32_t>(device, values, "elements");
  };
  s.quads = array(quads), s.reflects = array(reflects), s.patch_first = array(patch_first),
  s.code = array(code);
  s.level = array(level), s.vertex = array(vertex), s.middle = array(middle);
  s.edges = edges_of(mesh);
  s.edge_count = std::uint32_t(s.edges.ends.size());
  for (const auto& of : s.edges.of_element) edge.insert(edge.end(), of.begin(), of.end());
  s.edge = array(edge);
  s.rho = RealArray(device, rho, "reflectance of elements");
}

Surroundings surroundings_of(Device& device, const Solution& solution, std::span<const std::uint32_t> planes,
                             const LampLight* lamps) {
  Surroundings s;
  s.patches = std::uint32_t(solution.mesh.patches.size());
  s.elements = std::uint32_t(solution.mesh.elements.size());
  s.vertices = solution.vertex_count();
  const PatchNodes nodes = patch_nodes(solution);
  s.corners = PointArray(device, nodes.corners, "patch corners");
  s.shooters = RealArray(device, nodes.shooters, "patches");
  const std::span<const std::uint32_t> polygons =
      lamps ? std::span<const std::uint32_t>(lamps->polygons) : std::span<const std::uint32_t>();
  add_lamps(s, device, solution, polygons, planes);
  add_radiosity(s, device, solution, polygons);
  add_elements(s, device, solution);
  std::vector<double> irradiance = solution.vertex_irradiance;
  for (std::size_t i = 0; lamps && i < lamps->vertex.size(); ++i) irradiance[i] -= lamps->vertex[i];
  interpolate(s, device, solution, std::move(irradiance));
  return s;
}

// How to gather.
struct Way {
  std::uint32_t rays = 0, seed = 0;
  bool without_lamps = false;  ///< what lamps emit is left out
  bool asks = false;           ///< lamps and lights are asked at rays' ends
  bool few = false;            ///< rays for a patch
  double first_share = 1;  ///< of the rays, shared out by what patches bring; the others by what these find
};

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

 private:
  Device& device_;
  const Surroundings& around_;
  const PointArray& sensors_;
  VisibilityEngine& engine_;
  const Way way_;
  const Glass* const glass_;
  Lights* const lights_;
  const std::uint32_t bands_, colours_, open_;
  std::uint32_t first_ = 0;
  Allocation pairs_;
  Array<std::uint32_t> counts_, segments_, ray_counts_, done_;  // of pairs
  Array<float> total_, weight_;
  RealArray factor_, moments_;
  Array<std::uint32_t> masks_, lamp_masks_, idle_, asks_, asking_, lamp_;  // of rays
  RealArray ray_weight_, place_, light_, found_;
  PointArray origins_, ends_, targets_;

  void find_pairs(std::uint32_t count) {
    const std::uint32_t patches = around_.patches;
    grow(counts_, device_, std::uint64_t(count) * patches, "patches of sensors");
    grow(segments_, device_, count + 1, "sensor segments");
    grow(total_, device_, count, "sensor totals");
    device_.run(sensor_kernels, "sensor_pairs", std::uint64_t(count) * patches, sensors_, around_.corners,
                around_.brightness[way_.without_lamps], counts_, first_, count, patches);
    pairs_ = allocate(device_, counts_.buffer(), std::uint64_t(count) * patches, "pairs of sensor and patch");
    const std::uint64_t total = pairs_.total;
    grow(factor_, device_, total, "pairs"), grow(weight_, device_, total, "pairs");
    grow(ray_counts_, device_, total, "pairs"), grow(done_, device_, total, "pairs");
    grow(moments_, device_, (1 + 2 * std::uint64_t(bands_)) * total, "pairs");
    if (total > 0) done_.fill_zero(), moments_.fill_zero();
    device_.run(sensor_kernels, "sensor_factors", total, sensors_, around_.shooters, pairs_.owner,
                around_.brightness[way_.without_lamps], factor_, weight_, first_, pairs_.total, patches);
    device_.run(sensor_kernels, "sensor_segments", count + 1, pairs_.offsets, segments_, count, patches);
    segmented_reduce_sum(device_, weight_.buffer(), segments_.buffer(), total_.buffer(), count);
  }

  void cast(double rays_of_sensor, std::uint32_t least) {
    const std::uint32_t patches = around_.patches;
    device_.run(sensor_kernels, "sensor_ray_counts", pairs_.total, pairs_.owner, weight_, total_,
                float(rays_of_sensor), least, ray_counts_, pairs_.total, patches);
    const Allocation rays = allocate(device_, ray_counts_.buffer(), pairs_.total, "rays of sensors");
    if (rays.total == 0) return;
    grow(origins_, device_, rays.total, "sensor rays"), grow(ends_, device_, rays.total, "sensor rays");
    grow(ray_weight_, device_, rays.total, "sensor rays"), grow(masks_, device_, rays.total, "sensor rays");
    grow(place_, device_, 2 * std::uint64_t(rays.total), "sensor rays");
    grow(found_, device_, std::uint64_t(bands_) * rays.total, "sensor rays");
    device_.run(sensor_kernels, "sensor_rays", rays.total, sensors_, around_.corners, pairs_.owner, done_,
                rays.owner, rays.rank, origins_, ends_, ray_weight_, place_, first_, rays.total, patches,
                way_.seed);
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
  }

  void ask_lamps(const Allocation& rays) {
    grow(targets_, device_, rays.total, "rays to lamps"), grow(asks_, device_, rays.total, "rays to lamps");
    grow(asking_, device_, rays.total, "rays to lamps"), grow(lamp_, device_, rays.total, "rays to lamps");
    grow(lamp_masks_, device_, rays.total, "rays to lamps");
    grow(light_, device_, std::uint64_t(colours_) * rays.total, "rays to lamps");
    device_.run(sensor_kernels, "sensor_lamps", rays.total, ends_, pairs_.owner, done_, rays.owner, rays.rank,
                idle_, around_.lamp_corners, around_.lamps, around_.lamp_count, targets_, asks_, lamp_,
                light_, colours_, first_, rays.total, around_.patches, way_.seed);
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

// In batches: rays dominate; three points, weights, masks and owners take some 200 bytes each in float, what is found 4 a band, in double
// twice that.
void gather_at(Device& device, const Solution& solution, const Surroundings& around, const PointArray& points,
               VisibilityEngine& engine, const Way& way, const Glass* glass, Lights* lights,
               RealArray& irradiance, RealArray& error, std::uint64_t most_bytes = ~std::uint64_t(0)) {
  const auto count = std::uint32_t(points.size());
  const std::uint64_t room = std::min(
      most_bytes, (device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held)) / 4);
  const std::uint64_t per_point = (std::uint64_t(way.rays) + 4 * std::uint64_t(around.patches)) *
                                  (400 + 16 * std::uint64_t(solution.bands));
  const auto batch = std::uint32_t(std::clamp<std::uint64_t>(
      room / per_point, 1, std::min<std::uint64_t>(count, (1u << 30) / around.patches)));
  Gather gather(device, solution, around, points, engine, way, glass, lights);
  for (std::uint32_t first = 0; first < count; first += batch)
    gather.run(first, std::min(batch, count - first), irradiance, error);
}

// Vertices that nothing covers, and behind them the middles of the edges between them.
struct Places {
  std::vector<Point> points;
  std::vector<std::uint32_t> vertices, edges;
};

Places places_of(const Solution& solution, const Edges& edges) {
  const std::vector<Point>& receivers = solution.mesh.receivers;
  Places places;
  for (std::uint32_t v = 0; v < receivers.size(); ++v)
    if (!solution.vertex_covered[v]) places.points.push_back(receivers[v]), places.vertices.push_back(v);
  for (std::uint32_t e = 0; e < edges.ends.size(); ++e) {
    const auto& [a, b] = edges.ends[e];
    if (solution.vertex_covered[a] || solution.vertex_covered[b]) continue;
    places.points.push_back(receivers[a]);
    places.points.back().position = 0.5 * (receivers[a].position + receivers[b].position);
    places.edges.push_back(e);
  }
  return places;
}

// The same rays, fewer of them, from the vertices and from the middles of edges: what comes to a sensor by one surface is then off by what
// the mesh says of light after two more, and no longer by what the averages of patches hide of the first; and next to the edges of
// walls, where this falls steeply, it is interpolated by parabolas. Where patches are so many that each would hardly get a ray the mesh
// shows that itself. Returns the standard error that the rays of vertices leave at a sensor, relative to its irradiance: what
// independent errors leave in a mean over a sixth of all places (over seeds, in rooms of 800 to 9000 places, over a twelfth to a fifth).
double gather_at_vertices(Device& device, const Solution& solution, Surroundings& around,
                          VisibilityEngine& engine, Way way, std::uint64_t sensors, const Glass* glass,
                          Lights* lights) {
  way.seed = ~way.seed;
  way.without_lamps = true;
  way.few = true;
  way.first_share = 1;  // too few to tell what varies
  const Places places = places_of(solution, around.edges);
  if (places.points.empty()) return 0;
  const std::uint64_t share =
      std::min(sensors * way.rays / places.points.size(), way.rays / sensor_per_vertex_rays);
  const std::uint64_t rays_of_sensor = way.rays;
  way.rays = std::uint32_t(std::max(fewest_vertex_rays, share));
  if (around.patches > most_patches_per_ray * way.rays) return 0;
  // A mesh as fine as that shows the light itself, and its vertices would take far longer than the sensors.
  if (places.points.size() * way.rays >
      std::max(always_vertex_work, most_vertex_work * sensors * rays_of_sensor))
    return 0;
  const PointArray at(device, places.points, "vertices");
  RealArray irradiance(device, places.points.size() * solution.bands, "irradiance of vertices"),
      error(device, places.points.size() * solution.bands, "irradiance of vertices");
  gather_at(device, solution, around, at, engine, way, glass, lights, irradiance, error);
  const std::vector<double> found = irradiance.download(), off = error.download();
  std::vector<double> by_vertex(std::size_t(solution.bands) * around.vertices),
      bend(std::size_t(solution.bands) * around.edge_count);
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    double* const value = by_vertex.data() + std::size_t(b) * around.vertices;
    for (std::size_t i = 0; i < places.vertices.size(); ++i)
      value[places.vertices[i]] = found[i * solution.bands + b];
    for (std::size_t i = 0; i < places.edges.size(); ++i) {
      const auto& ends = around.edges.ends[places.edges[i]];
      const double middle = found[(places.vertices.size() + i) * solution.bands + b];
      // Along the edge (1 - t) a + t b + bend t (1 - t).
      bend[std::size_t(b) * around.edge_count + places.edges[i]] =
          4 * middle - 2 * (value[ends[0]] + value[ends[1]]);
    }
  }
  interpolate(around, device, solution, std::move(by_vertex), std::move(bend));
  double all = 0, all_off = 0;
  for (std::size_t i = 0; i < found.size(); ++i) all += found[i] * found[i], all_off += off[i] * off[i];
  // sqrt(6 / places), and never more than half: as much of the light at least comes straight, or by one surface, from lamps.
  return all > 0
             ? std::sqrt(all_off / all) * std::min(0.5, most_alike / std::sqrt(double(places.points.size())))
             : 0;
}

}  // namespace

Frame frame_with_sensors(const Scene& scene, std::span<const Sensor> sensors) {
  Frame frame = frame_of(scene);
  for (const Sensor& sensor : sensors) frame = reaching(frame, sensor.position_m);
  for (const PunctualLight& light : scene.lights)
    if (light.kind != PunctualLight::Kind::directional) frame = reaching(frame, light.position_m);
  return frame;
}

std::vector<SensorResult> gather_at_sensors(Device& device, const Solution& solution,
                                            std::span<const std::uint32_t> planes, VisibilityEngine& engine,
                                            const SolveOptions& options, const Glass* glass, Lights* lights,
                                            const LampLight* lamps, bool* regathered) {
  if (options.sensors.empty()) return {};
  const auto stage = device.stage("gather at sensors");
  std::vector<Point> points;
  for (const Sensor& s : options.sensors) {
    const glm::dvec3 position = solution.frame.to_frame(s.position_m), normal = glm::normalize(s.normal);
    points.push_back({position, normal, plane_under(solution, planes, position, normal), 0xffffffffu});
  }
  const PointArray sensor(device, points, "sensors");
  const auto sensors = std::uint32_t(points.size());
  Surroundings around = surroundings_of(device, solution, planes, lamps);
  const auto seed = std::uint32_t(options.seed);
  const Way way{options.sensor_rays, seed, false, lamps != nullptr, false, first_share};
  double of_vertices = 0;
  if (lamps && lamps->interreflection && around.any_reflects)
    of_vertices = gather_at_vertices(device, solution, around, engine, way, sensors, glass, lights);
  if (regathered) *regathered = of_vertices > 0;
  RealArray irradiance(device, std::uint64_t(sensors) * solution.bands, "sensor irradiance");
  RealArray error(device, std::uint64_t(sensors) * solution.bands, "sensor errors");
  gather_at(device, solution, around, sensor, engine, way, glass, lights, irradiance, error);

  auto h = irradiance.download();
  auto e = error.download();
  for (std::size_t i = 0; i < e.size(); ++i) e[i] = std::hypot(e[i], of_vertices * h[i]);
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

std::vector<std::vector<double>> gather_for_check(Device& device, const Solution& solution,
                                                  VisibilityEngine& engine, std::span<const double> shot,
                                                  bool reflecting, std::span<const CheckGather> ways,
                                                  const Glass* glass, Lights* lights) {
  Surroundings around = surroundings_of(device, solution, {}, nullptr);
  const std::vector<double> nodes = node_radiosity(solution);
  const std::size_t count = around.patches + std::size_t(around.elements);
  // Rays find emitted + rho H, with H between the vertices; what is not shot yet is to be missing in that.
  std::vector<double> emitted, brightness(around.patches, 0.0);
  for (std::uint32_t b = 0; b < solution.bands; ++b)
    for (std::uint32_t p = 0; p < around.patches; ++p) {
      const double sent = shot[std::size_t(b) * around.patches + p];
      const double e = solution.material_of(solution.mesh.patches[p].polygon).emitted_exitance[b];
      emitted.push_back(e - (nodes[b * count + p] - sent));
      brightness[p] += sent;
    }
  // [0]: varying, [1]: as shot.
  const std::vector<double> sent(shot.begin(), shot.end());
  around.emitted[0] = RealArray(device, emitted, "emitted exitance");
  around.emitted[1] = RealArray(device, sent, "shot radiosity");
  for (std::size_t k = 0; k < 2; ++k) {
    around.radiosity[k] = RealArray(device, sent, "shot radiosity");
    around.brightness[k] = RealArray(device, brightness, "patch brightness");
  }
  Array<std::uint32_t> others(device, std::vector<std::uint32_t>(around.patches, 0u), "elements");
  bool reflects = true;
  std::vector<std::vector<double>> results;
  for (const CheckGather& check : ways) {
    Way way;
    way.rays = check.rays, way.seed = std::uint32_t(check.seed);
    way.without_lamps = check.flat || !reflecting;
    if (reflects == way.without_lamps) std::swap(around.reflects, others), reflects = !reflects;
    const std::uint64_t values = check.points->size() * solution.bands;
    RealArray irradiance(device, values, "irradiance at points"),
        error(device, values, "irradiance at points");
    gather_at(device, solution, around, *check.points, engine, way, glass, lights, irradiance, error,
              most_check_bytes);
    results.push_back(irradiance.download());
    if (lights) add_light_of(*lights, device, engine, *check.points, solution.bands, results.back());
  }
  return results;
}

}  // namespace clrad
