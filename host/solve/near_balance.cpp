#include "solve/near_balance.hpp"

#include <algorithm>
#include <cmath>

#include "solve/balance.hpp"
#include "solve/krylov.hpp"
#include "solve/shoot.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* near_balance_kernels = "solve/near_balance.cl";
// What moves is some hundredths of all light: about what floats round.
constexpr double settled = 1e-6;
constexpr std::uint32_t settling_steps = 40;

// The part of the surfaces that each vertex stands for, in its elements' averages [m^2]. What falls on glass is none of it: it goes
// through, and falls on others.
std::vector<double> vertex_areas(const SolveState& state) {
  std::vector<bool> clear(state.scene.polygons.size(), false);
  if (state.through_glass)
    for (const std::uint32_t polygon : glass_polygons(state.scene)) clear[polygon] = true;
  std::vector<double> area(state.vertices, 0);
  for (const Element& e : state.mesh.elements) {
    if (clear[state.mesh.patches[e.patch].polygon]) continue;
    for (std::size_t k = 0; k < 4; ++k)
      if (e.vertex[k] != 0xffffffffu) area[e.vertex[k]] += e.weight[k] * e.area_m2;
  }
  return area;
}

double greatest(const std::vector<double>& v) {
  double most = 0;
  for (const double x : v) most = std::max(most, std::abs(x));
  return most;
}

}  // namespace

bool settles_near_field(const SolveState& state) {
  double most = 0;
  for (std::uint32_t b = 0; b < state.bands; ++b)
    for (std::uint32_t p = 0; p < state.patches; ++p) most = std::max(most, state.reflectance(b, p));
  return state.interreflection && most < reflects_much;
}

NearBalance::NearBalance(SolveState& state)
    : state_(state),
      gains_(state.device, std::uint64_t(state.bands) * state.vertices, "near field of a patch"),
      area_(state.device, vertex_areas(state), "areas of vertices"),
      in_strips_(state.device, std::uint64_t(state.patch_of_slot.size()) * state.bands * strips,
                 "near fields"),
      touched_(state.device, (state.vertices + block() - 1) / block(), "near field of a patch") {
  gains_.fill_zero();
  touched_.fill_zero();
}

void NearBalance::take(std::uint32_t slot) {
  state_.device.run(near_balance_kernels, "gains_in_strips", std::uint64_t(strips) * state_.bands, gains_,
                    touched_, block(), stamp_of(slot), area_, in_strips_, slot, strips, state_.vertices,
                    state_.bands);
}

void NearBalance::settle(const RealArray& near) {
  const auto patches = state_.patches, bands = state_.bands;
  std::vector<double> exposed_area;
  for (std::uint32_t p = 0; p < patches; ++p)
    exposed_area.push_back(state_.mesh.patches[p].area_m2 * state_.exposed[p]);
  const RealArray area(state_.device, exposed_area, "patch areas");
  RealArray owed(state_.device, std::uint64_t(bands) * patches, "light that patches owe"),
      arrived(state_.device, owed.size(), "near field of patches");
  state_.device.run(near_balance_kernels, "owed_by_patches", owed.size(), in_strips_,
                    state_.slot_of_patch_device, area, strips, owed, patches, bands);
  for (std::uint32_t b = 0; b < bands; ++b)
    state_.gatherer->gather(near, arrived, std::uint64_t(b) * patches, std::uint64_t(b) * state_.vertices);
  std::vector<double> source = owed.download();
  const std::vector<double> at_patches = arrived.download();
  for (std::uint32_t b = 0; b < bands; ++b)
    for (std::uint32_t p = 0; p < patches; ++p)
      if (state_.exposed[p] > 0)
        source[std::size_t(b) * patches + p] +=
            state_.reflectance(b, p) / state_.exposed[p] * at_patches[std::size_t(b) * patches + p];
  const double scale = greatest(source);
  if (!(scale > 0) || !std::isfinite(scale)) return;
  set_up_rows(state_);
  RealArray sent(state_.device, source.size(), "light that is sent on");
  const double left = solve_by_gmres(state_, RealArray(state_.device, source, "light that patches owe"), sent,
                                     scale, 0, settled, settling_steps);
  if (!(left < 1)) return;  // a system that has no solution moves nothing either
  for (std::uint32_t slot = 0; slot < state_.patch_of_slot.size(); ++slot) {
    const std::uint32_t patch = state_.patch_of_slot[slot];
    const RealArray* column = state_.vertex_columns[slot].get();
    if (!column) column = &trace_some(state_, patch, 0, nullptr);
    deliver_column(state_, *column, sent, patch);
  }
}

}  // namespace clrad
