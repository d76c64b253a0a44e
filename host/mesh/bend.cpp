#include "mesh/bend.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mesh/vertex_finder.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t no_vertex = VertexFinder::none;

// A place on the line of an edge, at `along` times the edge from its first end: a vertex, or the middle of a larger edge that
// the line leaves a larger element by, where what that edge displays stands for the vertex that is not there.
struct OnLine {
  std::uint32_t vertex = no_vertex, edge = no_vertex;
  int along = 0;

  bool there() const { return vertex != no_vertex || edge != no_vertex; }
};

// Of an edge and the places around it on its line: its ends are [2] and [3].
using Line = std::array<OnLine, 6>;

struct Lines {
  const Mesh& mesh;
  const Edges& edges;
  const VertexFinder finder;
  std::vector<bool> known;  // edges whose bend is

  Lines(const Mesh& of, const Edges& edges_of_mesh, const std::vector<std::uint8_t>& covered)
      : mesh(of), edges(edges_of_mesh), finder(of, covered), known(edges_of_mesh.ends.size()) {}

  // Longest difference of lattice coordinates.
  std::int64_t length(std::uint32_t edge) const {
    const auto &a = mesh.lattice[edges.ends[edge][0]], &b = mesh.lattice[edges.ends[edge][1]];
    return std::max(std::abs(std::int64_t(b[0]) - a[0]), std::abs(std::int64_t(b[1]) - a[1]));
  }

  // The edge with (i, j) in its middle and twice as long as `unit`; none, too, where its bend is not known.
  std::uint32_t edge_around(std::uint32_t polygon, std::int64_t i, std::int64_t j, std::int64_t unit) const {
    if (i < 0 || j < 0) return no_vertex;
    const std::int64_t di = i / unit % 2 * unit, dj = j / unit % 2 * unit;
    if (di == 0 && dj == 0) return no_vertex;
    // Both odd: the side of a triangle that runs against the other two.
    const std::uint32_t a = finder.at(polygon, i - di, j + dj * (di > 0 ? 1 : -1)),
                        b = finder.at(polygon, i + di, j + dj * (di > 0 ? -1 : 1));
    if (a == no_vertex || b == no_vertex) return no_vertex;
    const std::array<std::uint32_t, 2> ends{std::min(a, b), std::max(a, b)};
    const auto found = std::lower_bound(edges.ends.begin(), edges.ends.end(), ends);
    if (found == edges.ends.end() || *found != ends) return no_vertex;
    const auto edge = std::uint32_t(found - edges.ends.begin());
    return known[edge] ? edge : no_vertex;
  }

  // The next place on the line in one direction, at the edge's own distance or, past a larger element, at twice that.
  OnLine next(std::uint32_t edge, const OnLine& from, int direction) const {
    if (!from.there()) return {};
    const auto& ends = edges.ends[edge];
    const auto &a = mesh.lattice[ends[0]], &b = mesh.lattice[ends[1]];
    const std::uint32_t polygon = mesh.receivers[ends[0]].surface;
    for (int along = from.along + direction; std::abs(along - from.along) <= 2; along += direction) {
      const std::int64_t i = a[0] + along * (std::int64_t(b[0]) - a[0]),
                         j = a[1] + along * (std::int64_t(b[1]) - a[1]);
      const std::uint32_t v = finder.at(polygon, i, j);
      if (v != no_vertex) return {v, no_vertex, along};
      const std::uint32_t larger = edge_around(polygon, i, j, length(edge));
      if (larger != no_vertex) return {no_vertex, larger, along};
    }
    return {};
  }

  Line of(std::uint32_t edge) const {
    Line line;
    line[2] = {edges.ends[edge][0], no_vertex, 0}, line[3] = {edges.ends[edge][1], no_vertex, 1};
    line[1] = next(edge, line[2], -1);
    line[4] = next(edge, line[3], 1);
    if (line[1].there() && line[4].there()) return line;
    line[0] = next(edge, line[1], -1);
    line[5] = next(edge, line[4], 1);
    return line;
  }
};

bool complete(const Line& line, std::size_t first) {
  return line[first].there() && line[first + 1].there() && line[first + 2].there();
}

// Values of one band: at vertices, and in the middles of edges, with how far off these may be, as far as they are known.
struct Values {
  const double *at_vertex, *bend, *doubt_in_middle;
  const Edges& edges;

  double at(const OnLine& place) const {
    if (place.vertex != no_vertex) return at_vertex[place.vertex];
    const auto& ends = edges.ends[place.edge];
    return (at_vertex[ends[0]] + at_vertex[ends[1]]) / 2 + bend[place.edge] / 4;
  }
  double doubt(const OnLine& place) const {
    return place.vertex != no_vertex ? 0 : doubt_in_middle[place.edge];
  }
};

// Second difference at [first + 1], for steps of the edge's length; the least that it can be.
double second_difference(const Line& line, std::size_t first, const Values& values) {
  const OnLine &a = line[first], &b = line[first + 1], &c = line[first + 2];
  const int ab = b.along - a.along, bc = c.along - b.along, ac = c.along - a.along;
  const double found = 2 * ((values.at(c) - values.at(b)) / bc - (values.at(b) - values.at(a)) / ab) / ac;
  const double doubt =
      2 * std::abs((values.doubt(c) + values.doubt(b)) / bc + (values.doubt(b) + values.doubt(a)) / ab) /
      std::abs(ac);
  return std::copysign(std::max(std::abs(found) - doubt, 0.0), found);
}

// Of the two second differences that an edge has, where on its line they begin; false: there are no two.
bool choose(const Line& line, std::array<std::size_t, 2>& at) {
  const bool before = complete(line, 1), after = complete(line, 2);
  if (before && after) return at = {1, 2}, true;
  if (before && complete(line, 0)) return at = {1, 0}, true;
  if (after && complete(line, 3)) return at = {2, 3}, true;
  return false;
}

}  // namespace

Edges edges_of(const Mesh& mesh) {
  struct Side {
    std::uint64_t name;  // the ends, the lower one above
    std::uint32_t element, place;
  };
  std::vector<Side> sides;
  sides.reserve(4 * mesh.elements.size());
  for (std::uint32_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const std::uint32_t corners = element.vertex[3] == no_vertex ? 3 : 4;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t place) {
      sides.push_back({std::uint64_t(std::min(a, b)) << 32 | std::max(a, b), e, place});
    };
    for (std::uint32_t k = 0; k < corners; ++k) {
      const std::uint32_t from = element.vertex[k], to = element.vertex[(k + 1) % corners],
                          middle = element.middle[k];
      add(from, middle == no_vertex ? to : middle, 2 * k);
      if (middle != no_vertex) add(middle, to, 2 * k + 1);
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.name < b.name; });
  Edges edges;
  edges.of_element.resize(mesh.elements.size());
  for (auto& of : edges.of_element) of.fill(no_vertex);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i == 0 || sides[i].name != sides[i - 1].name)
      edges.ends.push_back({std::uint32_t(sides[i].name >> 32), std::uint32_t(sides[i].name)});
    edges.of_element[sides[i].element][sides[i].place] = std::uint32_t(edges.ends.size() - 1);
  }
  return edges;
}

std::vector<double> edge_bends(const Mesh& mesh, const Edges& edges, const std::vector<std::uint8_t>& covered,
                               const std::vector<double>& values, std::uint32_t bands) {
  Lines lines(mesh, edges, covered);
  const std::size_t vertices = mesh.vertex_count(), count = edges.ends.size();
  std::vector<double> bends(bands * count, 0.0), doubt(bands * count, 0.0);
  // The longest first: others' lines end at their middles.
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return lines.length(a) > lines.length(b); });
  for (const std::uint32_t e : order) {
    const auto& ends = edges.ends[e];
    std::array<std::size_t, 2> at{};
    if (covered[ends[0]] || covered[ends[1]]) continue;
    const Line line = lines.of(e);
    if (!choose(line, at)) continue;
    lines.known[e] = true;
    for (std::uint32_t b = 0; b < bands; ++b) {
      const Values of_band{values.data() + b * vertices, bends.data() + b * count, doubt.data() + b * count,
                           edges};
      const double p = second_difference(line, at[0], of_band), q = second_difference(line, at[1], of_band);
      if (!(p * q > 0)) {
        // Either sign may be that of a step within the edge, half of which the middle is off by.
        if (p * q < 0) doubt[b * count + e] = std::max(std::abs(p), std::abs(q)) / 2;
        continue;
      }
      // Each edge may take half of what a bilinear or linear display has there: the edges of either direction of a quad
      // meet in its middle.
      const double least = -2 * std::max(std::min(of_band.at(line[2]), of_band.at(line[3])), 0.0);
      bends[b * count + e] = std::max(-p / (p + q) * q, least);
    }
  }
  return bends;
}

}  // namespace clrad
