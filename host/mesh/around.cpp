#include "mesh/around.hpp"

#include "mesh/vertex_finder.hpp"

namespace clrad {

std::vector<std::array<std::uint32_t, 4>> around_parents(const Mesh& mesh,
                                                         const std::vector<std::uint8_t>& covered) {
  const VertexFinder finder(mesh, covered);
  std::vector<std::array<std::uint32_t, 4>> around(mesh.vertex_count());
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto& parents = mesh.parents[v];
    around[v].fill(VertexFinder::none);
    if (parents[0] == VertexFinder::none) continue;
    const std::uint32_t polygon = mesh.receivers[v].surface;
    // The point from + along (to - from), in lattice coordinates.
    const auto on_line = [&](std::uint32_t from, std::uint32_t to, double along) {
      const auto &a = mesh.lattice[from], &b = mesh.lattice[to];
      return finder.at(polygon, a[0] + std::int64_t(along * (double(b[0]) - a[0])),
                       a[1] + std::int64_t(along * (double(b[1]) - a[1])));
    };
    if (parents[0] == parents[2])
      around[v] = {on_line(parents[0], parents[1], -1), on_line(parents[0], parents[1], 2),
                   on_line(parents[0], parents[1], -2), on_line(parents[0], parents[1], 3)};
    else
      for (std::uint32_t k = 0; k < 4; ++k) around[v][k] = on_line(parents[k], parents[(k + 1) % 4], 0.5);
  }
  return around;
}

}  // namespace clrad
