#include "mesh/build.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>

#include "clrad/error.hpp"
#include "mesh/lattice.hpp"
#include "scene/extent.hpp"

namespace clrad {
namespace {

constexpr double default_patches = 8, default_elements = 64;  // along the scene's longest side

// A lattice point of one polygon.
struct Cell {
  std::uint32_t i, j;
  friend Cell operator+(Cell a, Cell b) { return {a.i + b.i, a.j + b.j}; }
};
Cell middle(Cell a, Cell b) {
  return {(a.i + b.i) / 2, (a.j + b.j) / 2};
}

std::uint32_t pieces(double length, double longest) {
  constexpr double most = 1u << 31;  // refused further on
  // A length that is a multiple of the edge up to rounding does not get one piece more.
  return std::uint32_t(std::clamp(std::ceil(length / longest * (1 - 1e-9)), 1.0, most));
}

std::uint32_t levels(double length, double longest) {
  std::uint32_t level = 0;
  while (length > longest * (1 + 1e-9)) length /= 2, ++level;
  return level;
}

// How a polygon will be cut.
struct Plan {
  std::uint32_t patches_u, patches_v;
  std::uint32_t level;  // subdivisions of every patch
};

Plan plan_of(const Polygon& polygon, const Mesh& mesh) {
  const auto& c = polygon.corner;
  const bool quad = polygon.corners == 4;
  double length_u = std::max(glm::length(c[1] - c[0]), glm::length(c[2] - c[quad ? 3 : 1])), length_v = 0;
  if (!quad) length_u = std::max(length_u, glm::length(c[0] - c[2]));
  length_v = quad ? std::max(glm::length(c[3] - c[0]), glm::length(c[2] - c[1])) : length_u;
  Plan plan{};
  plan.patches_u = pieces(length_u, mesh.patch_edge_m);
  plan.patches_v = quad ? pieces(length_v, mesh.patch_edge_m) : plan.patches_u;
  const double longest = std::max(length_u / plan.patches_u, length_v / plan.patches_v);
  plan.level = std::min(levels(longest, mesh.element_edge_m), lattice_depth);
  return plan;
}

// A mesh with nothing in it but the edges that its pieces will have.
Mesh empty_mesh(const Scene& scene, const MeshOptions& options) {
  const double extent = extent_m(scene);
  Mesh mesh;
  mesh.patch_edge_m = options.patch_edge_m > 0 ? options.patch_edge_m : extent / default_patches;
  mesh.element_edge_m = options.element_edge_m > 0 ? options.element_edge_m
                                                   : std::min(extent / default_elements, mesh.patch_edge_m);
  return mesh;
}

MeshCounts counts_of(const Scene& scene, const Mesh& mesh) {
  MeshCounts counts;
  for (const Polygon& polygon : scene.polygons) {
    const Plan plan = plan_of(polygon, mesh);
    if (std::max(plan.patches_u, plan.patches_v) >= 1u << (32 - lattice_depth))
      throw UsageError(
          fmt::format("a polygon would be cut into more than {} patches along one side; use a "
                      "larger --patch-edge",
                      1u << (32 - lattice_depth)));
    const double step = double(1u << plan.level);
    // A triangle is cut into as many patches as a quad would be: n upright or turned ones in n^2.
    const double cells_u = plan.patches_u * step, cells_v = plan.patches_v * step;
    MeshCounts::OfPolygon of;
    of.patches = plan.patches_u * double(plan.patches_v);
    of.elements = of.patches * step * step;
    of.vertices = polygon.corners == 4 ? (cells_u + 1) * (cells_v + 1) : 0.5 * (cells_u + 1) * (cells_u + 2);
    counts.polygons.push_back(of);
    counts.patches += of.patches, counts.elements += of.elements, counts.vertices += of.vertices;
    counts.edges += of.vertices + of.elements - 1;  // Euler's formula for a disk
  }
  counts.host_bytes = counts.patches * sizeof(Patch) + counts.elements * sizeof(Element) +
                      counts.vertices * (sizeof(Point) + sizeof(glm::dvec3) + 6 * sizeof(std::uint32_t));
  return counts;
}

// Refuses what would have more vertices than can be numbered, or more bytes than the machine.
void check_size(const Scene& scene, const Mesh& mesh) {
  const MeshCounts counts = counts_of(scene, mesh);
  if (counts.vertices > double(1u << 31))
    throw UsageError(
        fmt::format("the mesh would have more than {} vertices; use a larger --element-edge", 1u << 31));
  const double machine = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGE_SIZE));
  if (counts.host_bytes > machine / 2)
    throw MemoryError(
        fmt::format("the mesh would take {:.1f} GiB, more than half of this machine's {:.1f} GiB; use larger "
                    "--patch-edge and --element-edge",
                    counts.host_bytes / 0x1p30, machine / 0x1p30));
}

// Everything about one polygon while it is cut up.
class PolygonCutter {
 public:
  PolygonCutter(const Scene& scene, const Frame& frame, std::uint32_t polygon, std::uint32_t plane,
                Mesh& mesh)
      : polygon_(scene.polygons[polygon]), frame_(frame), index_(polygon), plane_(plane), mesh_(mesh) {}

  void cut() {
    const bool quad = polygon_.corners == 4;
    const auto [patches_u, patches_v, level] = plan_of(polygon_, mesh_);
    level_ = level;
    mesh_of_.patches_u = patches_u, mesh_of_.patches_v = patches_v;
    mesh_of_.cells_u = patches_u << level_;
    mesh_of_.cells_v = patches_v << level_;
    mesh_of_.first_vertex = mesh_.vertex_count();
    mesh_of_.first_patch = std::uint32_t(mesh_.patches.size());
    mesh_of_.first_element = std::uint32_t(mesh_.elements.size());
    map_ = std::make_unique<LatticeMap>(polygon_, frame_, patches_u, patches_v);
    add_vertices();
    constexpr std::uint32_t edge = 1u << lattice_depth;
    for (std::uint32_t v = 0; v < patches_v; ++v)
      for (std::uint32_t u = 0; u < (quad ? patches_u : patches_u - v); ++u) {
        const Cell at{u * edge, v * edge};
        if (quad) {
          add_patch({at, at + Cell{edge, 0}, at + Cell{edge, edge}, at + Cell{0, edge}});
          continue;
        }
        add_patch({at, at + Cell{edge, 0}, at + Cell{0, edge}});
        if (u + v + 1 < patches_u) add_patch({at + Cell{edge, edge}, at + Cell{0, edge}, at + Cell{edge, 0}});
      }
    mesh_of_.vertices = mesh_.vertex_count() - mesh_of_.first_vertex;
    mesh_of_.patches = std::uint32_t(mesh_.patches.size()) - mesh_of_.first_patch;
    mesh_of_.elements = std::uint32_t(mesh_.elements.size()) - mesh_of_.first_element;
    mesh_.polygons.push_back(mesh_of_);
  }

 private:
  std::uint32_t vertex(Cell c) const {
    const std::uint32_t n = mesh_of_.cells_u, unit = lattice_unit(level_), i = c.i / unit, j = c.j / unit;
    if (polygon_.corners == 4) return mesh_of_.first_vertex + j * (n + 1) + i;
    return mesh_of_.first_vertex + j * (n + 1) - j * (j - 1) / 2 + i;
  }

  // Half-way between which vertices (i, j) lies, by the lowest digit that its coordinates have.
  std::array<std::uint32_t, 4> parents(Cell at) const {
    const std::uint32_t step = (at.i | at.j) & -(at.i | at.j);
    if (step == 0 || step >= lattice_unit(0)) return {0xffffffffu, 0xffffffffu, 0xffffffffu, 0xffffffffu};
    const std::uint32_t i = at.i & step, j = at.j & step;
    if (i && j) {
      const std::uint32_t right = vertex({at.i + i, at.j - j}), left = vertex({at.i - i, at.j + j});
      // A triangle's third edges run from right to left.
      if (polygon_.corners == 3) return {right, left, right, left};
      return {vertex({at.i - i, at.j - j}), right, vertex({at.i + i, at.j + j}), left};
    }
    const std::uint32_t a = vertex({at.i - i, at.j - j}), b = vertex({at.i + i, at.j + j});
    return {a, b, a, b};
  }

  void add_vertices() {
    const glm::dvec3 normal = polygon_.normal();
    const std::uint32_t unit = lattice_unit(level_);
    for (std::uint32_t b = 0; b <= mesh_of_.cells_v; ++b)
      for (std::uint32_t a = 0; a <= (polygon_.corners == 4 ? mesh_of_.cells_u : mesh_of_.cells_u - b); ++a) {
        const std::uint32_t i = a * unit, j = b * unit;
        mesh_.lattice.push_back({i, j});
        mesh_.parents.push_back(parents({i, j}));
        mesh_.position_m.push_back(frame_.from_frame(map_->position(i, j)));
        mesh_.receivers.push_back({map_->inside(i, j, unit), normal, plane_, index_});
      }
  }

  void add_patch(const std::vector<Cell>& corner) {
    Patch patch;
    patch.polygon = index_;
    patch.corners = std::uint32_t(corner.size());
    patch.first_element = std::uint32_t(mesh_.elements.size());
    for (std::size_t k = 0; k < corner.size(); ++k)
      patch.corner[k] = map_->position(corner[k].i, corner[k].j);
    add_elements(corner, 0, 0);
    patch.elements = std::uint32_t(mesh_.elements.size()) - patch.first_element;
    for (std::uint32_t e = 0; e < patch.elements; ++e)
      patch.area_m2 += mesh_.elements[patch.first_element + e].area_m2;
    mesh_.patches.push_back(patch);
  }

  // The quadtree below one node, depth first.
  void add_elements(const std::vector<Cell>& c, std::uint32_t level, std::uint32_t code) {
    if (level == level_) return add_element(c, code);
    const auto child = [&](std::uint32_t k, const std::vector<Cell>& corner) {
      add_elements(corner, level + 1, code | k << 2 * (lattice_depth - 1 - level));
    };
    if (c.size() == 4) {
      const Cell m01 = middle(c[0], c[1]), m12 = middle(c[1], c[2]), m23 = middle(c[2], c[3]),
                 m30 = middle(c[3], c[0]);
      const Cell centre = middle(m30, m12);
      child(0, {c[0], m01, centre, m30});
      child(1, {m01, c[1], m12, centre});
      child(2, {centre, m12, c[2], m23});
      child(3, {m30, centre, m23, c[3]});
    } else {
      const Cell m01 = middle(c[0], c[1]), m12 = middle(c[1], c[2]), m20 = middle(c[2], c[0]);
      child(0, {c[0], m01, m20});
      child(1, {m01, c[1], m12});
      child(2, {m20, m12, c[2]});
      child(3, {m12, m20, m01});
    }
  }

  void add_element(const std::vector<Cell>& c, std::uint32_t code) {
    Element e;
    e.patch = std::uint32_t(mesh_.patches.size());
    e.level = level_;
    e.code = code;
    e.vertex.fill(0xffffffffu);
    glm::dvec3 p[4];
    for (std::size_t k = 0; k < c.size(); ++k)
      e.vertex[k] = vertex(c[k]), p[k] = map_->position(c[k].i, c[k].j);
    measure_element(e, p, std::uint32_t(c.size()), frame_.metres());
    mesh_.elements.push_back(e);
  }

  const Polygon& polygon_;
  const Frame& frame_;
  std::unique_ptr<LatticeMap> map_;
  std::uint32_t index_, plane_;
  Mesh& mesh_;
  PolygonMesh mesh_of_;
  std::uint32_t level_ = 0;  // subdivisions of every patch
};

}  // namespace

MeshCounts count_mesh(const Scene& scene, const MeshOptions& options) {
  return counts_of(scene, empty_mesh(scene, options));
}

Mesh build_mesh(const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes,
                const MeshOptions& options) {
  Mesh mesh = empty_mesh(scene, options);
  check_size(scene, mesh);
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p)
    PolygonCutter(scene, frame, p, planes[p], mesh).cut();
  return mesh;
}

std::vector<OccluderTriangle> occluder_triangles(const Scene& scene, const Frame& frame,
                                                 std::span<const std::uint32_t> planes) {
  std::vector<OccluderTriangle> triangles;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    if (polygon.back) continue;
    glm::dvec3 c[4];
    for (std::uint32_t k = 0; k < polygon.corners; ++k) c[k] = frame.to_frame(polygon.corner[k]);
    for (std::uint32_t k = 2; k < polygon.corners; ++k)
      triangles.push_back({{c[0], c[k - 1], c[k]}, planes[p], p});
  }
  return triangles;
}

}  // namespace clrad
