// Regular pre-subdivision: scene -> patches, elements, vertices, and the occluders of the same polygons.
#pragma once
#include <span>
#include <vector>

#include "clrad/mesh.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Pieces of a whole mesh.
struct MeshSize {
  double patches = 0, elements = 0, vertices = 0, edges = 0;  ///< edges of elements
};

/// How many pieces build_mesh() will make, without making them. Of the polygons in file order, and of all.
struct MeshCounts : MeshSize {
  struct OfPolygon {
    double patches = 0, elements = 0, vertices = 0;
  };
  std::vector<OfPolygon> polygons;
  double host_bytes = 0;
};
MeshCounts count_mesh(const Scene& scene, const MeshOptions& options);

/// Cuts every polygon into patches no longer than patch_edge_m and each patch into a full quadtree of
/// elements no longer than element_edge_m. `planes`: plane id per polygon. Throws UsageError when the mesh
/// would pass 2^31 vertices, and MemoryError, before it takes any, when it would not fit into half of the machine's memory.
Mesh build_mesh(const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes,
                const MeshOptions& options);

/// The original polygons as triangles (quads give two): visibility never sees the mesh.
std::vector<OccluderTriangle> occluder_triangles(const Scene& scene, const Frame& frame,
                                                 std::span<const std::uint32_t> planes);

}  // namespace clrad
