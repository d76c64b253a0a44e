#include "output/displayed.hpp"

namespace clrad {

Displayed::Displayed(const Solution& solution, bool ambient)
    : Displayed(solution, solution.textured.patch.empty() ? display_radiosity(solution, ambient)
                                                          : display_light(solution, ambient)) {}

Displayed::Displayed(const Solution& solution, std::vector<double> values)
    : vertices(solution.vertex_count()), radiosity(std::move(values)), edges(edges_of(solution.mesh)) {
  edge_count = edges.ends.size();
  bend = edge_bends(solution.mesh, edges, solution.vertex_covered, radiosity, solution.bands);
}

Displayed::Displayed(const Edges& of, std::size_t count, std::vector<double> values,
                     std::vector<double> bends)
    : vertices(count),
      edge_count(of.ends.size()),
      radiosity(std::move(values)),
      edges(of),
      bend(std::move(bends)) {}

double Displayed::at(std::uint32_t band, const Interpolant& where) const {
  double sum = 0;
  for (std::size_t k = 0; k < 8; ++k) sum += where.weight[k] * radiosity[band * vertices + where.vertex[k]];
  for (std::size_t k = 0; k < 8; ++k) {
    const std::uint32_t edge = edges.of_element[where.element][k];
    if (edge != 0xffffffffu) sum += where.bend_weight[k] * bend[band * edge_count + edge];
  }
  return sum;
}

}  // namespace clrad
