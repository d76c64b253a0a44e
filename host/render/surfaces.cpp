// Tables of the polygons for kernels/shared/surface.cl.
#include <glm/geometric.hpp>

#include <algorithm>

#include "render/render.hpp"
#include "scene/backs.hpp"

namespace clrad {
namespace {

constexpr std::size_t polygon_reals = 20, axes_reals = 12;  // CLRAD_POLYGON_REALS, CLRAD_AXES_REALS

// v into hi (3 numbers) and what that leaves (3 more).
void split(const glm::dvec3& v, Precision precision, double* out) {
  for (int i = 0; i < 3; ++i) {
    out[i] = precision == Precision::float64 ? v[i] : double(float(v[i]));
    out[3 + i] = v[i] - out[i];
  }
}

struct Corners {
  glm::dvec3 c[4], e1, e2;
  Corners(const Polygon& polygon, const Frame& frame) {
    for (std::uint32_t k = 0; k < polygon.corners; ++k) c[k] = frame.to_frame(polygon.corner[k]);
    e1 = c[1] - c[0], e2 = c[polygon.corners - 1] - c[0];
  }
};

void describe(const Polygon& polygon, const Frame& frame, Precision precision, double* out) {
  const Corners corners(polygon, frame);
  const glm::dvec3 cross = glm::cross(corners.e1, corners.e2);
  const double square = glm::dot(cross, cross);
  const glm::dvec3 dual1 = glm::cross(corners.e2, cross) / square,
                   dual2 = glm::cross(cross, corners.e1) / square;
  const glm::dvec3 normal = glm::normalize(cross);
  split(corners.c[0], precision, out);
  for (int i = 0; i < 3; ++i) {
    out[6 + i] = normal[i];
    out[9 + i] = dual1[i];
    out[12 + i] = dual2[i];
  }
  if (polygon.corners == 4) {
    const glm::dvec3 excess = corners.c[2] - corners.c[1] - corners.c[3] + corners.c[0];
    out[15] = glm::dot(excess, dual1);
    out[16] = glm::dot(excess, dual2);
    out[17] = 1;
  }
}

// Device buffers of nothing still need one element to be a kernel argument.
Array<std::uint32_t> on_device(Device& device, std::vector<std::uint32_t> values, std::string_view what) {
  if (values.empty()) values.push_back(0);
  return Array<std::uint32_t>(device, values, what);
}

}  // namespace

SurfaceTables surface_tables(Device& device, std::span<const OccluderTriangle> triangles, const Scene& scene,
                             const Frame& frame) {
  std::vector<std::uint32_t> polygon_of;
  for (const auto& t : triangles) polygon_of.push_back(t.polygon);
  std::vector<double> polygons(polygon_reals * scene.polygons.size(), 0.0);
  for (std::size_t p = 0; p < scene.polygons.size(); ++p)
    describe(scene.polygons[p], frame, device.options().precision, &polygons[polygon_reals * p]);
  // Backs have no triangles of their own; they overlap what their fronts do, and these.
  std::vector<OccluderTriangle> both_sides;
  for (std::size_t p = 0; p < scene.polygons.size(); ++p)
    if (has_back(scene, p)) polygons[polygon_reals * p + 18] = 1;
  if (std::any_of(scene.polygons.begin(), scene.polygons.end(), [](const Polygon& p) { return p.back; }))
    for (const OccluderTriangle& t : triangles) {
      both_sides.push_back(t);
      if (!has_back(scene, t.polygon)) continue;
      both_sides.push_back(t);
      ++both_sides.back().polygon;
      std::swap(both_sides.back().corner[1], both_sides.back().corner[2]);
    }
  const Layers layers =
      overlapping_layers(both_sides.empty() ? triangles : both_sides, scene.polygons.size());

  SurfaceTables tables;
  tables.polygon_of = on_device(device, polygon_of, "the picture's triangles");
  tables.polygons = RealArray(device, polygons, "the picture's polygons");
  tables.layer_start = on_device(device, layers.start, "the picture's layers");
  tables.layers = on_device(device, layers.polygon, "the picture's layers");
  return tables;
}

PlaceTables place_tables(Device& device, std::span<const OccluderTriangle> triangles, const Scene& scene,
                         const Frame& frame) {
  std::vector<double> axes(axes_reals * scene.polygons.size());
  std::vector<std::uint32_t> planes(scene.polygons.size(), 0xffffffffu);
  for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
    const Corners corners(scene.polygons[p], frame);
    split(corners.e1, device.options().precision, &axes[axes_reals * p]);
    split(corners.e2, device.options().precision, &axes[axes_reals * p + 6]);
  }
  for (const auto& t : triangles) planes[t.polygon] = t.plane;
  for (std::size_t p = 0; p < scene.polygons.size(); ++p)
    if (scene.polygons[p].back) planes[p] = planes[p - 1];
  return {RealArray(device, axes, "axes of the picture's polygons"),
          on_device(device, planes, "planes of the picture's polygons")};
}

}  // namespace clrad
