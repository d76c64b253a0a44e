#include "solve/nodes.hpp"

#include <algorithm>

#include "mesh/average.hpp"
#include "solve/covered.hpp"

namespace clrad {
namespace {

void add_patch(PatchNodes& nodes, const Patch& patch, const glm::dvec3& normal, double area,
               std::uint32_t plane) {
  Shooter shooter;
  shooter.corners = patch.corners;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const glm::dvec3& c = patch.corner[std::min(k, patch.corners - 1)];
    if (k < patch.corners) shooter.corner[k] = c;
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

PatchNodes patch_nodes(const Solution& solution) {
  PatchNodes nodes;
  const Mesh& mesh = solution.mesh;
  const double unit = solution.frame.metres();
  for (const Patch& patch : mesh.patches)
    add_patch(nodes, patch, solution.scene.polygons[patch.polygon].normal(), patch.area_m2 / (unit * unit),
              mesh.receivers[mesh.polygons[patch.polygon].first_vertex].plane);
  return nodes;
}

}  // namespace clrad
