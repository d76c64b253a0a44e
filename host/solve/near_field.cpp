#include "solve/near_field.hpp"

#include <algorithm>
#include <cmath>

#include "solve/nodes.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t most_bands = 16;  // CLRAD_MOST_BANDS of near_field.cl
constexpr double reach_in_elements = 2;
// Work is receivers along a patch's border x its elements: with very large patches that would outgrow the solve.
constexpr std::uint32_t most_elements = 256;

// Radiosity of elements; negative where all corners are covered.
std::vector<double> element_radiosity(const Nodes& nodes, const Solution& solution) {
  const std::size_t patches = solution.mesh.patches.size(), elements = solution.mesh.elements.size();
  const std::size_t count = patches + elements;
  std::vector<double> radiosity(elements * solution.bands);
  for (std::size_t e = 0; e < elements; ++e) {
    const Element& element = solution.mesh.elements[e];
    const bool seen = std::any_of(element.vertex.begin(), element.vertex.end(), [&](std::uint32_t v) {
      return v != 0xffffffffu && !solution.vertex_covered[v];
    });
    for (std::uint32_t b = 0; b < solution.bands; ++b)
      radiosity[b * elements + e] = seen ? nodes.radiosity[b * count + patches + e] : -1;
  }
  return radiosity;
}

}  // namespace

void gather_near_field(SolveState& state, const Solution& solution) {
  if (state.bands > most_bands) return;
  const auto stage = state.device.stage("gather near patches by their elements");
  const Mesh& mesh = state.mesh;
  const Nodes nodes = make_nodes(solution);
  const auto patches = state.patches, elements = std::uint32_t(mesh.elements.size());
  std::vector<double> mean(nodes.radiosity.size() / (patches + elements) * patches),
      box(6 * std::size_t(patches));
  for (std::uint32_t b = 0; b < state.bands; ++b)
    std::copy_n(nodes.radiosity.begin() + std::ptrdiff_t(b) * (patches + elements), patches,
                mean.begin() + std::ptrdiff_t(b) * patches);
  for (std::uint32_t p = 0; p < patches; ++p)
    for (int a = 0; a < 3; ++a) {
      const Patch& patch = mesh.patches[p];
      double low = patch.corner[0][a], high = low;
      for (std::uint32_t k = 1; k < patch.corners; ++k)
        low = std::min(low, patch.corner[k][a]), high = std::max(high, patch.corner[k][a]);
      box[6 * p + std::size_t(a)] = low, box[6 * p + 3 + std::size_t(a)] = high;
    }
  const RealArray radiosity_device(state.device, element_radiosity(nodes, solution), "element radiosity");
  const RealArray mean_device(state.device, mean, "patch radiosity"),
      box_device(state.device, box, "patch boxes");
  const RealArray shooters(state.device,
                           std::span(nodes.shooters).subspan(std::size_t(patches) * shooter_record_size),
                           "elements");
  const double reach = reach_in_elements * mesh.element_edge_m / state.metres_per_unit;
  for (std::uint32_t slot = 0; slot < state.patch_of_slot.size(); ++slot) {
    if (!state.vertex_columns[slot]) continue;
    const std::uint32_t patch = state.patch_of_slot[slot];
    if (mesh.patches[patch].elements > most_elements) continue;
    state.device.run("solve/near_field.cl", "near_field", state.vertices, state.receivers,
                     *state.vertex_columns[slot], shooters, mesh.patches[patch].first_element,
                     mesh.patches[patch].elements, radiosity_device, elements, mean_device, state.total_shot,
                     patch, patches, box_device, Real{reach}, state.vertex_irradiance, state.vertices,
                     state.bands);
  }
}

}  // namespace clrad
