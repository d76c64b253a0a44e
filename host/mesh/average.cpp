#include "mesh/average.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace clrad {
namespace {

constexpr std::uint32_t no_corner = 0xffffffffu;

bool exposed(const Element& e, const std::vector<std::uint8_t>& covered) {
  for (const std::uint32_t v : e.vertex)
    if (v != no_corner && covered[v]) return false;
  return true;
}

// Area per parameter area is the same all over; on other quads the interpolant's weights stay.
bool even(const Mesh& mesh, const Element& e) {
  if (e.vertex[3] == no_corner) return true;
  const auto& p = mesh.position_m;
  const glm::dvec3 diagonal = p[e.vertex[2]] - p[e.vertex[0]];
  const glm::dvec3 bend = p[e.vertex[0]] - p[e.vertex[1]] + p[e.vertex[2]] - p[e.vertex[3]];
  return glm::length(bend) <= 1e-6 * glm::length(diagonal);
}

// Elements first .. first + 3 are the children of one parent.
bool siblings(const std::vector<Element>& elements, std::uint32_t first, std::uint32_t end) {
  const Element& e = elements[first];
  if (first + 4 > end || e.level == 0) return false;
  const std::uint32_t shift = 2 * (lattice_depth - e.level);
  if ((e.code >> shift & 3) != 0) return false;
  for (std::uint32_t k = 1; k < 4; ++k)
    if (elements[first + k].level != e.level || elements[first + k].code >> shift != (e.code >> shift) + k)
      return false;
  return true;
}

// Quadratic interpolants of the parent, averaged over one of its four children: weights of the parent's corners and of the
// middles of its sides and of itself. On an interval, its child's end, middle and far end weigh 5/12, 8/12 and -1/12.
double average_in_quad(const std::vector<Element>& elements, std::uint32_t first, std::uint32_t child,
                       const std::vector<double>& values) {
  const auto value = [&](std::uint32_t of, std::uint32_t corner) {
    return values[elements[first + of % 4].vertex[corner % 4]];
  };
  const std::uint32_t k = child;
  return (25 * value(k, k) + 40 * (value(k, k + 1) + value(k, k + 3)) + 64 * value(k, k + 2) -
          5 * (value(k + 1, k + 1) + value(k + 3, k + 3)) + value(k + 2, k + 2) -
          8 * (value(k + 2, k + 1) + value(k + 2, k + 3))) /
         144;
}

double average_in_triangle(const std::vector<Element>& elements, std::uint32_t first, std::uint32_t child,
                           const std::vector<double>& values) {
  double sum = 0;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double corner = values[elements[first + k].vertex[k]],
                 opposite = values[elements[first + (k + 1) % 3].vertex[(k + 2) % 3]];
    if (child == 3)
      sum += (5 * opposite - corner) / 12;
    else
      sum += k == child ? (3 * corner + opposite) / 12 : (5 * opposite - corner) / 12;
  }
  return sum;
}

double by_own_weights(const Element& e, const std::vector<std::uint8_t>& covered,
                      const std::vector<double>& values) {
  double sum = 0, seen = 0;
  for (std::uint32_t k = 0; k < 4; ++k)
    if (e.vertex[k] != no_corner && !covered[e.vertex[k]])
      sum += e.weight[k] * values[e.vertex[k]], seen += e.weight[k];
  return seen > 0 ? sum / seen : 0;
}

double by_corners(const Element& e, const std::vector<double>& values) {
  const std::uint32_t corners = e.vertex[3] == no_corner ? 3 : 4;
  double sum = 0;
  for (std::uint32_t k = 0; k < corners; ++k) sum += values[e.vertex[k]];
  return sum / corners;
}

// At a shadow's edge a quadratic overshoots.
double within_corners(const Element& e, const std::vector<double>& values, double average) {
  double low = values[e.vertex[0]], high = low;
  for (const std::uint32_t v : e.vertex)
    if (v != no_corner) low = std::min(low, values[v]), high = std::max(high, values[v]);
  return std::clamp(average, low, high);
}

}  // namespace

void average_by_parents(Mesh& mesh, const std::vector<std::uint8_t>& covered) {
  for (const Patch& patch : mesh.patches) {
    const std::uint32_t end = patch.first_element + patch.elements;
    for (std::uint32_t first = patch.first_element; first < end;) {
      const bool family = siblings(mesh.elements, first, end);
      const std::uint32_t members = family ? 4 : 1;
      bool by_parent = family;
      for (std::uint32_t i = first; i < first + members; ++i)
        by_parent &= exposed(mesh.elements[i], covered) && even(mesh, mesh.elements[i]);
      for (std::uint32_t i = first; i < first + members; ++i) {
        Element& e = mesh.elements[i];
        const bool triangle = e.vertex[3] == no_corner;
        const std::uint32_t child = i - first;  // keeps the parent's corner of that number
        if (by_parent && triangle) {
          e.weight = {1.0 / 3, 1.0 / 3, 1.0 / 3, 0};
          if (child < 3) e.weight = {0.5, 0.5, 0.5, 0}, e.weight[child] = 0;
        } else if (by_parent) {
          e.weight = {2.0 / 9, 2.0 / 9, 2.0 / 9, 2.0 / 9};
          e.weight[child] = 1.0 / 9, e.weight[(child + 2) % 4] = 4.0 / 9;
        } else if (exposed(e, covered) && even(mesh, e)) {
          e.weight = {0.25, 0.25, 0.25, 0.25};
          if (triangle) e.weight = {1.0 / 3, 1.0 / 3, 1.0 / 3, 0};
        }
      }
      first += members;
    }
  }
}

std::vector<double> element_averages(const Mesh& mesh, const std::vector<std::uint8_t>& covered,
                                     const std::vector<double>& values) {
  std::vector<double> averages(mesh.elements.size());
  for (const Patch& patch : mesh.patches) {
    const std::uint32_t end = patch.first_element + patch.elements;
    for (std::uint32_t first = patch.first_element; first < end;) {
      const std::uint32_t members = siblings(mesh.elements, first, end) ? 4 : 1;
      bool by_parent = members == 4;
      for (std::uint32_t e = first; e < first + members; ++e) by_parent &= exposed(mesh.elements[e], covered);
      for (std::uint32_t e = first; e < first + members; ++e) {
        const Element& element = mesh.elements[e];
        if (!exposed(element, covered) || !even(mesh, element))
          averages[e] = by_own_weights(element, covered, values);
        else if (!by_parent)
          averages[e] = by_corners(element, values);
        else
          averages[e] = within_corners(element, values,
                                       element.vertex[3] == no_corner
                                           ? average_in_triangle(mesh.elements, first, e - first, values)
                                           : average_in_quad(mesh.elements, first, e - first, values));
      }
      first += members;
    }
  }
  return averages;
}

std::vector<double> vertex_areas(const Mesh& mesh, const std::vector<std::uint8_t>& covered) {
  std::vector<double> area(mesh.vertex_count(), 0);
  for (const Element& e : mesh.elements)
    for (std::size_t k = 0; k < 4; ++k)
      if (e.vertex[k] != 0xffffffffu && !covered[e.vertex[k]]) area[e.vertex[k]] += e.weight[k] * e.area_m2;
  return area;
}

}  // namespace clrad
