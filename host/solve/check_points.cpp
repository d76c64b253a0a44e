#include "solve/check_points.hpp"

#include <algorithm>
#include <numeric>

#include "mesh/average.hpp"
#include "mesh/lattice.hpp"

namespace clrad {
namespace {

// One index drawn from each of `count` equal parts of the sum of the weights.
std::vector<std::uint32_t> drawn(const std::vector<double>& weight, std::uint32_t count, Random& random) {
  std::vector<double> sum(weight.size());
  std::partial_sum(weight.begin(), weight.end(), sum.begin());
  std::vector<std::uint32_t> chosen;
  if (sum.empty() || !(sum.back() > 0)) return chosen;
  for (std::uint32_t k = 0; k < count; ++k) {
    const double at = (k + random.unit()) / count * sum.back();
    const auto i = std::upper_bound(sum.begin(), sum.end(), at) - sum.begin();
    chosen.push_back(std::uint32_t(std::min(std::size_t(i), sum.size() - 1)));
  }
  return chosen;
}

// By how much irradiance varies over each element (bands summed; a covered corner is dark), and its mean over the scene.
struct Variation {
  std::vector<double> of_element, exposed_area;
  std::vector<bool> partly_covered;
  double mean = 0;
};

Variation variation_of(const Solution& solution) {
  const Mesh& mesh = solution.mesh;
  const std::size_t vertices = solution.vertex_count();
  Variation v;
  double area = 0, power = 0;
  for (const Element& e : mesh.elements) {
    const std::size_t corners = e.vertex[3] == 0xffffffffu ? 3 : 4;
    double most = 0;
    bool open = false, covers = false;
    for (std::uint32_t b = 0; b < solution.bands; ++b) {
      double low = 0, high = 0;
      for (std::size_t k = 0; k < corners; ++k) {
        const bool covered = solution.vertex_covered[e.vertex[k]] != 0;
        const double h = covered ? 0 : solution.vertex_irradiance[b * vertices + e.vertex[k]];
        low = k == 0 ? h : std::min(low, h), high = k == 0 ? h : std::max(high, h);
        open |= !covered, covers |= covered;
        power += e.area_m2 * h / double(corners);
      }
      most += high - low;
    }
    v.of_element.push_back(most);
    v.partly_covered.push_back(open && covers);
    v.exposed_area.push_back(open ? e.area_m2 : 0);
    area += v.exposed_area.back();
  }
  v.mean = area > 0 ? power / area : 0;
  return v;
}

// What irradiance varies by over each element, relative to its mean over the scene. Next to the foot of what stands on a surface values
// are filled in, and off by as much as all light.
std::vector<double> relative(const Variation& v) {
  constexpr double at_foot = 1;
  std::vector<double> result(v.of_element.size(), 0);
  for (std::size_t e = 0; e < result.size() && v.mean > 0; ++e)
    result[e] = std::max(v.partly_covered[e] ? at_foot : 0, v.of_element[e] / v.mean);
  return result;
}

// How often to draw what has these areas: half as often as by them alone, and by the square of what irradiance varies by there, as an error
// of that size counts in the RMS: a few elements at the corners of what stands on a surface can be most of it.
std::vector<double> shares_of(const std::vector<double>& area, const std::vector<double>& variation) {
  constexpr double by_variation = 0.5;
  std::vector<double> share(area.size());
  double all = 0, varying = 0;
  for (std::size_t i = 0; i < area.size(); ++i)
    share[i] = area[i] * variation[i] * variation[i], all += area[i], varying += share[i];
  for (std::size_t i = 0; i < area.size(); ++i)
    share[i] = (varying > 0 ? by_variation * share[i] / varying : 0) +
               (all > 0 ? (1 - by_variation) * area[i] / all : 0);
  return share;
}

}  // namespace

std::vector<CheckPoint> points_in_elements(const Solution& solution, std::uint32_t count, Random& random) {
  const Mesh& mesh = solution.mesh;
  const Variation variation = variation_of(solution);
  const std::vector<double> draw = shares_of(variation.exposed_area, relative(variation));
  std::vector<CheckPoint> points;
  double weights = 0;
  for (const std::uint32_t e : drawn(draw, count, random)) {
    const Element& element = mesh.elements[e];
    const std::uint32_t p = mesh.patches[element.patch].polygon;
    const Polygon& polygon = solution.scene.polygons[p];
    const PolygonMesh& of = mesh.polygons[p];
    double s = random.unit(), t = random.unit();
    const bool quad = element.vertex[3] != 0xffffffffu;
    if (!quad && s + t > 1) s = 1 - s, t = 1 - t;
    std::array<double, 2> at{};
    for (std::size_t a = 0; a < 2; ++a) {
      const auto corner = [&](std::size_t k) { return double(mesh.lattice[element.vertex[k]][a]); };
      at[a] = corner(0) + s * (corner(1) - corner(0)) + t * (corner(quad ? 3 : 2) - corner(0));
      if (quad) at[a] += s * t * (corner(0) - corner(1) + corner(2) - corner(3));
    }
    const LatticeMap map(polygon, solution.frame, of.patches_u, of.patches_v);
    const double patch_edge = lattice_unit(0);
    Point point = mesh.receivers[element.vertex[0]];
    point.position = map.position(at[0], at[1]);
    const double weight = variation.exposed_area[e] / draw[e];
    weights += weight;
    const double u = at[0] / patch_edge / of.patches_u, v = at[1] / patch_edge / of.patches_v;
    points.push_back({point, locate(mesh, p, polygon.corners, u, v), p, u, v, weight});
  }
  for (CheckPoint& p : points) p.weight /= weights;
  return points;
}

double exposed_area_m2(const Solution& solution) {
  const std::vector<double> areas = variation_of(solution).exposed_area;
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

std::vector<double> density_of_points(const Solution& solution, std::uint32_t count) {
  const Variation variation = variation_of(solution);
  std::vector<double> density = shares_of(variation.exposed_area, relative(variation));
  const std::vector<double>& area = variation.exposed_area;
  const double all = std::accumulate(area.begin(), area.end(), 0.0),
               draws = std::accumulate(density.begin(), density.end(), 0.0);
  for (std::size_t e = 0; e < density.size(); ++e)
    density[e] = area[e] > 0 ? count * density[e] / draws / (area[e] / all) : 0;
  return density;
}

CheckVertices check_vertices(const Solution& solution, std::uint32_t count, Random& random) {
  const Mesh& mesh = solution.mesh;
  const std::vector<double> area = vertex_areas(mesh, solution.vertex_covered),
                            of_element = relative(variation_of(solution));
  std::vector<double> variation(area.size(), 0);
  for (std::size_t e = 0; e < of_element.size(); ++e)
    for (const std::uint32_t v : mesh.elements[e].vertex)
      if (v != 0xffffffffu) variation[v] = std::max(variation[v], of_element[e]);
  const std::vector<double> draw = shares_of(area, variation);
  CheckVertices result{drawn(draw, count, random), {}};
  double weights = 0;
  for (const std::uint32_t v : result.vertex)
    result.weight.push_back(area[v] / draw[v]), weights += result.weight.back();
  for (double& w : result.weight) w /= weights;
  return result;
}

}  // namespace clrad
