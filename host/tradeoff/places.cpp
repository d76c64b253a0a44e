#include "tradeoff/places.hpp"

#include <cmath>
#include <glm/geometric.hpp>

#include "mesh/build.hpp"
#include "mesh/locate.hpp"
#include "mesh/random.hpp"
#include "output/displayed.hpp"
#include "scene/planes.hpp"
#include "solve/check_points.hpp"
#include "solve/covered.hpp"

namespace clrad {
namespace {

struct OnPolygon {
  glm::dvec3 position_m;
  double jacobian_m2;  // area per unit of u and v
};

OnPolygon on_polygon(const Polygon& p, double u, double v) {
  const auto& c = p.corner;
  if (p.corners == 3) return {c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]), 2 * p.area_m2()};
  const glm::dvec3 du = (1 - v) * (c[1] - c[0]) + v * (c[2] - c[3]),
                   dv = (1 - u) * (c[3] - c[0]) + u * (c[2] - c[1]);
  return {(1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[3] + u * c[2]),
          glm::length(glm::cross(du, dv))};
}

double fraction(double x) {
  return x - std::floor(x);
}

}  // namespace

std::vector<Place> stratified_places(const Scene& scene, std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  double all = 0;
  for (const Polygon& p : scene.polygons) all += p.area_m2();
  std::vector<Place> places;
  // Points at equal steps along the polygons' areas, end to end, from a random start: a polygon of k steps gets k on average.
  const double step = all / count;
  const double start = random.unit() * step;
  double begin = 0;
  std::uint64_t taken = 0;
  for (std::uint32_t i = 0; i < scene.polygons.size(); ++i) {
    const Polygon& p = scene.polygons[i];
    const double area = p.area_m2();
    const double shift_u = random.unit(), shift_v = random.unit();
    constexpr double g = 1.32471795724474602596;  // g^3 = g + 1
    for (std::uint32_t k = 1; start + double(taken) * step < begin + area; ++taken, ++k) {
      Place place{i, fraction(shift_u + k / g), fraction(shift_v + k / (g * g)), 0, {}};
      // The other half of the square, turned onto the triangle.
      if (p.corners == 3 && place.u + place.v > 1) place.u = 1 - place.u, place.v = 1 - place.v;
      const OnPolygon at = on_polygon(p, place.u, place.v);
      place.weight_m2 = p.corners == 3 ? step : step * at.jacobian_m2 / area;
      place.sensor = {at.position_m, p.normal()};
      places.push_back(place);
    }
    begin += area;
  }
  return places;
}

Sensor sensor_at(const Polygon& polygon, double u, double v) {
  return {on_polygon(polygon, u, v).position_m, polygon.normal()};
}

std::vector<Place> varying_places(const Solution& solution, std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  double area = 0;
  for (const Polygon& p : solution.scene.polygons) area += p.area_m2();
  std::vector<Place> places;
  for (const CheckPoint& p : points_in_elements(solution, count, random))
    places.push_back(
        {p.polygon, p.u, p.v, p.weight * area, sensor_at(solution.scene.polygons[p.polygon], p.u, p.v)});
  return places;
}

std::vector<Place> exposed_places(Device& device, const Scene& scene, const std::vector<Place>& places) {
  const Frame frame = frame_of(scene);
  const std::vector<std::uint32_t> planes = plane_ids(scene);
  // The coarsest mesh there is; the places are further vertices of it.
  Mesh mesh = build_mesh(scene, frame, planes, {2 * frame.metres(), 2 * frame.metres()});
  const std::uint32_t first = mesh.vertex_count();
  for (const Place& p : places)
    mesh.receivers.push_back(
        {frame.to_frame(p.sensor.position_m), p.sensor.normal, planes[p.polygon], p.polygon});
  const auto triangles = occluder_triangles(scene, frame, planes);
  const auto engine = make_engine("shaft", device, triangles);
  const auto covered =
      covered_vertices(device, scene, mesh, triangles, *engine, overlaid_vertices(scene, mesh, first), first);
  std::vector<Place> exposed;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!covered[i]) exposed.push_back(places[i]);
  return exposed;
}

std::vector<double> irradiance_at(const Solution& solution, std::span<const Place> places) {
  const Displayed shown(solution, display_irradiance(solution));
  std::vector<double> values;
  values.reserve(places.size() * solution.bands);
  for (const Place& p : places) {
    const Interpolant at =
        locate(solution.mesh, p.polygon, solution.scene.polygons[p.polygon].corners, p.u, p.v);
    for (std::uint32_t b = 0; b < solution.bands; ++b) values.push_back(shown.at(b, at));
  }
  return values;
}

double mean_over(std::span<const double> reference, std::span<const double> weights, std::uint32_t bands) {
  double sum = 0, all = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double w = weights.empty() ? 1 : weights[i / bands];
    sum += w * reference[i], all += w;
  }
  return all > 0 ? sum / all : 0;
}

double rms_relative(std::span<const double> values, std::span<const double> reference,
                    std::span<const double> weights, std::uint32_t bands) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double w = weights.empty() ? 1 : weights[i / bands], error = values[i] - reference[i];
    squares += w * error * error, all += w;
  }
  const double mean = mean_over(reference, weights, bands);
  return mean > 0 ? std::sqrt(squares / all) / mean : NAN;
}

}  // namespace clrad
