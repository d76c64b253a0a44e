#include "solve/surroundings.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

#include "output/display.hpp"
#include "solve/nodes.hpp"

namespace clrad {
namespace {

// What a patch whose vertices are all dark may have all the same, in shares of the mean irradiance: rays are to find it.
constexpr double dark_share = 0.02;

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

}  // namespace

void interpolate(Surroundings& s, Device& device, const Solution& solution, std::vector<double> irradiance,
                 std::vector<double> bend) {
  fill_covered(solution.mesh, solution.vertex_covered, irradiance, solution.bands);
  if (bend.empty())
    bend = edge_bends(solution.mesh, s.edges, solution.vertex_covered, irradiance, solution.bands);
  s.bend = RealArray(device, bend, "bends of irradiance");
  s.irradiance = RealArray(device, irradiance, "irradiance of vertices");
  s.vertex_values = std::move(irradiance), s.edge_values = std::move(bend);
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

}  // namespace clrad
