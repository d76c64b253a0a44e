// Everything that can light a point, for gathers: patches, then their elements.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"
#include "solve/form_factor.hpp"

namespace clrad {

/// Node i < patches is patch i, node patches + e is element e.
struct Nodes {
  std::vector<Point> corners;      // 4 a node
  std::vector<double> shooters;    // shooter_record() of each
  std::vector<double> radiosity;   // [band][node]
  std::vector<double> brightness;  // [node], bands summed
  std::vector<std::uint32_t> first_element;
};

/// [band][node], from vertex and patch irradiance: a node's radiosity is that of its exposed part.
std::vector<double> node_radiosity(const Solution& solution);
Nodes make_nodes(const Solution& solution);

}  // namespace clrad
