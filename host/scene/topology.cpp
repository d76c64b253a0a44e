#include "scene/topology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <unordered_map>

namespace clrad {
namespace {

using Index = std::uint32_t;

constexpr double kFlat = 1e-12;  // volume / diagonal^3 that rounding alone may leave

struct PointHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t h = 0;
    for (const double x : p) {
      h = (h ^ std::bit_cast<std::uint64_t>(x)) * 0x9fb21c651e98df25ull;
      h ^= h >> 32;
    }
    return h;
  }
};

// A side of a polygon; `forward` when it runs from the lower to the higher vertex.
struct Side {
  Index polygon, corner;
  bool forward;
};

// The polygons along one edge: how many, and the first two.
struct Edge {
  std::array<Side, 2> side{};
  std::uint32_t uses = 0;
};

// All edges, in the order in which the file first uses them.
std::vector<Edge> edges_of(const Scene& scene) {
  std::unordered_map<std::array<double, 3>, Index, PointHash> vertices;
  std::unordered_map<std::uint64_t, Index> index_of;
  std::vector<Edge> edges;
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    if (polygon.back) continue;
    std::array<Index, 4> vertex{};
    for (Index i = 0; i < polygon.corners; ++i) {
      const glm::dvec3 c = polygon.corner[i] + 0.0;  // -0 and 0 are one place
      vertex[i] =
          vertices.emplace(std::array{c.x, c.y, c.z}, static_cast<Index>(vertices.size())).first->second;
    }
    for (Index i = 0; i < polygon.corners; ++i) {
      const Index a = vertex[i], b = vertex[(i + 1) % polygon.corners];
      const std::uint64_t key = std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
      const auto [found, is_new] = index_of.emplace(key, static_cast<Index>(edges.size()));
      if (is_new) edges.emplace_back();
      Edge& edge = edges[found->second];
      if (edge.uses < 2) edge.side[edge.uses] = {p, i, a < b};
      ++edge.uses;
    }
  }
  return edges;
}

std::string text_of(const glm::dvec3& p) {
  return fmt::format("({}, {}, {})", p.x, p.y, p.z);
}

struct Link {
  Index to;
  bool opposed;  // the two polygons face different ways across their common edge
};

// Two polygons that share two sides the same way round lie on each other; they are not neighbours.
bool lies_on(const std::vector<Link>& links, const Link& link) {
  return link.opposed && std::count_if(links.begin(), links.end(), [&](const Link& other) {
                           return other.opposed && other.to == link.to;
                         }) > 1;
}

// Polygons joined across edges that exactly two of them use, breadth first from the first in file order.
struct Surface {
  std::vector<Index> polygons;
  std::vector<bool> turned;    // faces against the first one
  bool contradiction = false;  // not orientable
  bool closed = true;          // every edge of every polygon is used by exactly two
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  std::size_t turned_count() const {
    return static_cast<std::size_t>(std::count(turned.begin(), turned.end(), true));
  }
  bool contains(const Surface& other) const {  // the middle of its bounding box, in ours
    const glm::dvec3 middle = 0.5 * other.low + 0.5 * other.high;
    return glm::all(glm::lessThanEqual(low, middle)) && glm::all(glm::lessThanEqual(middle, high));
  }
};

std::vector<Surface> surfaces_of(const Scene& scene) {
  const std::size_t count = scene.polygons.size();
  std::vector<std::vector<Link>> links(count);
  std::vector<bool> open(count, false), seen(count, false), turned(count, false);
  for (const Edge& edge : edges_of(scene)) {
    const Index a = edge.side[0].polygon, b = edge.side[1].polygon;
    if (edge.uses == 2 && a != b) {
      const bool opposed = edge.side[0].forward == edge.side[1].forward;
      links[a].push_back({b, opposed});
      links[b].push_back({a, opposed});
    } else {
      open[a] = true;
      if (edge.uses > 1) open[b] = true;
    }
  }
  std::vector<Surface> surfaces;
  for (Index start = 0; start < count; ++start) {
    if (seen[start] || scene.polygons[start].back) continue;
    seen[start] = true;
    Surface surface;
    surface.polygons = {start};
    for (std::size_t next = 0; next < surface.polygons.size(); ++next) {
      const Index p = surface.polygons[next];
      surface.turned.push_back(turned[p]);
      surface.closed = surface.closed && !open[p];
      for (Index i = 0; i < scene.polygons[p].corners; ++i) {
        surface.low = glm::min(surface.low, scene.polygons[p].corner[i]);
        surface.high = glm::max(surface.high, scene.polygons[p].corner[i]);
      }
      for (const Link& link : links[p]) {
        if (lies_on(links[p], link)) {
          surface.closed = false;
          continue;
        }
        const bool wanted = turned[p] != link.opposed;
        if (!seen[link.to]) {
          seen[link.to] = true;
          turned[link.to] = wanted;
          surface.polygons.push_back(link.to);
        } else if (turned[link.to] != wanted) {
          surface.contradiction = true;
        }
      }
    }
    surfaces.push_back(std::move(surface));
  }
  return surfaces;
}

// Positive where a closed surface faces outward (divergence theorem about its own corner).
double enclosed_volume(const Scene& scene, const Surface& surface) {
  double six_volumes = 0;
  for (const Index p : surface.polygons) {
    const auto& c = scene.polygons[p].corner;
    for (Index i = 2; i < scene.polygons[p].corners; ++i) {
      six_volumes += glm::dot(c[0] - surface.low, glm::cross(c[i - 1] - surface.low, c[i] - surface.low));
    }
  }
  return six_volumes / 6;
}

}  // namespace

bool is_watertight(const Scene& scene) {
  for (const Edge& edge : edges_of(scene)) {
    if (edge.uses != 2 || edge.side[0].forward == edge.side[1].forward) return false;
  }
  return !scene.polygons.empty();
}

std::vector<std::uint32_t> closed_surfaces(const Scene& scene) {
  std::vector<std::uint32_t> first(scene.polygons.size(), 0xffffffffu);
  for (const Surface& surface : surfaces_of(scene)) {
    if (!surface.closed || surface.contradiction || surface.turned_count() > 0) continue;
    for (const Index p : surface.polygons) first[p] = surface.polygons.front();
  }
  return first;
}

void check_open_edges(const Scene& scene, std::vector<Diagnostic>& findings) {
  constexpr std::size_t kShown = 5;
  std::size_t count = 0;
  std::string list;
  SourceLocation first;
  for (const Edge& edge : edges_of(scene)) {
    if (edge.uses != 1) continue;
    const Polygon& polygon = scene.polygons[edge.side[0].polygon];
    const Index i = edge.side[0].corner;
    if (count == 0) first = polygon.where;
    if (count++ >= kShown) continue;
    list += fmt::format("{}\"{}\" at {} from {} to {}", list.empty() ? "" : "; ", polygon.name,
                        polygon.where.text(), text_of(polygon.corner[i]),
                        text_of(polygon.corner[(i + 1) % polygon.corners]));
  }
  if (count == 0) return;
  findings.push_back({Diagnostic::Severity::warning,
                      "open-edges",
                      {scene.file, 0, ""},
                      fmt::format("{} sides belong to one polygon alone, so light may leave there: {}{}",
                                  count, list, count > kShown ? "; ..." : "")});
}

void check_orientation(const Scene& scene, std::vector<Diagnostic>& findings) {
  const auto warn = [&](const char* rule, Index polygon, std::string message) {
    findings.push_back(
        {Diagnostic::Severity::warning, rule, scene.polygons[polygon].where, std::move(message)});
  };
  const std::vector<Surface> surfaces = surfaces_of(scene);
  for (const Surface& surface : surfaces) {
    const std::size_t size = surface.polygons.size();
    if (surface.contradiction) {
      warn("orientation", surface.polygons.front(),
           "the surface that begins here cannot be given a front, as on a Moebius strip");
      continue;
    }
    const bool minority = 2 * surface.turned_count() <= size;  // true: those against the first polygon
    for (std::size_t i = 0; i < size; ++i) {
      if (surface.turned[i] != minority) continue;
      warn("orientation", surface.polygons[i],
           fmt::format(
               "\"{}\" faces against the {} polygons it is joined to; its front may be its back: list its "
               "corners the other way round",
               scene.polygons[surface.polygons[i]].name, size - 1));
    }
  }
  for (const Surface& surface : surfaces) {
    if (!surface.closed || surface.contradiction || surface.turned_count() > 0) continue;
    const double volume = enclosed_volume(scene, surface);
    const double diagonal = glm::distance(surface.low, surface.high);
    if (std::abs(volume) <= kFlat * diagonal * diagonal * diagonal) continue;  // a sheet with two sides
    const bool inward = volume < 0;
    const auto inside = [&](const Surface& other) { return &other == &surface || surface.contains(other); };
    const auto holding =
        static_cast<std::size_t>(std::count_if(surfaces.begin(), surfaces.end(), inside)) - 1;
    if (inward && holding == 0 && surfaces.size() > 1) {
      warn("inside-out", surface.polygons.front(),
           "the closed surface that begins here faces inward though nothing is in it; if it is an object, "
           "turn it");
    } else if (!inward && holding + 1 == surfaces.size()) {
      warn("inside-out", surface.polygons.front(),
           "the closed surface that begins here holds the whole scene but faces outward; if it is a room, "
           "turn it");
    }
  }
}

}  // namespace clrad
