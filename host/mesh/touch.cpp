#include "mesh/touch.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

// Of the shortest edge around a vertex: half of what vertices on a polygon's boundary are moved inside by, so that those touch nothing.
constexpr double reach_of_edge = 5e-4, move_of_edge = 1e-3;

// Per vertex from `first` on, the shortest edge of the elements around it [frame]; 0: of none.
std::vector<double> shortest_edges(const Mesh& mesh, const Frame& frame, std::uint32_t first) {
  std::vector<double> shortest(mesh.vertex_count() - first, 0);
  for (const Element& e : mesh.elements) {
    const std::uint32_t corners = e.vertex[3] == 0xffffffffu ? 3 : 4;
    double edge = INFINITY;
    for (std::uint32_t k = 0; k < corners; ++k)
      edge = std::min(
          edge, glm::distance(mesh.position_m[e.vertex[k]], mesh.position_m[e.vertex[(k + 1) % corners]]));
    edge /= frame.metres();
    const auto note = [&](std::uint32_t v) {
      if (v == 0xffffffffu || v < first) return;
      double& mine = shortest[v - first];
      mine = mine > 0 ? std::min(mine, edge) : edge;
    };
    for (const std::uint32_t v : e.vertex) note(v);
    for (const std::uint32_t v : e.middle) note(v);
  }
  return shortest;
}

bool inside(const Polygon& polygon, const Frame& frame, const glm::dvec3& p, double margin) {
  const glm::dvec3 normal = polygon.normal();
  for (std::uint32_t k = 0; k < polygon.corners; ++k) {
    const glm::dvec3 a = frame.to_frame(polygon.corner[k]),
                     b = frame.to_frame(polygon.corner[(k + 1) % polygon.corners]);
    if (glm::dot(glm::normalize(glm::cross(normal, b - a)), p - a) < margin) return false;
  }
  return true;
}

}  // namespace

std::uint32_t move_off_touched(Device& device, const Scene& scene, const Frame& frame, const Tree& tree,
                               Mesh& mesh, std::uint32_t first) {
  const std::uint32_t count = mesh.vertex_count() - first;
  if (count == 0) return 0;
  const auto stage = device.stage("move vertices off what they touch");
  const std::vector<double> edges = shortest_edges(mesh, frame, first);
  std::vector<float> reach;
  reach.reserve(count);
  for (const double edge : edges) reach.push_back(float(reach_of_edge * edge));
  const PointArray receivers(device, std::span(mesh.receivers).subspan(first), "vertices");
  const Array<float> reaches(device, reach, "reach of vertices");
  Array<float> moves(device, 3 * std::uint64_t(count), "moves of vertices");
  device.run("mesh/touch.cl", "find_touched", count, receivers, count, reaches, tree.nodes, tree.triangles,
             tree.facets, moves);
  const std::vector<float> move = moves.download();
  std::uint32_t moved = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 way(move[3 * i], move[3 * i + 1], move[3 * i + 2]);
    if (way == glm::dvec3(0)) continue;
    Point& p = mesh.receivers[first + i];
    const glm::dvec3 to = p.position + move_of_edge * edges[i] * way;
    if (!inside(scene.polygons[p.surface], frame, to, reach_of_edge * edges[i])) continue;
    p.position = to;
    ++moved;
  }
  return moved;
}

}  // namespace clrad
