#include <memory>

#include "render/render.hpp"

namespace clrad {
namespace {

constexpr const char* file = "render/shade.cl";

struct RadiosityTables {
  Array<std::uint32_t> grids;  ///< 4 a polygon: first vertex, cells_u, cells_v, corners
  RealArray radiosity;         ///< [band][vertex], to draw [W/m^2]
};

RadiosityTables radiosity_tables(Device& device, const Solution& solution) {
  std::vector<std::uint32_t> grids;
  for (std::size_t p = 0; p < solution.scene.polygons.size(); ++p) {
    const PolygonMesh& m = solution.mesh.polygons[p];
    grids.insert(grids.end(), {m.first_vertex, m.cells_u, m.cells_v, solution.scene.polygons[p].corners});
  }
  return {Array<std::uint32_t>(device, grids, "the picture's lattices"),
          RealArray(device, display_radiosity(solution), "the picture's radiosity")};
}

}  // namespace

void find_seen(Device& device, const SurfaceTables& tables, const Rays& rays, Array<std::uint32_t>& seen) {
  device.run(file, "find_seen", rays.count, rays.origins, rays.targets, seen, rays.count, tables.polygon_of,
             tables.polygons, tables.layer_start, tables.layers);
}

Shading radiosity_shading(Device& device, const SurfaceTables& tables, const Solution& solution) {
  const auto own = std::make_shared<const RadiosityTables>(radiosity_tables(device, solution));
  const std::uint32_t vertices = solution.vertex_count(), bands = solution.bands;
  return {[&device, &tables, own, vertices, bands](const Rays& rays, const Array<std::uint32_t>& seen,
                                                   Array<float>& shown) {
    device.run(file, "shade_rays", rays.count, rays.origins, rays.targets, seen, rays.count, tables.polygons,
               own->grids, own->radiosity, vertices, bands, shown);
  }};
}

void add_to_pixels(Device& device, const Rays& rays, const Array<float>& shown, std::uint32_t samples,
                   std::uint32_t pixels, std::uint32_t bands, Array<float>& radiance) {
  // Rays from the camera have neither throughput nor starts; any buffer stands in for them.
  const RawArray& throughput = rays.from_camera ? static_cast<const RawArray&>(shown) : rays.throughput;
  const RawArray& start = rays.from_camera ? static_cast<const RawArray&>(shown) : rays.start;
  device.run(file, "add_to_pixels", pixels, shown, std::uint32_t(rays.from_camera), throughput, start,
             samples, pixels, bands, radiance);
}

}  // namespace clrad
