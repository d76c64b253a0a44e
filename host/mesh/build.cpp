#include "mesh/build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

constexpr double default_patches = 8, default_elements = 64;  // along the scene's longest side
// Radiosity is evaluated this share of an element's edge inside its polygon: on the very edge the contour
// formula is 0/0.
constexpr double inset = 1e-3;

// A lattice point of one polygon.
struct Cell {
  std::uint32_t i, j;
  friend Cell operator+(Cell a, Cell b) { return {a.i + b.i, a.j + b.j}; }
};
Cell middle(Cell a, Cell b) {
  return {(a.i + b.i) / 2, (a.j + b.j) / 2};
}

std::uint32_t pieces(double length, double longest) {
  // A length that is a multiple of the edge up to rounding does not get one piece more.
  return std::uint32_t(std::max(1.0, std::ceil(length / longest * (1 - 1e-9))));
}

std::uint32_t levels(double length, double longest) {
  std::uint32_t level = 0;
  while (length > longest * (1 + 1e-9)) length /= 2, ++level;
  return level;
}

// Everything about one polygon while it is cut up.
class PolygonCutter {
 public:
  PolygonCutter(const Scene& scene, const Frame& frame, std::uint32_t polygon, std::uint32_t plane,
                Mesh& mesh)
      : polygon_(scene.polygons[polygon]), frame_(frame), index_(polygon), plane_(plane), mesh_(mesh) {
    // Cut in the frame: a scene far from the origin is cut to the same bits as one at the origin.
    for (std::uint32_t k = 0; k < polygon_.corners; ++k) corner_[k] = frame.to_frame(polygon_.corner[k]);
  }

  void cut() {
    const auto& c = polygon_.corner;
    const bool quad = polygon_.corners == 4;
    const double length_u =
        quad ? std::max(glm::length(c[1] - c[0]), glm::length(c[2] - c[3])) : longest_edge();
    const double length_v = quad ? std::max(glm::length(c[3] - c[0]), glm::length(c[2] - c[1])) : length_u;
    const std::uint32_t patches_u = pieces(length_u, mesh_.patch_edge_m),
                        patches_v = quad ? pieces(length_v, mesh_.patch_edge_m) : patches_u;
    const std::uint32_t level =
        levels(std::max(length_u / patches_u, length_v / patches_v), mesh_.element_edge_m);
    step_ = 1u << std::min(level, 20u);
    const double vertices = (double(patches_u) * step_ + 1) * (double(patches_v) * step_ + 1);
    if (double(mesh_.receivers.size()) + vertices > double(1u << 31))
      throw UsageError(
          fmt::format("the mesh would have more than {} vertices; use a larger --element-edge", 1u << 31));

    mesh_of_.cells_u = patches_u * step_;
    mesh_of_.cells_v = patches_v * step_;
    mesh_of_.first_vertex = mesh_.vertex_count();
    mesh_of_.first_patch = std::uint32_t(mesh_.patches.size());
    mesh_of_.first_element = std::uint32_t(mesh_.elements.size());
    add_vertices();
    if (quad) {
      for (std::uint32_t v = 0; v < patches_v; ++v)
        for (std::uint32_t u = 0; u < patches_u; ++u) {
          const Cell at{u * step_, v * step_};
          add_patch({at, at + Cell{step_, 0}, at + Cell{step_, step_}, at + Cell{0, step_}});
        }
    } else {
      for (std::uint32_t v = 0; v < patches_v; ++v)
        for (std::uint32_t u = 0; u + v < patches_u; ++u) {
          const Cell at{u * step_, v * step_};
          add_patch({at, at + Cell{step_, 0}, at + Cell{0, step_}});
          if (u + v + 1 < patches_u)
            add_patch({at + Cell{step_, step_}, at + Cell{0, step_}, at + Cell{step_, 0}});
        }
    }
    mesh_of_.vertices = mesh_.vertex_count() - mesh_of_.first_vertex;
    mesh_of_.patches = std::uint32_t(mesh_.patches.size()) - mesh_of_.first_patch;
    mesh_of_.elements = std::uint32_t(mesh_.elements.size()) - mesh_of_.first_element;
    mesh_.polygons.push_back(mesh_of_);
  }

 private:
  double longest_edge() const {
    double longest = 0;
    for (std::uint32_t k = 0; k < polygon_.corners; ++k)
      longest =
          std::max(longest, glm::length(polygon_.corner[(k + 1) % polygon_.corners] - polygon_.corner[k]));
    return longest;
  }

  glm::dvec3 position(double i, double j) const {
    const auto& c = corner_;
    const double u = i / mesh_of_.cells_u, v = j / mesh_of_.cells_v;
    if (polygon_.corners == 3) return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
    return (1 - u) * (1 - v) * c[0] + u * (1 - v) * c[1] + u * v * c[2] + (1 - u) * v * c[3];
  }
  glm::dvec3 position(Cell c) const { return position(c.i, c.j); }

  std::uint32_t vertex(Cell c) const {
    const std::uint32_t n = mesh_of_.cells_u;
    if (polygon_.corners == 4) return mesh_of_.first_vertex + c.j * (n + 1) + c.i;
    return mesh_of_.first_vertex + c.j * (n + 1) - c.j * (c.j - 1) / 2 + c.i;
  }

  void add_vertices() {
    const glm::dvec3 normal = polygon_.normal();
    for (std::uint32_t j = 0; j <= mesh_of_.cells_v; ++j)
      for (std::uint32_t i = 0; i <= (polygon_.corners == 4 ? mesh_of_.cells_u : mesh_of_.cells_u - j); ++i) {
        mesh_.position_m.push_back(frame_.from_frame(position(i, j)));
        mesh_.receivers.push_back({inside(i, j), normal, plane_, index_});
      }
  }

  // The lattice point (i, j), moved off the polygon's boundary by the inset.
  glm::dvec3 inside(std::uint32_t i, std::uint32_t j) const {
    const double n = mesh_of_.cells_u, m = mesh_of_.cells_v;
    if (polygon_.corners == 4)
      return position(std::clamp(double(i), inset, n - inset), std::clamp(double(j), inset, m - inset));
    // Barycentric coordinates in cells; their sum stays n, so what is added to one comes off the largest.
    double b[3] = {n - i - j, double(i), double(j)};
    double added = 0;
    for (double& x : b)
      if (x < inset) added += inset - x, x = inset;
    *std::max_element(b, b + 3) -= added;
    return position(b[1], b[2]);
  }

  void add_patch(std::vector<Cell> corner) {
    Patch patch;
    patch.polygon = index_;
    patch.corners = std::uint32_t(corner.size());
    patch.first_element = std::uint32_t(mesh_.elements.size());
    for (std::size_t k = 0; k < corner.size(); ++k) patch.corner[k] = position(corner[k]);
    add_elements(corner, step_);
    patch.elements = std::uint32_t(mesh_.elements.size()) - patch.first_element;
    for (std::uint32_t e = 0; e < patch.elements; ++e)
      patch.area_m2 += mesh_.elements[patch.first_element + e].area_m2;
    mesh_.patches.push_back(patch);
  }

  // The quadtree below one node, depth first: four children, the corners' own in order, a triangle's middle
  // one last.
  void add_elements(const std::vector<Cell>& c, std::uint32_t edge) {
    if (edge == 1) return add_element(c);
    const std::uint32_t half = edge / 2;
    if (c.size() == 4) {
      const Cell m01 = middle(c[0], c[1]), m12 = middle(c[1], c[2]), m23 = middle(c[2], c[3]),
                 m30 = middle(c[3], c[0]);
      const Cell centre = middle(m30, m12);
      add_elements({c[0], m01, centre, m30}, half);
      add_elements({m01, c[1], m12, centre}, half);
      add_elements({centre, m12, c[2], m23}, half);
      add_elements({m30, centre, m23, c[3]}, half);
    } else {
      const Cell m01 = middle(c[0], c[1]), m12 = middle(c[1], c[2]), m20 = middle(c[2], c[0]);
      add_elements({c[0], m01, m20}, half);
      add_elements({m01, c[1], m12}, half);
      add_elements({m20, m12, c[2]}, half);
      add_elements({m12, m20, m01}, half);
    }
  }

  void add_element(const std::vector<Cell>& c) {
    Element e;
    e.patch = std::uint32_t(mesh_.patches.size());
    e.vertex.fill(0xffffffffu);
    glm::dvec3 p[4];
    const double metres = frame_.metres();
    for (std::size_t k = 0; k < c.size(); ++k) e.vertex[k] = vertex(c[k]), p[k] = position(c[k]) * metres;
    if (c.size() == 3) {
      e.area_m2 = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
      e.weight = {1.0 / 3, 1.0 / 3, 1.0 / 3, 0};
    } else {
      // A planar quad's bilinear map has a Jacobian that is linear over it: J = sum of N_k J_k with J_k twice
      // the area of the corner triangle at k, and the integral of N_k N_l is 1/9 (same), 1/18 (neighbours) or
      // 1/36 (opposite).
      double jacobian[4];
      for (int k = 0; k < 4; ++k)
        jacobian[k] = glm::length(glm::cross(p[(k + 1) % 4] - p[k], p[(k + 3) % 4] - p[k]));
      e.area_m2 = (jacobian[0] + jacobian[1] + jacobian[2] + jacobian[3]) / 4;
      for (int k = 0; k < 4; ++k)
        e.weight[k] = (4 * jacobian[k] + 2 * jacobian[(k + 1) % 4] + jacobian[(k + 2) % 4] +
                       2 * jacobian[(k + 3) % 4]) /
                      (36 * e.area_m2);
    }
    mesh_.elements.push_back(e);
  }

  const Polygon& polygon_;
  const Frame& frame_;
  std::array<glm::dvec3, 4> corner_;  // frame
  std::uint32_t index_, plane_;
  Mesh& mesh_;
  PolygonMesh mesh_of_;
  std::uint32_t step_ = 1;  // elements along a patch's edge
};

}  // namespace

Mesh build_mesh(const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes,
                const MeshOptions& options) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const auto& polygon : scene.polygons)
    for (std::uint32_t k = 0; k < polygon.corners; ++k)
      low = glm::min(low, polygon.corner[k]), high = glm::max(high, polygon.corner[k]);
  const glm::dvec3 size = high - low;
  const double extent = std::max({size.x, size.y, size.z});

  Mesh mesh;
  mesh.patch_edge_m = options.patch_edge_m > 0 ? options.patch_edge_m : extent / default_patches;
  mesh.element_edge_m = options.element_edge_m > 0 ? options.element_edge_m
                                                   : std::min(extent / default_elements, mesh.patch_edge_m);
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p)
    PolygonCutter(scene, frame, p, planes[p], mesh).cut();
  return mesh;
}

std::vector<OccluderTriangle> occluder_triangles(const Scene& scene, const Frame& frame,
                                                 std::span<const std::uint32_t> planes) {
  std::vector<OccluderTriangle> triangles;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    glm::dvec3 c[4];
    for (std::uint32_t k = 0; k < polygon.corners; ++k) c[k] = frame.to_frame(polygon.corner[k]);
    for (std::uint32_t k = 2; k < polygon.corners; ++k)
      triangles.push_back({{c[0], c[k - 1], c[k]}, planes[p], p});
  }
  return triangles;
}

}  // namespace clrad
