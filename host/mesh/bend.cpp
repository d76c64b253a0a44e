#include "mesh/bend.hpp"

#include <algorithm>

#include "mesh/vertex_finder.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t no_vertex = VertexFinder::none;

// A vertex on the line of an edge, at `along` times the edge from its first end.
struct OnLine {
  std::uint32_t vertex = no_vertex;
  int along = 0;
};

// Of an edge and the vertices around it on its line: those of its ends are [2] and [3].
using Line = std::array<OnLine, 6>;

// The next vertex on the line in one direction, at the edge's own distance or, past a larger element, at twice that.
OnLine next_on(const VertexFinder& finder, const Mesh& mesh, const std::array<std::uint32_t, 2>& ends,
               OnLine from, int direction) {
  if (from.vertex == no_vertex) return {};
  const auto &a = mesh.lattice[ends[0]], &b = mesh.lattice[ends[1]], &at = mesh.lattice[from.vertex];
  for (int steps = direction; std::abs(steps) <= 2; steps += direction) {
    const std::uint32_t v =
        finder.at(mesh.receivers[ends[0]].surface, at[0] + steps * (std::int64_t(b[0]) - std::int64_t(a[0])),
                  at[1] + steps * (std::int64_t(b[1]) - std::int64_t(a[1])));
    if (v != no_vertex) return {v, from.along + steps};
  }
  return {};
}

Line line_of(const VertexFinder& finder, const Mesh& mesh, const std::array<std::uint32_t, 2>& ends) {
  Line line;
  line[2] = {ends[0], 0}, line[3] = {ends[1], 1};
  line[1] = next_on(finder, mesh, ends, line[2], -1);
  line[4] = next_on(finder, mesh, ends, line[3], 1);
  if (line[1].vertex != no_vertex && line[4].vertex != no_vertex) return line;
  line[0] = next_on(finder, mesh, ends, line[1], -1);
  line[5] = next_on(finder, mesh, ends, line[4], 1);
  return line;
}

bool complete(const Line& line, std::size_t first) {
  return line[first].vertex != no_vertex && line[first + 1].vertex != no_vertex &&
         line[first + 2].vertex != no_vertex;
}

// Second difference at [first + 1], for steps of the edge's length.
double second_difference(const Line& line, std::size_t first, const double* values) {
  const auto slope = [&](const OnLine& a, const OnLine& b) {
    return (values[b.vertex] - values[a.vertex]) / (b.along - a.along);
  };
  const OnLine &a = line[first], &b = line[first + 1], &c = line[first + 2];
  return 2 * (slope(b, c) - slope(a, b)) / (c.along - a.along);
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
  const VertexFinder finder(mesh, covered);
  const std::size_t vertices = mesh.vertex_count(), count = edges.ends.size();
  std::vector<double> bends(bands * count, 0.0);
  for (std::size_t e = 0; e < count; ++e) {
    const auto& ends = edges.ends[e];
    std::array<std::size_t, 2> at{};
    if (covered[ends[0]] || covered[ends[1]]) continue;
    const Line line = line_of(finder, mesh, ends);
    if (!choose(line, at)) continue;
    for (std::uint32_t b = 0; b < bands; ++b) {
      const double* const of_band = values.data() + b * vertices;
      const double p = second_difference(line, at[0], of_band), q = second_difference(line, at[1], of_band);
      if (!(p * q > 0)) continue;
      // Each edge may take half of what a bilinear or linear display has there: the edges of either direction of a quad
      // meet in its middle.
      const double least = -2 * std::max(std::min(of_band[ends[0]], of_band[ends[1]]), 0.0);
      bends[b * count + e] = std::max(-p / (p + q) * q, least);
    }
  }
  return bends;
}

}  // namespace clrad
