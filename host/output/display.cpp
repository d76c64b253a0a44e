// What is drawn and what is averaged: covered vertices are filled in for the eye, and stay dark in area
// means.
#include <algorithm>

#include "clrad/solution.hpp"

namespace clrad {
namespace {

// Who stands in for a covered vertex: the uncovered corners of its elements, each as often as it is such a
// corner.
struct Fill {
  std::uint32_t vertex;
  std::vector<std::uint32_t> from;
};

// One ring of covered vertices that have an uncovered corner in one of their elements; `covered` is updated.
std::vector<Fill> next_ring(const Mesh& mesh, std::vector<std::uint8_t>& covered) {
  std::vector<std::uint32_t> slot(covered.size(), 0);
  std::vector<Fill> ring;
  for (const Element& element : mesh.elements) {
    const int corners = element.vertex[3] == 0xffffffffu ? 3 : 4;
    for (int a = 0; a < corners; ++a) {
      const std::uint32_t to = element.vertex[a];
      if (!covered[to]) continue;
      for (int b = 0; b < corners; ++b) {
        const std::uint32_t from = element.vertex[b];
        if (covered[from]) continue;
        if (slot[to] == 0) ring.push_back({to, {}}), slot[to] = std::uint32_t(ring.size());
        ring[slot[to] - 1].from.push_back(from);
      }
    }
  }
  for (const Fill& fill : ring) covered[fill.vertex] = 0;
  return ring;
}

enum class Irradiance { nowhere, on_textures, everywhere };

// Radiosity, but irradiance where that is asked for.
std::vector<double> displayed_values(const Solution& solution, bool ambient, Irradiance irradiance) {
  const std::uint32_t vertices = solution.vertex_count();
  std::vector<double> radiosity(std::size_t(solution.bands) * vertices, 0.0);
  for (std::uint32_t band = 0; band < solution.bands; ++band)
    for (std::uint32_t v = 0; v < vertices; ++v) {
      const std::uint32_t polygon = solution.mesh.receivers[v].surface;
      double& b = radiosity[std::size_t(band) * vertices + v];
      const double more = ambient && band < solution.ambient.size() ? solution.ambient[band] : 0;
      if (irradiance == Irradiance::everywhere ||
          (irradiance == Irradiance::on_textures && solution.material_of(polygon).texture != no_texture)) {
        b = solution.vertex_irradiance[std::size_t(band) * vertices + v] + more;
        continue;
      }
      b = solution.vertex_radiosity(band, v, polygon);
      if (more != 0) b += solution.vertex_reflectance(band, v, polygon) * more;
    }
  // Rings inwards, so that an element all of whose corners are covered, each by another block, is not black.
  std::vector<std::uint8_t> covered = solution.vertex_covered;
  if (std::none_of(covered.begin(), covered.end(), [](std::uint8_t c) { return c != 0; })) return radiosity;
  for (auto ring = next_ring(solution.mesh, covered); !ring.empty(); ring = next_ring(solution.mesh, covered))
    for (std::uint32_t band = 0; band < solution.bands; ++band) {
      double* const b = radiosity.data() + std::size_t(band) * vertices;
      for (const Fill& fill : ring) {
        double sum = 0;
        for (const std::uint32_t v : fill.from) sum += b[v];
        b[fill.vertex] = sum / double(fill.from.size());
      }
    }
  return radiosity;
}

}  // namespace

std::vector<double> display_radiosity(const Solution& solution, bool ambient) {
  return displayed_values(solution, ambient, Irradiance::nowhere);
}

std::vector<double> display_light(const Solution& solution, bool ambient) {
  return displayed_values(solution, ambient, Irradiance::on_textures);
}

std::vector<double> display_irradiance(const Solution& solution) {
  return displayed_values(solution, false, Irradiance::everywhere);
}

std::vector<PolygonMean> polygon_means(const Solution& solution) {
  const std::size_t patches = solution.mesh.patches.size();
  std::vector<PolygonMean> means;
  for (std::size_t p = 0; p < solution.scene.polygons.size(); ++p) {
    const PolygonMesh& mesh = solution.mesh.polygons[p];
    const Material& material = solution.material_of(std::uint32_t(p));
    PolygonMean mean;
    for (std::uint32_t i = 0; i < mesh.patches; ++i)
      mean.area_m2 += solution.mesh.patches[mesh.first_patch + i].area_m2;
    for (std::uint32_t band = 0; band < solution.bands; ++band) {
      double power = 0, reflected = 0;
      for (std::uint32_t i = 0; i < mesh.patches; ++i) {
        const std::size_t patch = mesh.first_patch + i;
        const double arriving =
            solution.mesh.patches[patch].area_m2 * solution.patch_irradiance[band * patches + patch];
        power += arriving;
        if (material.texture != no_texture)
          reflected += solution.patch_reflectance(band, std::uint32_t(patch)) * arriving;
      }
      const double irradiance = mean.area_m2 > 0 ? power / mean.area_m2 : 0;
      mean.irradiance.push_back(irradiance);
      mean.radiosity.push_back(material.emitted_exitance[band] +
                               (material.texture == no_texture ? material.reflectance[band] * irradiance
                                : mean.area_m2 > 0             ? reflected / mean.area_m2
                                                               : 0));
    }
    means.push_back(std::move(mean));
  }
  return means;
}

}  // namespace clrad
