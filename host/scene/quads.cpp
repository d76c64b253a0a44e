#include "scene/quads.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <tuple>

#include "scene/faces.hpp"

namespace clrad {
namespace {

using Index = std::uint32_t;
using Triangle = std::array<glm::dvec3, 3>;
using Quad = std::array<glm::dvec3, 4>;

constexpr double kSmallestSine = 1e-3;
constexpr double kShapeSteps = 1024;  // coarser than float rounding of the corners, so that equal shapes tie

struct Less {
  bool operator()(const glm::dvec3& a, const glm::dvec3& b) const {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  }
};

// An edge and the triangles on it: `forward` runs from the lower to the higher vertex index.
struct SharedEdge {
  Index uses = 0;
  std::array<Index, 2> triangle{}, corner{};
  std::array<bool, 2> forward{};
};

struct Candidate {
  int shape;  // 0: a rectangle
  Index first, second;
  Quad quad;
  std::array<glm::dvec2, 4> uv;
};

// Largest |cosine| of the quad's corners; none when it is not planar, or a corner is reflex, straight or
// needle-sharp.
std::optional<double> shape_of(const Quad& q) {
  if (quad_non_planarity(q) > kPlanarTolerance) return std::nullopt;
  const glm::dvec3 across = glm::cross(q[2] - q[0], q[3] - q[1]);
  if (!(glm::length(across) > 0)) return std::nullopt;
  const glm::dvec3 normal = glm::normalize(across);
  double worst = 0;
  for (int i = 0; i < 4; ++i) {
    const glm::dvec3 in = q[i] - q[(i + 3) % 4], out = q[(i + 1) % 4] - q[i];
    const double lengths = glm::length(in) * glm::length(out);
    if (!(glm::dot(glm::cross(in, out), normal) > kSmallestSine * lengths)) return std::nullopt;
    worst = std::max(worst, std::abs(glm::dot(in, out)) / lengths);
  }
  return worst;
}

// The quad of triangle a, its side from corner `ca` opened to take in the far corner of b; of positions or of texture coordinates.
template <class Point>
std::array<Point, 4> joined(const std::array<Point, 3>& a, Index ca, const std::array<Point, 3>& b,
                            Index cb) {
  std::array<Point, 4> quad{};
  Index n = 0;
  for (Index i = 0; i < 3; ++i) {
    quad[n++] = a[i];
    if (i == ca) quad[n++] = b[(cb + 2) % 3];
  }
  return quad;
}

// Whether texture coordinates of the two halves meet along their edge and are one linear map of the plane.
bool one_map(const std::vector<Triangle>& triangles, const std::vector<std::array<glm::dvec2, 3>>& uv,
             const SharedEdge& edge) {
  constexpr double tolerance = 1e-4;
  const auto& a = uv[edge.triangle[0]];
  const auto& b = uv[edge.triangle[1]];
  const Index ca = edge.corner[0], cb = edge.corner[1];
  // The edge runs the other way in b.
  if (a[ca] != b[(cb + 1) % 3] || a[(ca + 1) % 3] != b[cb]) return false;
  const Triangle& t = triangles[edge.triangle[0]];
  const glm::dvec3 far = triangles[edge.triangle[1]][(cb + 2) % 3] - t[0], e1 = t[1] - t[0], e2 = t[2] - t[0],
                   normal = glm::cross(e1, e2);
  const double square = glm::dot(normal, normal);
  const double along1 = glm::dot(glm::cross(far, e2), normal) / square,
               along2 = glm::dot(glm::cross(e1, far), normal) / square;
  const glm::dvec2 expected = a[0] + along1 * (a[1] - a[0]) + along2 * (a[2] - a[0]);
  const double span = glm::distance(a[0], a[1]) + glm::distance(a[1], a[2]) + glm::distance(a[2], a[0]);
  return glm::distance(expected, b[(cb + 2) % 3]) <= tolerance * span;
}

std::vector<SharedEdge> edges_of(const std::vector<Triangle>& triangles) {
  std::map<glm::dvec3, Index, Less> vertices;
  std::map<std::pair<Index, Index>, SharedEdge> edges;
  for (Index t = 0; t < triangles.size(); ++t) {
    std::array<Index, 3> vertex{};
    for (Index i = 0; i < 3; ++i) {
      vertex[i] = vertices.emplace(triangles[t][i], static_cast<Index>(vertices.size())).first->second;
    }
    for (Index i = 0; i < 3; ++i) {
      const Index a = vertex[i], b = vertex[(i + 1) % 3];
      if (a == b) continue;
      SharedEdge& edge = edges[std::minmax(a, b)];
      if (edge.uses < 2) {
        edge.triangle[edge.uses] = t;
        edge.corner[edge.uses] = i;
        edge.forward[edge.uses] = a < b;
      }
      ++edge.uses;
    }
  }
  std::vector<SharedEdge> shared;
  for (const auto& [key, edge] : edges) {
    if (edge.uses == 2 && edge.forward[0] != edge.forward[1] && edge.triangle[0] != edge.triangle[1]) {
      shared.push_back(edge);
    }
  }
  return shared;
}

}  // namespace

std::vector<MergedFace> merge_quads(const std::vector<Triangle>& triangles,
                                    const std::vector<std::array<glm::dvec2, 3>>& uv) {
  std::vector<Candidate> candidates;
  for (const SharedEdge& edge : edges_of(triangles)) {
    const auto [first, second] = edge.triangle;
    if (!uv.empty() && !one_map(triangles, uv, edge)) continue;
    const Quad quad = joined(triangles[first], edge.corner[0], triangles[second], edge.corner[1]);
    if (const auto shape = shape_of(quad)) {
      candidates.push_back({static_cast<int>(std::lround(*shape * kShapeSteps)), first, second, quad, {}});
      if (!uv.empty()) candidates.back().uv = joined(uv[first], edge.corner[0], uv[second], edge.corner[1]);
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.shape, a.first, a.second) < std::tie(b.shape, b.first, b.second);
  });
  std::vector<MergedFace> faces(triangles.size());
  std::vector<bool> taken(triangles.size(), false), dropped(triangles.size(), false);
  for (Index t = 0; t < triangles.size(); ++t) {
    faces[t] = {{triangles[t][0], triangles[t][1], triangles[t][2], {}}, 3, t, {}};
    if (!uv.empty()) faces[t].uv = {uv[t][0], uv[t][1], uv[t][2], {}};
  }
  for (const Candidate& c : candidates) {
    if (taken[c.first] || taken[c.second]) continue;
    taken[c.first] = taken[c.second] = true;
    dropped[c.second] = true;
    faces[c.first] = {c.quad, 4, c.first, c.uv};
  }
  std::vector<MergedFace> kept;
  for (Index t = 0; t < faces.size(); ++t) {
    if (!dropped[t]) kept.push_back(faces[t]);
  }
  return kept;
}

}  // namespace clrad
