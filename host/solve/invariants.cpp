#include "solve/invariants.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

// Worst unaccounted share of the emitted power that a closed scene may show at default mesh sizes, and worst reciprocity
// defect: both are discretisation, so these are limits of usefulness, not of rounding.
constexpr double energy_allowed = 0.05, reciprocity_allowed = 0.1;

void report(const SolveState& state, Solution& solution, const std::string& name, double worst,
            double allowed, const std::string& meaning) {
  const bool holds = worst <= allowed;  // false for NaN
  solution.report.invariants.push_back({name, worst, allowed, holds});
  if (holds) return;
  const std::string message =
      fmt::format("{}: {} is {:.3g}, more than {:.3g}", name, meaning, worst, allowed);
  if (state.options.strict) throw DeviceError(message + " (--strict)");
  solution.report.warnings.push_back(message);
}

}  // namespace

void account_energy(SolveState& state, Solution& solution) {
  auto& energy = solution.report.energy;
  energy.closed = state.enclosure.closed;
  const std::vector<double> unshot = state.unshot.download();
  const std::vector<double> by_lights = emitted_by_lights(state);
  double emitted_all = 0, unaccounted_all = 0;
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    double emitted = by_lights[b], absorbed = 0, left = 0;
    for (std::uint32_t p = 0; p < state.patches; ++p) {
      const Patch& patch = state.mesh.patches[p];
      const Material& m = state.scene.materials[state.scene.polygons[patch.polygon].material];
      const std::size_t i = std::size_t(b) * state.patches + p;
      emitted += patch.area_m2 * state.exposed[p] * m.emitted_exitance[b];
      // Of what meets glass, what it does not scatter may have passed: how much it absorbed is not known.
      if (!(state.through_glass && m.is_glass()))
        absorbed += patch.area_m2 * (1 - state.reflectance(b, p)) * solution.patch_irradiance[i];
      left += patch.area_m2 * state.exposed[p] * unshot[i];
      // Without interreflection, what is reflected goes no further.
      if (!state.interreflection)
        left += patch.area_m2 * state.reflectance(b, p) * solution.patch_irradiance[i];
    }
    energy.emitted.push_back(emitted);
    energy.absorbed.push_back(absorbed);
    energy.unshot.push_back(left);
    energy.unaccounted.push_back(emitted - absorbed - left);
    emitted_all += emitted;
    unaccounted_all += emitted - absorbed - left;
  }
  energy.unaccounted_relative = emitted_all > 0 ? unaccounted_all / emitted_all : 0;
}

void check_invariants(SolveState& state, Solution& solution) {
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  // Rounding of one factor, one compensated average and one sum over patches.
  const double rounding = state.device.options().precision == Precision::float64 ? 1e-12 : 1e-5;
  double over = 0, asymmetry = 0, exchanged = 0;
  const std::size_t rows = std::size_t(state.colours) * state.patches;
  std::vector<double> row(rows, 0);
  std::vector<std::vector<double>> sampled(slots);
  const std::uint32_t stride = std::max(1u, slots / 64);
  // As many columns at a time as are no burden on the host: each download is a wait.
  const auto at_once =
      std::uint32_t(std::max<std::size_t>(1, (std::size_t(1) << 20) / std::max<std::size_t>(1, rows)));
  for (std::uint32_t begin = 0; begin < slots; begin += at_once) {
    const std::uint32_t end = std::min(slots, begin + at_once);
    const auto columns = state.patch_columns.download(begin * rows, (end - begin) * rows);
    for (std::uint32_t s = begin; s < end; ++s) {
      const auto column = columns.begin() + std::ptrdiff_t((s - begin) * rows);
      for (std::size_t p = 0; p < rows; ++p) {
        row[p] += column[std::ptrdiff_t(p)];
        over = std::max({over, column[std::ptrdiff_t(p)] - 1, -column[std::ptrdiff_t(p)]});
      }
      if (s % stride == 0) sampled[s].assign(column, column + std::ptrdiff_t(rows));
    }
  }
  for (std::uint32_t s = 0; s < slots; s += stride)
    for (std::uint32_t t = 0; t < s; t += stride) {
      const std::uint32_t i = state.patch_of_slot[s], j = state.patch_of_slot[t];
      for (std::size_t c = 0; c < rows; c += state.patches) {
        const double ij = state.mesh.patches[i].area_m2 * sampled[t][c + i],
                     ji = state.mesh.patches[j].area_m2 * sampled[s][c + j];
        asymmetry += std::abs(ij - ji);
        exchanged += 0.5 * (ij + ji);
      }
    }
  report(state, solution, "form-factor-range", over, rounding, "the most a form factor is outside 0..1");
  if (exchanged > 0)
    report(state, solution, "reciprocity", asymmetry / exchanged, reciprocity_allowed,
           "sum |A_i F_ij - A_j F_ji| / sum A_i F_ij over a sample of patches");
  double most = 0, defect = 0;
  for (const double sum : row) most = std::max(most, sum);
  // Of what is exposed, by area: next to what stands on a patch single rows can be off by much more.
  double area = 0;
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    if (!(state.exposed[p] > 0)) continue;
    const double share = state.mesh.patches[p].area_m2 * state.exposed[p];
    defect += share * std::abs(1 - row[p] / state.exposed[p]), area += share;
  }
  if (area > 0) defect /= area;
  report(state, solution, "row-sum-at-most-one", most - 1, 0.02 + rounding,
         "the most a row sum of form factors exceeds 1");
  if (solution.report.energy.closed && slots == state.patches)
    report(state, solution, "closed-row-sum", defect, 0.05,
           "the area mean of |1 - row sum| of a closed scene");
  if (solution.report.energy.closed)
    report(state, solution, "energy", std::abs(solution.report.energy.unaccounted_relative), energy_allowed,
           "unaccounted power / emitted power");
}

}  // namespace clrad
