// With u one rounding (2^-24 in float, 2^-53 in double), errors come in as follows.
//
// A factor. The exact estimator is good to phi of itself (kernels/shared/factor.cl, where each of its ways has a bound that
// is checked or a Gauss rule's error); the sampled ones are sums of n positive terms like the visible share. A sample's
// weight takes 8 roundings; blocks of 32 and the sum of the blocks add 32 + n / 32, above and below the line of the visible
// share; quotient and product 2: nu = (2 (32 + n / 32) + 18) u. Next to the horizon a weight's cosine, and by the
// receiver's rounded normal also the factor's, is off by some u absolutely: at most 12 u of the solid angle / pi, so 24 u
// over the hemisphere, of what the brightest patch brings.
// A column's mean over a patch: weights, products and sums of four corners, shares and a compensated sum: 13 u. The
// products F B and their compensated sum: 4 u. Coefficients of a row: 3 u.
//
// So a row's sum F B is off by at most epsilon (F B) + alpha B_max, epsilon = phi + nu + 20 u, alpha = 24 u. A closed row
// F / s has twice these relative errors, but its entries still sum to 1: they act on differences of radiosity only, as
// 2 epsilon sum F / s |B_i - B_j| + 2 alpha (B_max - B_min). Emission and the loss of a row are off by 2 u.
//
// What lights bring is off by what lights.cpp says, at every vertex and so in a patch's mean, which is one more row's sum.
//
// The patches' radiosities are solved in pairs until what is unshot, which counts as convergence, not as rounding. They
// are off by D = A^-1 (all that, reflected): A has positive diagonal and negative other elements and is diagonally
// dominant, so A^-1 is positive, and one more solve gives the bound. A vertex receives at most max D of it, and has a
// row's error of its own. Its near field multiplies radiosities of pieces, which are off like vertices, by a
// quotient of factors: three times the error and 4 phi more. What the patches that make it owe for it, and what is reflected of it
// (host/solve/near_balance.cpp), is off by as much of what they reflect, for what they emit is the same all over them, to patches that
// are near: by reciprocity the share of that is what it sees of them. One more solve bounds what patches send on; vertices get it
// like D.
#include "solve/rounding.hpp"

#include <algorithm>
#include <cmath>

#include "solve/balance.hpp"
#include "solve/krylov.hpp"
#include "solve/near_balance.hpp"
#include "solve/near_field.hpp"
#include "solve/shooter.hpp"

namespace clrad {
namespace {

// Products of two errors, and the accuracy of the solve for D.
constexpr double second_order = 1.1;

struct Errors {
  double relative, absolute, factor, unit;
};

Errors errors_of(const SolveState& state) {
  const bool doubles = state.device.options().precision == Precision::float64;
  const double u = doubles ? 0x1p-53 : 0x1p-24, factor = doubles ? 1e-12 : 1e-5;
  std::uint32_t most_samples = 1;
  for (const std::uint32_t patch : state.patch_of_slot)
    most_samples = std::max(most_samples, samples_of(state, patch));
  const double visible = (2 * (32 + most_samples / 32.0) + 18) * u;
  return {factor + visible + 20 * u, 24 * u, factor, u};
}

// What light from lights may be off by at any vertex, [band], and of each patch's mean, [band][patch].
struct LightErrors {
  std::vector<double> most, patch;
};
LightErrors light_errors(const SolveState& state, const Errors& error) {
  LightErrors e{std::vector<double>(state.bands, 0.0),
                std::vector<double>(std::size_t(state.bands) * state.patches, 0.0)};
  if (!state.direct) return e;
  const std::vector<double> direct = state.direct->vertex.download();
  std::vector<double> of_vertex(direct.size()), h(state.bands);
  for (std::size_t v = 0; v < state.vertices; ++v) {
    if (state.covered_on_host[v]) continue;
    for (std::size_t b = 0; b < state.bands; ++b) h[b] = direct[b * state.vertices + v];
    const auto bound = state.direct->lights.bound(state.mesh.receivers[v].position, h, error.unit);
    for (std::size_t b = 0; b < state.bands; ++b) {
      of_vertex[b * state.vertices + v] = bound[b];
      e.most[b] = std::max(e.most[b], bound[b]);
    }
  }
  for (const Element& element : state.mesh.elements)
    for (std::size_t b = 0; b < state.bands; ++b)
      for (std::size_t k = 0; k < 4; ++k)
        if (element.vertex[k] != 0xffffffffu) {
          double& most = e.patch[b * state.patches + element.patch];
          most = std::max(most, of_vertex[b * state.vertices + element.vertex[k]] +
                                    13 * error.unit * direct[b * state.vertices + element.vertex[k]]);
        }
  return e;
}

// max D of one band and its area mean of irradiance.
struct OfBand {
  double most = 0, brightest = 0, irradiance = 0;
};

// At each patch, what those send that have a near field at it; [band][patch].
std::vector<double> from_near_patches(SolveState& state, const std::vector<double>& radiosity) {
  const RealArray sent(state.device, radiosity, "near fields"),
      boxes(state.device, patch_boxes(state.mesh), "patch boxes"),
      reaches(state.device, near_field_reaches(state.mesh), "patch boxes");
  RealArray light(state.device, radiosity.size(), "near fields");
  state.device.run("solve/near_balance.cl", "from_near", light.size(), state.patch_columns, state.colours,
                   state.patch_of_slot_device, std::uint32_t(state.patch_of_slot.size()), boxes, reaches,
                   sent, light, state.patches, state.bands);
  return light.download();
}

// What near fields that are off make light that patches send on be off by, as a share of the mean irradiance, [band]; `bound`: of
// irradiance without them.
std::vector<double> moved_by_near_field(SolveState& state, const Solution& solution,
                                        const std::vector<OfBand>& bands, const std::vector<double>& bound,
                                        const Errors& error) {
  std::vector<double> moved(bands.size(), 0);
  if (!settles_near_field(state)) return moved;
  const std::uint32_t n = state.patches;
  std::vector<double> reflected(bands.size() * n, 0);
  for (std::size_t i = 0; i < reflected.size(); ++i) {
    const std::uint32_t of = std::uint32_t(i / n), p = std::uint32_t(i % n);
    if (state.exposed[p] > 0)
      reflected[i] = state.reflectance(of, p) *
                     (std::abs(solution.patch_irradiance[i]) / state.exposed[p] + bands[of].irradiance);
  }
  const std::vector<double> light = from_near_patches(state, reflected),
                            share = from_near_patches(state, std::vector<double>(reflected.size(), 1));
  std::vector<double> source(reflected.size(), 0);
  double most = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const std::uint32_t of = std::uint32_t(i / n), p = std::uint32_t(i % n);
    if (!(state.exposed[p] > 0)) continue;
    const double off = 2 * bound[of] + 4 * error.factor;
    source[i] = off / state.exposed[p] * (reflected[i] * share[i] + state.reflectance(of, p) * light[i]);
    most = std::max(most, source[i]);
  }
  if (!(most > 0)) return moved;
  RealArray effect(state.device, source.size(), "rounding");
  const double left =
      solve_by_gmres(state, RealArray(state.device, source, "rounding"), effect, most, 0, 1e-3, 80);
  const std::vector<double> sent = effect.download();
  for (std::size_t i = 0; i < sent.size(); ++i)
    if (bands[i / n].irradiance > 0)
      moved[i / n] =
          std::max(moved[i / n], left <= 1e-2 ? second_order * sent[i] / bands[i / n].irradiance : INFINITY);
  return moved;
}

}  // namespace

void bound_rounding(SolveState& state, Solution& solution) {
  if (state.patch_of_slot.empty() || !(state.emitted_power > 0)) return;
  const auto stage = state.device.stage("bound the rounding");
  set_up_rows(state);
  const Errors error = errors_of(state);
  const std::uint32_t n = state.patches;
  const std::size_t count = std::size_t(state.bands) * n;
  const std::vector<double> total = state.total_shot.download(), emitted = state.patch_emitted.download(),
                            loss = state.loss.download();
  RealArray spread(state.device, count, "differences of radiosity");
  state.device.run("solve/balance.cl", "spread", count, state.patch_columns, state.colours,
                   state.patch_of_slot_device, std::uint32_t(state.patch_of_slot.size()), state.total_shot,
                   state.total_shot_lo, state.coupling, spread, n, state.bands);
  const std::vector<double> differences = spread.download();

  const LightErrors lights = light_errors(state, error);
  std::vector<double> source(count, 0);
  std::vector<OfBand> bands(state.bands);
  double mean_source = 0, all_area = 0;
  bool amplifies = false;
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    const auto first = total.begin() + std::ptrdiff_t(std::size_t(b) * n);
    const auto [low, high] = std::minmax_element(first, first + n);
    bands[b].brightest = *high;
    double area = 0;
    for (std::uint32_t p = 0; p < n; ++p) {
      const std::size_t i = std::size_t(b) * n + p;
      const double share = state.mesh.patches[p].area_m2, rho = state.reflectance(b, p);
      bands[b].irradiance += share * solution.patch_irradiance[i], area += share;
      if (state.slot_of_patch[p] == 0xffffffffu) continue;
      const bool closed = is_closed_row(state, p);
      const double rows =
          closed ? 2 * error.relative * differences[i] + 2 * error.absolute * rho * (*high - *low)
                 : error.relative * std::max(0.0, total[i] - emitted[i]) + error.absolute * rho * *high;
      source[i] = rows + 2 * error.unit * (emitted[i] + std::abs(loss[i]) * std::abs(total[i])) +
                  (state.exposed[p] > 0 ? rho / state.exposed[p] * lights.patch[i] : 0);
      amplifies |= loss[i] < 0;
      mean_source += share * source[i], all_area += share;
    }
    bands[b].irradiance /= area;
  }
  bool bounded = !amplifies && std::isfinite(mean_source);
  if (bounded && mean_source > 0) {
    const RealArray source_device(state.device, source, "rounding");
    RealArray effect(state.device, count, "rounding");
    bounded = solve_by_gmres(state, source_device, effect, mean_source / all_area, 0, 1e-3, 80) <= 1e-2;
    const std::vector<double> moved = effect.download();
    for (std::size_t i = 0; i < count; ++i) bands[i / n].most = std::max(bands[i / n].most, moved[i]);
  }
  std::vector<double> bound(state.bands, 0);
  for (std::size_t of = 0; of < bands.size(); ++of) {
    const OfBand& b = bands[of];
    if (!(b.irradiance > 0)) continue;
    bound[of] =
        2 * error.relative + (2 * error.absolute * b.brightest + second_order * b.most) / b.irradiance;
  }
  if (state.options.near_field && bounded) {
    const std::vector<double> moved = moved_by_near_field(state, solution, bands, bound, error);
    for (std::size_t of = 0; of < bands.size(); ++of)
      bound[of] = 3 * bound[of] + 4 * error.factor + moved[of];
  }
  double worst = 0;
  for (std::size_t of = 0; of < bands.size(); ++of)
    if (bands[of].irradiance > 0)
      worst = std::max(worst, second_order * (bound[of] + lights.most[of] / bands[of].irradiance));
  solution.report.error.parts.push_back({"rounding", bounded ? worst : INFINITY, true});
}

}  // namespace clrad
