#include "solve/nodes.hpp"

#include <algorithm>

#include "mesh/average.hpp"
#include "solve/covered.hpp"

namespace clrad {
namespace {

std::uint32_t plane_of(const Mesh& mesh, std::uint32_t polygon) {
  return mesh.receivers[mesh.polygons[polygon].first_vertex].plane;
}

void add_node(Nodes& nodes, std::uint32_t corners, const glm::dvec3* corner, const glm::dvec3& normal,
              double area, std::uint32_t plane) {
  Shooter shooter;
  shooter.corners = corners;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const glm::dvec3& c = corner[std::min(k, corners - 1)];
    if (k < corners) shooter.corner[k] = c;
    nodes.corners.push_back({c, normal, plane, 0xffffffffu});
  }
  shooter.normal = normal;
  shooter.area = area;
  shooter.plane = plane;
  const auto record = shooter_record(shooter);
  nodes.shooters.insert(nodes.shooters.end(), record.begin(), record.end());
}

}  // namespace

std::vector<double> node_radiosity(const Solution& solution) {
  const Mesh& mesh = solution.mesh;
  const std::size_t patches = mesh.patches.size(), count = patches + mesh.elements.size();
  std::vector<double> radiosity(count * solution.bands);
  const std::vector<double> exposed = exposed_shares(mesh, solution.vertex_covered);
  for (std::size_t p = 0; p < patches; ++p) {
    const Material& m = solution.material_of(mesh.patches[p].polygon);
    for (std::uint32_t b = 0; b < solution.bands; ++b)
      radiosity[b * count + p] =
          m.emitted_exitance[b] +
          (exposed[p] > 0 ? solution.patch_reflectance(b, std::uint32_t(p)) / exposed[p] : 0) *
              solution.patch_irradiance[b * patches + p];
  }
  std::vector<double> of_vertex(solution.vertex_count());
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    // On a texture the element's own reflectance counts, which differs from those around its corners.
    const auto textured = [&](std::uint32_t polygon) {
      return !solution.textured.element.empty() && solution.material_of(polygon).texture != no_texture;
    };
    for (std::uint32_t v = 0; v < of_vertex.size(); ++v) {
      const std::uint32_t polygon = mesh.receivers[v].surface;
      of_vertex[v] = textured(polygon) ? solution.vertex_irradiance[std::size_t(b) * of_vertex.size() + v]
                                       : solution.vertex_radiosity(b, v, polygon);
    }
    auto averages = element_averages(mesh, solution.vertex_covered, of_vertex);
    for (std::size_t e = 0; e < averages.size() && !solution.textured.element.empty(); ++e) {
      const std::uint32_t polygon = mesh.patches[mesh.elements[e].patch].polygon;
      if (textured(polygon))
        averages[e] = solution.material_of(polygon).emitted_exitance[b] +
                      solution.textured.element[b * averages.size() + e] * averages[e];
    }
    std::copy(averages.begin(), averages.end(), radiosity.begin() + std::ptrdiff_t(b * count + patches));
  }
  return radiosity;
}

Nodes make_nodes(const Solution& solution) {
  Nodes nodes;
  const Mesh& mesh = solution.mesh;
  const std::size_t patches = mesh.patches.size(), count = patches + mesh.elements.size();
  const double unit = solution.frame.metres();
  nodes.brightness.resize(count);
  for (const Patch& patch : mesh.patches) {
    nodes.first_element.push_back(patch.first_element);
    add_node(nodes, patch.corners, patch.corner.data(), solution.scene.polygons[patch.polygon].normal(),
             patch.area_m2 / (unit * unit), plane_of(mesh, patch.polygon));
  }
  nodes.first_element.push_back(std::uint32_t(mesh.elements.size()));
  for (const Element& element : mesh.elements) {
    const std::uint32_t polygon = mesh.patches[element.patch].polygon;
    const std::uint32_t corners = element.vertex[3] == 0xffffffffu ? 3 : 4;
    glm::dvec3 corner[4];
    for (std::uint32_t k = 0; k < corners; ++k)
      corner[k] = solution.frame.to_frame(mesh.position_m[element.vertex[k]]);
    add_node(nodes, corners, corner, solution.scene.polygons[polygon].normal(),
             element.area_m2 / (unit * unit), plane_of(mesh, polygon));
  }
  nodes.radiosity = node_radiosity(solution);
  for (std::size_t i = 0; i < count; ++i)
    for (std::uint32_t b = 0; b < solution.bands; ++b) nodes.brightness[i] += nodes.radiosity[b * count + i];
  return nodes;
}

}  // namespace clrad
