#include "mesh/vertex_finder.hpp"

#include <algorithm>

namespace clrad {

VertexFinder::VertexFinder(const Mesh& mesh, const std::vector<std::uint8_t>& covered)
    : mesh_(mesh), covered_(covered) {
  std::uint32_t regular = 0;
  for (const PolygonMesh& p : mesh.polygons) regular = std::max(regular, p.first_vertex + p.vertices);
  later_.reserve(mesh.vertex_count() - regular);
  for (std::uint32_t v = regular; v < mesh.vertex_count(); ++v)
    later_.emplace(Place{mesh.receivers[v].surface, mesh.lattice[v][0], mesh.lattice[v][1]}, v);
}

std::uint32_t VertexFinder::any_at(std::uint32_t polygon, std::int64_t i, std::int64_t j) const {
  const PolygonMesh& of = mesh_.polygons[polygon];
  const std::int64_t size_u = std::int64_t(of.patches_u) << lattice_depth, size_v = std::int64_t(of.patches_v)
                                                                                    << lattice_depth;
  if (i < 0 || j < 0 || i > size_u || j > size_v) return none;
  const std::int64_t unit = of.cells_u > 0 ? size_u / of.cells_u : 0;
  if (unit == 0) return none;
  if (i % unit == 0 && j % unit == 0) {
    const auto column = std::uint32_t(i / unit), row = std::uint32_t(j / unit), n = of.cells_u;
    if (column > n || row > of.cells_v) return none;
    const bool quad = of.vertices == (of.cells_u + 1) * (of.cells_v + 1);
    if (quad) return of.first_vertex + row * (n + 1) + column;
    return column + row > n ? none : of.first_vertex + row * (n + 1) - row * (row - 1) / 2 + column;
  }
  const auto found = later_.find({polygon, std::uint32_t(i), std::uint32_t(j)});
  return found == later_.end() ? none : found->second;
}

}  // namespace clrad
