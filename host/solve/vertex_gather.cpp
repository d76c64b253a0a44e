#include "solve/vertex_gather.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "solve/seen_places.hpp"
#include "solve/sensor.hpp"

namespace clrad {
namespace {

// What vertices could use is as many rays as the sensors have altogether, but each no fewer than this (where a sensor has more than a few), nor
// more than a share of what a sensor gets; it also says whether they are gathered at all.
constexpr std::uint64_t fewest_vertex_rays = 256, sensor_per_vertex_rays = 4;
// This part of that is shared out alike, and at most as much again by what sensors see. Measured in the Cornell box: a third less time than
// with all of it, and the errors of sensors all but the same.
constexpr std::uint32_t alike_part = 4;
constexpr std::uint64_t most_patches_per_ray = 2, most_vertex_work = 4, always_vertex_work = 1 << 22;
// Rays by which is found which vertices sensors see most of: from each sensor, and altogether.
constexpr std::uint32_t most_looks = 256, fewest_looks = 64, all_looks = 1u << 16;

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

// For each of `places`; 0: a mesh as fine as that shows the light itself, and its vertices would take far longer than the sensors.
std::uint32_t vertex_rays(std::uint64_t places, std::uint64_t sensors, std::uint64_t rays) {
  const std::uint64_t share = std::min(sensors * rays / places, rays / sensor_per_vertex_rays);
  const std::uint64_t each = std::max(std::min(fewest_vertex_rays, 4 * rays), share);
  const bool too_many = places * each > std::max(always_vertex_work, most_vertex_work * sensors * rays);
  return too_many ? 0 : std::uint32_t(each);
}

PlaceNumbers numbers_of(const Places& places, const Surroundings& around) {
  PlaceNumbers n{places.points.size(), std::vector<std::uint32_t>(around.vertices, 0xffffffffu),
                 std::vector<std::uint32_t>(around.edge_count, 0xffffffffu)};
  for (std::uint32_t i = 0; i < places.vertices.size(); ++i) n.of_vertex[places.vertices[i]] = i;
  for (std::uint32_t i = 0; i < places.edges.size(); ++i)
    n.of_edge[places.edges[i]] = std::uint32_t(places.vertices.size()) + i;
  return n;
}

// [element * bands + band]
std::vector<double> reflectances_of(const Solution& solution) {
  const std::size_t elements = solution.mesh.elements.size();
  std::vector<double> result;
  result.reserve(elements * solution.bands);
  for (std::size_t e = 0; e < elements; ++e) {
    const Patch& patch = solution.mesh.patches[solution.mesh.elements[e].patch];
    for (std::uint32_t b = 0; b < solution.bands; ++b)
      result.push_back(solution.textured.element.empty() ? solution.material_of(patch.polygon).reflectance[b]
                                                         : solution.textured.element[b * elements + e]);
  }
  return result;
}

// Irradiance without what comes straight from lamps, bands summed, as the solution has it.
std::vector<double> irradiance_of(const Places& places, const Solution& solution, const Edges& edges,
                                  const LampLight& lamps) {
  std::vector<double> of_vertex(solution.vertex_count(), 0);
  for (std::size_t i = 0; i < solution.vertex_irradiance.size(); ++i)
    of_vertex[i % of_vertex.size()] +=
        solution.vertex_irradiance[i] - (lamps.vertex.empty() ? 0 : lamps.vertex[i]);
  std::vector<double> result;
  result.reserve(places.points.size());
  for (const std::uint32_t v : places.vertices) result.push_back(of_vertex[v]);
  for (const std::uint32_t e : places.edges)
    result.push_back((of_vertex[edges.ends[e][0]] + of_vertex[edges.ends[e][1]]) / 2);
  return result;
}

// Every `step`-th sensor, each with some rays.
struct Look {
  std::vector<Point> points;
  std::uint32_t step = 1, rays = most_looks;
  explicit Look(std::span<const Point> sensors) {
    const std::size_t most = all_looks / fewest_looks;
    step = std::uint32_t((sensors.size() + most - 1) / most);
    for (std::size_t i = 0; i < sensors.size(); i += step) points.push_back(sensors[i]);
    rays = std::clamp(std::uint32_t(all_looks / points.size()), fewest_looks, most_looks);
  }
};

// H at each of `places` with its own number of rays, and the standard errors of it, [place * bands + band].
struct Found {
  std::vector<double> irradiance, error;
};
Found gather_at_places(Device& device, const Solution& solution, const Surroundings& around,
                       VisibilityEngine& engine, Way way, const Glass* glass, Lights* lights,
                       const Places& places, const std::vector<std::uint32_t>& rays) {
  const std::size_t bands = solution.bands;
  Found found{std::vector<double>(places.points.size() * bands),
              std::vector<double>(places.points.size() * bands)};
  std::map<std::uint32_t, std::vector<std::uint32_t>> alike;  // places of so many rays
  const std::uint32_t seed = way.seed;
  for (std::uint32_t i = 0; i < rays.size(); ++i) alike[rays[i]].push_back(i);
  for (const auto& [count, members] : alike) {
    std::vector<Point> points;
    points.reserve(members.size());
    for (const std::uint32_t i : members) points.push_back(places.points[i]);
    const PointArray at(device, points, "vertices");
    RealArray irradiance(device, points.size() * bands, "irradiance of vertices"),
        error(device, points.size() * bands, "irradiance of vertices");
    way.rays = count;
    way.seed = seed ^ count;  // points are numbered from 0 again
    gather_at(device, solution, around, at, engine, way, glass, lights, irradiance, error);
    const std::vector<double> h = irradiance.download(), e = error.download();
    for (std::size_t k = 0; k < members.size(); ++k)
      for (std::size_t b = 0; b < bands; ++b) {
        found.irradiance[members[k] * bands + b] = h[k * bands + b];
        found.error[members[k] * bands + b] = e[k * bands + b];
      }
  }
  return found;
}

void interpolate_found(Surroundings& around, Device& device, const Solution& solution, const Places& places,
                       const std::vector<double>& found) {
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
}

}  // namespace

std::vector<double> gather_at_vertices(Device& device, const Solution& solution, Surroundings& around,
                                       VisibilityEngine& engine, Way way, std::span<const Point> sensors,
                                       const Glass* glass, Lights* lights, const LampLight& lamps) {
  way.seed = ~way.seed;
  way.without_lamps = true;
  way.few = true;
  way.first_share = 1;  // too few to tell what varies
  const Places places = places_of(solution, around.edges);
  if (places.points.empty()) return {};
  const std::uint32_t each = vertex_rays(places.points.size(), sensors.size(), way.rays), most = way.rays;
  if (each == 0 || around.patches > most_patches_per_ray * each) return {};
  const Look look(sensors);
  Way looking = way;
  looking.rays = look.rays, looking.asks = false;
  const PlaceNumbers numbers = numbers_of(places, around);
  const std::vector<double> reflectances = reflectances_of(solution);
  SeenPlaces seen(around.edges, numbers, reflectances, solution.bands);
  look_from(device, solution, around, PointArray(device, look.points, "sensors"), engine, looking, glass,
            [&](const RayEnds& ends) { seen.add(ends); });
  const Found found = gather_at_places(device, solution, around, engine, way, glass, lights, places,
                                       seen.rays_for(irradiance_of(places, solution, around.edges, lamps),
                                                     std::max(1u, each / alike_part), most));
  interpolate_found(around, device, solution, places, found.irradiance);
  const std::size_t bands = solution.bands;
  const std::vector<double> looked = seen.error_square(found.error, look.points.size());
  std::vector<double> square;
  square.reserve(sensors.size() * bands);
  // One that did not look is taken to be off by as much as the last one before it that did.
  for (std::size_t s = 0; s < sensors.size(); ++s)
    for (std::size_t b = 0; b < bands; ++b) square.push_back(looked[s / look.step * bands + b]);
  return square;
}

double rays_at_vertices(const MeshSize& mesh, double uncovered, std::uint64_t sensors, std::uint32_t rays) {
  const double places = uncovered * (mesh.vertices + mesh.edges);
  if (!(places >= 1 && places < 1e12) || sensors == 0) return 0;
  const std::uint32_t each = vertex_rays(std::uint64_t(places), sensors, rays);
  return mesh.patches <= double(most_patches_per_ray * each) ? places * each : 0;
}

double gather_work(const MeshSize& mesh, double uncovered, std::uint64_t sensors, std::uint32_t rays) {
  constexpr double launches = 3e4, vertex_ray = 0.65;
  const double at_vertices = rays_at_vertices(mesh, uncovered, sensors, rays);
  const double places = double(sensors) + (at_vertices > 0 ? uncovered * (mesh.vertices + mesh.edges) : 0);
  return launches + double(sensors) * rays + vertex_ray * at_vertices + places * mesh.patches;
}

double vertex_gather_bytes(const Device& device, const MeshSize& mesh, double uncovered, double bands,
                           std::uint64_t sensors, std::uint32_t rays) {
  const double at_vertices = rays_at_vertices(mesh, uncovered, sensors, rays);
  if (!(at_vertices > 0)) return 0;
  const double places = uncovered * (mesh.vertices + mesh.edges);
  // Most get their even share of the rays.
  const double each = at_vertices / places / alike_part;
  return gather_bytes(device, mesh.patches, bands, std::uint64_t(places), std::uint32_t(each), 1);
}

}  // namespace clrad
