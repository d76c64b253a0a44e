/// The mesh: input polygons cut into patches that shoot, each patch a quadtree of elements that receive, and
/// the vertices where irradiance is evaluated (section 1.4 of Drucker & Schroeder). All positions marked
/// "frame" are in the scene's frame, which solution.hpp defines.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "clrad/scene.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

struct MeshOptions {
  double patch_edge_m = 0;    ///< longest edge of a patch [m]; 0: the scene's extent / 8
  double element_edge_m = 0;  ///< longest edge of an element [m]; 0: the scene's extent / 64
};

/// Subdivisions below a patch that the lattice resolves: coordinates of vertices are whole numbers in units of a patch's
/// edge / 2^lattice_depth.
constexpr std::uint32_t lattice_depth = 15;

/// The regular lattice of one polygon, before any adaptive subdivision. Quad: vertex (i, j), 0 <= i <= cells_u, 0 <= j
/// <= cells_v, at the bilinear parameters (i / cells_u, j / cells_v), is number first_vertex + j * (cells_u + 1) + i;
/// parameter u runs from corner 0 to corner 1, v from corner 0 to corner 3. Triangle: cells_u = cells_v = N; vertex (i,
/// j), i + j <= N, at corner0 + i/N (corner1 - corner0) + j/N (corner2 - corner0), is number first_vertex + j (N + 1) -
/// j (j - 1) / 2 + i.
struct PolygonMesh {
  std::uint32_t first_vertex = 0, vertices = 0;
  std::uint32_t first_patch = 0, patches = 0;
  std::uint32_t first_element = 0, elements = 0;
  std::uint32_t cells_u = 0, cells_v = 0;  ///< elements along each side before any adaptive subdivision
  /// Patches along each side, in rows; row v of a triangle has patches_u - v upright ones, with a turned one between
  /// neighbours.
  std::uint32_t patches_u = 0, patches_v = 0;
};

struct Patch {
  std::uint32_t polygon = 0;
  std::uint32_t corners = 0;
  std::array<glm::dvec3, 4> corner{};  ///< frame
  double area_m2 = 0;
  std::uint32_t first_element = 0, elements = 0;  ///< a segment of the element array, depth first
};

/// A leaf of its patch's quadtree. Leaves are all that is kept of the tree (a linear quadtree): depth-first order and
/// `code` say the rest. Children are the corners' own in order; a triangle's middle one is last, and turned.
struct Element {
  std::array<std::uint32_t, 4> vertex{};  ///< counter-clockwise; the last is 0xffffffff in a triangle
  std::array<std::uint32_t, 4> middle{0xffffffffu, 0xffffffffu, 0xffffffffu, 0xffffffffu};
  ///< T-vertex in the middle of the edge from corner k to the next, where the neighbour is finer; else 0xffffffff
  std::uint32_t patch = 0;
  std::uint32_t level = 0;  ///< subdivisions below its patch, at most lattice_depth
  std::uint32_t code =
      0;  ///< the child taken at each level, two bits each from bit 2 lattice_depth - 1 downwards
  double area_m2 = 0;
  /// Area average = sum of weight x corner value; sums to 1. Four siblings' together are a quadratic rule on their parent
  /// (host/mesh/average.cpp). Where something covers the element in part, its exposed corners stand for the exposed share.
  std::array<double, 4> weight{};
};

struct Mesh {
  std::vector<PolygonMesh> polygons;  ///< as Scene::polygons
  std::vector<Patch> patches;         ///< polygon by polygon
  std::vector<Element> elements;      ///< patch by patch, each patch's quadtree leaves depth first
  /// Per vertex: first the regular lattices, polygon by polygon, then each subdivision's new ones in Morton order.
  /// Point::surface is the polygon. On a polygon's boundary moved 1e-3 of the element's edge inside (frame).
  std::vector<Point> receivers;
  std::vector<glm::dvec3> position_m;                 ///< per vertex, where it is drawn [m]
  std::vector<std::array<std::uint32_t, 2>> lattice;  ///< per vertex (i, j), in patches / 2^lattice_depth
  /// Per vertex, the vertices of the next coarser level whose mean the interpolant had there: the ends of an edge, each
  /// twice, or the corners of a quad; 0xffffffff for a patch's corners.
  std::vector<std::array<std::uint32_t, 4>> parents;
  double patch_edge_m = 0, element_edge_m = 0;  ///< as used

  std::uint32_t vertex_count() const { return std::uint32_t(receivers.size()); }
};

}  // namespace clrad
