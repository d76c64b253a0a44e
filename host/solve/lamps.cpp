#include "solve/lamps.hpp"

#include "solve/shoot.hpp"

namespace clrad {

std::vector<std::uint32_t> lamps_of(const Solution& solution) {
  const std::size_t patches = solution.mesh.patches.size();
  double power = 0, area = 0;
  for (std::uint32_t p = 0; p < patches; ++p) {
    const Patch& patch = solution.mesh.patches[p];
    const Material& m = solution.material_of(patch.polygon);
    for (std::uint32_t b = 0; b < solution.bands; ++b)
      power += patch.area_m2 * (m.emitted_exitance[b] + solution.patch_reflectance(b, p) *
                                                            solution.patch_irradiance[b * patches + p]);
    area += patch.area_m2;
  }
  std::vector<std::uint32_t> lamps;
  for (std::uint32_t p = 0; p < solution.scene.polygons.size(); ++p) {
    double emitted = 0;
    for (const double e : solution.material_of(p).emitted_exitance) emitted += e;
    if (emitted > 0 && emitted * area >= lamp_contrast * power) lamps.push_back(p);
  }
  if (lamps.size() > most_lamps) lamps.clear();
  return lamps;
}

LampLight light_of_lamps(SolveState& state, const Solution& solution) {
  LampLight light{lamps_of(solution), {}, {}, state.interreflection};
  if (light.polygons.empty() && !state.direct) return light;
  const auto stage = state.device.stage("gather at sensors");
  const std::uint64_t count = std::uint64_t(state.bands) * state.vertices;
  RealArray direct(state.device, count, "light from lamps"), lost(state.device, count, "light from lamps");
  direct.fill_zero(), lost.fill_zero();
  std::vector<double> emitted(std::size_t(state.bands) * state.patches);
  std::vector<std::uint32_t> slots;
  for (const std::uint32_t polygon : light.polygons) {
    const PolygonMesh& of = state.mesh.polygons[polygon];
    for (std::uint32_t p = of.first_patch; p < of.first_patch + of.patches; ++p) {
      if (state.slot_of_patch[p] == 0xffffffffu) continue;
      slots.push_back(state.slot_of_patch[p]), light.patches.push_back(p);
      for (std::uint32_t b = 0; b < state.bands; ++b)
        emitted[std::size_t(b) * state.patches + p] = state.material(p).emitted_exitance[b];
    }
  }
  const RealArray exitance(state.device, emitted, "light from lamps");
  for (const std::uint32_t slot : slots) {
    const std::uint32_t patch = state.patch_of_slot[slot];
    const RealArray* column = state.vertex_columns[slot].get();
    if (!column) column = &trace_some(state, patch, 0, nullptr);
    state.device.run("solve/deliver.cl", "deliver_to_vertices", state.vertices, *column, state.colours,
                     exitance, state.patches, patch, direct, lost, 0u, state.vertices, state.bands);
  }
  if (state.balanced && state.closes_vertices)
    state.device.run("solve/balance.cl", "close_vertices", state.vertices, direct, state.vertex_row_sum,
                     state.covered, state.vertices, state.bands);
  light.vertex = direct.download();
  if (state.direct) {
    const std::vector<double> by_lights = state.direct->vertex.download();
    for (std::size_t i = 0; i < light.vertex.size(); ++i) light.vertex[i] += by_lights[i];
  }
  return light;
}

}  // namespace clrad
