#include "scene/topology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>

namespace clrad {
namespace {

using Index = std::uint32_t;

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

}  // namespace

bool is_watertight(const Scene& scene) {
  for (const Edge& edge : edges_of(scene)) {
    if (edge.uses != 2 || edge.side[0].forward == edge.side[1].forward) return false;
  }
  return !scene.polygons.empty();
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
  std::vector<std::vector<Link>> links(scene.polygons.size());
  for (const Edge& edge : edges_of(scene)) {
    if (edge.uses != 2 || edge.side[0].polygon == edge.side[1].polygon) continue;
    const bool opposed = edge.side[0].forward == edge.side[1].forward;
    links[edge.side[0].polygon].push_back({edge.side[1].polygon, opposed});
    links[edge.side[1].polygon].push_back({edge.side[0].polygon, opposed});
  }
  enum : std::int8_t { unseen = -1, along = 0, against = 1 };
  std::vector<std::int8_t> facing(scene.polygons.size(), unseen);
  for (Index start = 0; start < scene.polygons.size(); ++start) {
    if (facing[start] != unseen) continue;
    std::vector<Index> surface = {start};
    facing[start] = along;
    bool contradiction = false;
    std::size_t turned = 0;
    for (std::size_t next = 0; next < surface.size(); ++next) {
      const Index p = surface[next];
      for (const Link& link : links[p]) {
        if (lies_on(links[p], link)) continue;
        const auto wanted = static_cast<std::int8_t>(facing[p] ^ static_cast<std::int8_t>(link.opposed));
        if (facing[link.to] == unseen) {
          facing[link.to] = wanted;
          surface.push_back(link.to);
          turned += wanted == against;
        } else if (facing[link.to] != wanted) {
          contradiction = true;
        }
      }
    }
    if (contradiction) {
      findings.push_back({Diagnostic::Severity::warning, "orientation", scene.polygons[start].where,
                          "the surface that begins here cannot be given a front, as on a Moebius strip"});
      continue;
    }
    const std::int8_t minority = 2 * turned > surface.size() ? along : against;
    for (const Index p : surface) {
      if (facing[p] != minority) continue;
      findings.push_back(
          {Diagnostic::Severity::warning, "orientation", scene.polygons[p].where,
           fmt::format("\"{}\" faces against the {} polygons it is joined to; its front may be its "
                       "back: list its corners the other way round",
                       scene.polygons[p].name, surface.size() - 1)});
    }
  }
}

}  // namespace clrad
