// Radiosity at any point of the surfaces, as pictures show it.
#pragma once
#include <vector>

#include "clrad/solution.hpp"
#include "mesh/bend.hpp"
#include "mesh/locate.hpp"

namespace clrad {

/// What is interpolated: values at vertices and what edges have besides. kernels/render/shade.cl reads the same.
struct Displayed {
  std::size_t vertices, edge_count;
  /// display_radiosity(), or in a solution with textures display_light() (or what was given), [band][vertex] [W/m^2 or lm/m^2].
  std::vector<double> radiosity;
  Edges edges;
  std::vector<double> bend;  ///< edge_bends(), [band][edge], the same unit

  explicit Displayed(const Solution& solution, bool ambient = false);
  /// The same of any values [band][vertex] on the solution's mesh.
  Displayed(const Solution& solution, std::vector<double> values);
  /// With bends that are known: [band][edge] of `edges`.
  Displayed(const Edges& edges, std::size_t vertices, std::vector<double> values, std::vector<double> bends);
  double at(std::uint32_t band, const Interpolant& where) const;
};

}  // namespace clrad
