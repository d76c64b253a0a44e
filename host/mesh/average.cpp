#include "mesh/average.hpp"

#include <glm/geometric.hpp>

namespace clrad {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

bool exposed(const Element& e, const std::vector<std::uint8_t>& covered) {
  for (const std::uint32_t v : e.vertex)
    if (v != none && covered[v]) return false;
  return true;
}

// Area per parameter area is the same all over; on other quads the interpolant's weights stay.
bool even(const Mesh& mesh, const Element& e) {
  if (e.vertex[3] == none) return true;
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
        const bool triangle = e.vertex[3] == none;
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

}  // namespace clrad
