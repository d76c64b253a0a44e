#include <memory>

#include "output/displayed.hpp"
#include "render/render.hpp"

namespace clrad {
namespace {

constexpr const char* shade_kernels = "render/shade.cl";

// The quadtrees as kernels/shared/leaf.cl reads them, and what is interpolated in them.
struct RadiosityTables {
  Array<std::uint32_t> trees, patch_first, code, level, vertex, middle, edge;
  RealArray radiosity;  ///< [band][vertex], to draw [W/m^2]
  RealArray bend;       ///< [band][edge] [W/m^2]
  std::uint32_t edges;
};

RadiosityTables radiosity_tables(Device& device, const Solution& solution, bool ambient) {
  const Mesh& mesh = solution.mesh;
  std::vector<std::uint32_t> trees, patch_first, code, level, vertex, middle;
  for (std::size_t p = 0; p < mesh.polygons.size(); ++p) {
    const PolygonMesh& m = mesh.polygons[p];
    trees.insert(trees.end(), {m.first_patch, m.patches_u, m.patches_v, solution.scene.polygons[p].corners});
  }
  for (const Patch& patch : mesh.patches) patch_first.push_back(patch.first_element);
  patch_first.push_back(std::uint32_t(mesh.elements.size()));
  for (const Element& e : mesh.elements) {
    code.push_back(e.code);
    level.push_back(e.level);
    vertex.insert(vertex.end(), e.vertex.begin(), e.vertex.end());
    middle.insert(middle.end(), e.middle.begin(), e.middle.end());
  }
  const Displayed displayed(solution, ambient);
  std::vector<std::uint32_t> edge;
  for (const auto& of : displayed.edges.of_element) edge.insert(edge.end(), of.begin(), of.end());
  const auto array = [&](const std::vector<std::uint32_t>& values) {
    return Array<std::uint32_t>(device, values, "the picture's elements");
  };
  return {array(trees),
          array(patch_first),
          array(code),
          array(level),
          array(vertex),
          array(middle),
          array(edge),
          RealArray(device, displayed.radiosity, "the picture's radiosity"),
          RealArray(device, displayed.bend, "the picture's edges"),
          std::uint32_t(displayed.edge_count)};
}

}  // namespace

void find_seen(Device& device, const SurfaceTables& tables, const Rays& rays, Array<std::uint32_t>& seen) {
  device.run(shade_kernels, "find_seen", rays.count, rays.origins, rays.targets, seen, rays.count,
             tables.polygon_of, tables.polygons, tables.layer_start, tables.layers);
}

Shading radiosity_shading(Device& device, const SurfaceTables& tables, const Solution& solution,
                          bool ambient) {
  const auto own = std::make_shared<const RadiosityTables>(radiosity_tables(device, solution, ambient));
  const std::uint32_t vertices = solution.vertex_count(), bands = solution.bands;
  return {[&device, &tables, own, vertices, bands](const Rays& rays, const Array<std::uint32_t>& seen,
                                                   Array<float>& shown) {
    device.run(shade_kernels, "shade_rays", rays.count, rays.origins, rays.targets, seen, rays.count,
               tables.polygons, own->trees, own->patch_first, own->code, own->level, own->vertex, own->middle,
               own->edge, own->radiosity, vertices, own->bend, own->edges, bands, shown);
  }};
}

void add_to_pixels(Device& device, const Rays& rays, const Array<float>& shown, std::uint32_t samples,
                   std::uint32_t pixels, std::uint32_t bands, Array<float>& radiance) {
  // Rays from the camera have neither throughput nor starts; any buffer stands in for them.
  const RawArray& throughput = rays.from_camera ? static_cast<const RawArray&>(shown) : rays.throughput;
  const RawArray& start = rays.from_camera ? static_cast<const RawArray&>(shown) : rays.start;
  device.run(shade_kernels, "add_to_pixels", pixels, shown, std::uint32_t(rays.from_camera), throughput,
             start, samples, pixels, bands, radiance);
}

}  // namespace clrad
