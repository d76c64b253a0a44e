#include "mesh/locate.hpp"

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

// Coordinates in a node of the quadtree: (x, y) in a quad, the three barycentric ones in a triangle.
struct Local {
  std::array<double, 3> at;
  bool quad;

  // Moves into the child that holds the point, and says which.
  std::uint32_t descend() {
    if (quad) {
      const bool right = at[0] >= 0.5, up = at[1] >= 0.5;
      at[0] = 2 * at[0] - right, at[1] = 2 * at[1] - up;
      return up ? (right ? 2 : 3) : (right ? 1 : 0);
    }
    for (std::uint32_t k = 0; k < 3; ++k)
      if (at[k] >= 0.5) {
        for (std::uint32_t i = 0; i < 3; ++i) at[i] = 2 * at[i] - (i == k);
        return k;
      }
    for (double& b : at) b = 1 - 2 * b;
    return 3;
  }
};

// What an edge's values along it weigh: of a T-vertex in its middle the hat, of the bend of the whole edge or of each half
// the parabola. a and b: distances from its two ends, of sum 1, or a triangle's barycentric coordinates there. On other
// edges all are 0. A triangle's hat less its half parabolas is a whole one all over, so that quadratic functions are met.
struct AlongEdge {
  double hat, whole, half_a, half_b;

  AlongEdge(double a, double b)
      : hat(2 * std::min(a, b) * (a + b)),
        whole(a * b),
        half_a(a > b ? 2 * b * (a - b) : 0),
        half_b(a > b ? 0 : 2 * a * (b - a)) {}
};

}  // namespace

Interpolant locate(const Mesh& mesh, std::uint32_t polygon, std::uint32_t corners, double u, double v) {
  const PolygonMesh& of = mesh.polygons[polygon];
  Local local{{0, 0, 0}, corners == 4};
  std::uint32_t patch = of.first_patch;
  u = std::clamp(u, 0.0, 1.0), v = std::clamp(v, 0.0, corners == 4 ? 1.0 : 1 - u);
  const double pu = u * of.patches_u, pv = v * of.patches_v;
  if (corners == 4) {
    const std::uint32_t i = std::min(std::uint32_t(pu), of.patches_u - 1),
                        j = std::min(std::uint32_t(pv), of.patches_v - 1);
    patch += j * of.patches_u + i;
    local.at = {pu - i, pv - j, 0};
  } else {
    const std::uint32_t n = of.patches_u, i = std::min(std::uint32_t(pu), n - 1),
                        j = std::min(std::uint32_t(pv), n - 1 - i);
    const double x = std::min(pu - i, 1.0), y = std::min(pv - j, 1.0);
    patch += j * (2 * n - j) + 2 * i;
    // The last patch of a row has no turned neighbour: past its edge there is only rounding.
    if (x + y <= 1 || i + j + 1 == n)
      local.at = {std::max(1 - x - y, 0.0), x, y};
    else
      ++patch, local.at = {x + y - 1, 1 - x, 1 - y};
  }

  std::uint32_t code = 0;
  Local deepest = local;
  for (std::uint32_t level = 0; level < lattice_depth; ++level) code = code << 2 | deepest.descend();
  const auto begin = mesh.elements.begin() + mesh.patches[patch].first_element,
             end = begin + mesh.patches[patch].elements;
  const auto leaf =
      std::upper_bound(begin, end, code, [](std::uint32_t c, const Element& e) { return c < e.code; }) - 1;
  for (std::uint32_t level = 0; level < leaf->level; ++level) local.descend();

  Interpolant result;
  result.element = std::uint32_t(leaf - mesh.elements.begin());
  const auto& at = local.at;
  std::array<double, 4> corner{at[0], at[1], at[2], 0};
  // Of each edge: distances from its ends, and how much is left at the point.
  std::array<double, 4> from = corner, to{at[1], at[2], at[0], 0}, fall{1, 1, 1, 0};
  if (corners == 4) {
    const double x = at[0], y = at[1], x1 = 1 - x, y1 = 1 - y;
    corner = {x1 * y1, x * y1, x * y, x1 * y};
    from = {x1, y1, x, y}, to = {x, y, x1, y1}, fall = {y1, x, y, x1};
  }
  for (std::uint32_t k = 0; k < 4; ++k) {
    result.vertex[k] = k < corners ? leaf->vertex[k] : leaf->vertex[0];
    result.weight[k] += corner[k];
    const bool there = k < corners && leaf->middle[k] != 0xffffffffu;
    result.vertex[4 + k] = there ? leaf->middle[k] : leaf->vertex[0];
    const AlongEdge along(from[k], to[k]);
    result.bend_weight[2 * k] = fall[k] * (there ? along.half_a : along.whole);
    if (!there) continue;
    result.bend_weight[2 * k + 1] = fall[k] * along.half_b;
    const double middle = fall[k] * along.hat;
    result.weight[4 + k] = middle;
    result.weight[k] -= middle / 2;
    result.weight[(k + 1) % corners] -= middle / 2;
  }
  return result;
}

}  // namespace clrad
