#include <glm/geometric.hpp>

#include "render/render.hpp"

namespace clrad {
namespace {

constexpr std::size_t polygon_reals = 20;

// The table of one polygon, see kernels/render/shade.cl.
void describe(const Polygon& polygon, const Frame& frame, Precision precision, double* out) {
  glm::dvec3 c[4];
  for (std::uint32_t k = 0; k < polygon.corners; ++k) c[k] = frame.to_frame(polygon.corner[k]);
  const glm::dvec3 e1 = c[1] - c[0], e2 = c[polygon.corners - 1] - c[0];
  const glm::dvec3 cross = glm::cross(e1, e2);
  const double square = glm::dot(cross, cross);
  const glm::dvec3 dual1 = glm::cross(e2, cross) / square, dual2 = glm::cross(cross, e1) / square;
  const glm::dvec3 normal = glm::normalize(cross);
  for (int i = 0; i < 3; ++i) {
    const double hi = precision == Precision::float64 ? c[0][i] : double(float(c[0][i]));
    out[i] = hi;
    out[3 + i] = c[0][i] - hi;
    out[6 + i] = normal[i];
    out[9 + i] = dual1[i];
    out[12 + i] = dual2[i];
  }
  if (polygon.corners == 4) {
    const glm::dvec3 excess = c[2] - c[1] - c[3] + c[0];
    out[15] = glm::dot(excess, dual1);
    out[16] = glm::dot(excess, dual2);
  }
}

// Device buffers of nothing still need one element to be a kernel argument.
Array<std::uint32_t> on_device(Device& device, std::vector<std::uint32_t> values, std::string_view what) {
  if (values.empty()) values.push_back(0);
  return Array<std::uint32_t>(device, values, what);
}

}  // namespace

ShadeTables shade_tables(Device& device, std::span<const OccluderTriangle> triangles,
                         const Solution& solution, const glm::dvec3& eye, bool ambient) {
  const auto& scene = solution.scene;
  std::vector<std::uint32_t> polygon_of;
  for (const auto& t : triangles) polygon_of.push_back(t.polygon);
  std::vector<double> polygons(polygon_reals * scene.polygons.size(), 0.0);
  std::vector<std::uint32_t> grids;
  for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
    describe(scene.polygons[p], solution.frame, device.options().precision, &polygons[polygon_reals * p]);
    const PolygonMesh& m = solution.mesh.polygons[p];
    grids.insert(grids.end(), {m.first_vertex, m.cells_u, m.cells_v, scene.polygons[p].corners});
  }
  const Layers layers = visible_layers(triangles, scene.polygons.size(), eye);

  ShadeTables tables;
  tables.polygon_of = on_device(device, polygon_of, "the picture's triangles");
  tables.polygons = RealArray(device, polygons, "the picture's polygons");
  tables.grids = on_device(device, grids, "the picture's lattices");
  tables.layer_start = on_device(device, layers.start, "the picture's layers");
  tables.layers = on_device(device, layers.polygon, "the picture's layers");
  tables.radiosity = RealArray(device, display_radiosity(solution, ambient), "the picture's radiosity");
  tables.vertices = solution.vertex_count();
  tables.bands = solution.bands;
  return tables;
}

void shade_pixels(Device& device, const ShadeTables& tables, const PointArray& origins,
                  const PointArray& targets, const Array<std::uint32_t>& triangles, std::uint32_t samples,
                  std::uint32_t pixels, Array<float>& radiance) {
  device.run("render/shade.cl", "shade_pixels", pixels, origins, targets, triangles, samples, pixels,
             tables.polygon_of, tables.polygons, tables.grids, tables.layer_start, tables.layers,
             tables.radiosity, tables.vertices, tables.bands, radiance);
}

}  // namespace clrad
