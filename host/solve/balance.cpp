#include "solve/balance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "solve/krylov.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

constexpr const char* balance_kernels = "solve/balance.cl";
// Steps of one GMRES cycle: closed rooms take about ten.
constexpr std::uint32_t most_steps = 40;
// The cycle goes on past convergence by this much, since a step is cheap against the shots before.
constexpr double beyond = 0.01;
// Asked for less, columns of dark patches are not traced for their rows' sake.
constexpr double converges_well = 0.01;
// A row that sees less than this of its hemisphere is of a patch that faces out of the enclosure (the underside of a block
// on a floor): nothing says what it lacks. A point on the foot of a wall that stands on its polygon sees a half: the wall, whose
// plane it is in, is missing. (CLRAD_LEAST_ROW of balance.cl.)
constexpr double least_row = 0.25;

// Row sums over the exposed part, [colour][patch]; NaN where nothing is exposed.
std::vector<double> exposed_row_sums(const SolveState& state) {
  std::vector<double> sums(state.row_sum.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double share = state.exposed[i % state.patches];
    sums[i] = share > 0 ? state.row_sum[i] / share : NAN;
  }
  return sums;
}

bool all_traced(const SolveState& state) {
  for (std::uint32_t p = 0; p < state.patches; ++p)
    if (state.exposed[p] > 0 && state.slot_of_patch[p] == 0xffffffffu) return false;
  return true;
}

struct Mean {
  double sum = 0, area = 0, worst = 0;
  void add(double value, double of_area) {
    sum += value * of_area, area += of_area, worst = std::max(worst, value);
  }
  double mean() const { return area > 0 ? sum / area : 0; }
};

// What is known to be wrong with each row, as a share of it. In a closed scene, by how much its sum is not 1. Elsewhere by
// how much the row sum differs from the same sum by reciprocity, which other rays and other points found. [colour][patch].
std::vector<double> row_defects(SolveState& state, bool closed) {
  const std::vector<double> sums = exposed_row_sums(state);
  std::vector<double> defect(sums.size(), 0);
  if (closed) {
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (sums[i] >= least_row) defect[i] = std::abs(1 - sums[i]);
    return defect;
  }
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  std::vector<double> area;
  for (const Patch& p : state.mesh.patches) area.push_back(p.area_m2);
  const RealArray area_device(state.device, area, "patch areas");
  const std::uint32_t colours = state.colours;
  RealArray reciprocal(state.device, std::uint64_t(slots) * colours, "row sums");
  state.device.run(balance_kernels, "reciprocal_sums", reciprocal.size(), state.patch_columns, colours,
                   state.patch_of_slot_device, state.slot_of_patch_device, slots, area_device, reciprocal,
                   state.patches);
  const std::vector<double> other = reciprocal.download();
  for (std::uint32_t s = 0; s < slots; ++s) {
    const std::uint32_t p = state.patch_of_slot[s];
    for (std::uint32_t c = 0; c < colours && state.exposed[p] > 0; ++c) {
      const std::size_t i = std::size_t(c) * state.patches + p;
      defect[i] = std::abs(sums[i] - other[std::size_t(s) * colours + c] / state.exposed[p]);
    }
  }
  return defect;
}

}  // namespace

bool is_closed_row(const SolveState& state, std::uint32_t patch) {
  const double share = state.exposed[patch];
  return state.balanced && share > 0 && state.row_sum[patch] >= least_row * share;
}

void set_up_rows(SolveState& state) {
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  if (state.rows_of_slots == slots) return;
  state.rows_of_slots = slots;
  const std::size_t count = std::size_t(state.bands) * state.patches;
  if (state.loss.size() == 0) {
    state.loss = RealArray(state.device, count, "the balance of patches");
    state.coupling = RealArray(state.device, count, "the balance of patches");
    state.row_scale = RealArray(state.device, state.patches, "the balance of patches");
  }
  const std::size_t rows = std::size_t(state.colours) * state.patches;
  RealArray sums(state.device, 2 * rows, "row sums");
  state.device.run(balance_kernels, "row_sums", rows, state.patch_columns, state.colours, slots, sums,
                   state.patches);
  const std::vector<double> halves = sums.download();
  state.row_sum.assign(rows, 0);
  for (std::size_t i = 0; i < rows && slots > 0; ++i) state.row_sum[i] = halves[i] + halves[rows + i];
  std::vector<double> loss(count), coupling(count), scale(state.patches, 1);
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    const double share = state.exposed[p];
    const bool close = is_closed_row(state, p);
    if (close) scale[p] = share / state.row_sum[p];
    for (std::uint32_t b = 0; b < state.bands; ++b) {
      const std::size_t i = std::size_t(b) * state.patches + p;
      const double sum = state.row_sum[i % rows];
      const double rho = state.reflectance(b, p);
      loss[i] = share > 0 ? 1 - rho + (close ? 0 : rho * (share - sum) / share) : 1;
      coupling[i] = share > 0 ? rho / share * scale[p] : 0;
    }
  }
  state.loss.upload(loss), state.coupling.upload(coupling), state.row_scale.upload(scale);
}

double largest_reflectance(const Scene& scene) {
  double most = 0;
  for (const Material& m : scene.materials)
    for (const double rho : m.reflectance)
      if (m.texture == no_texture) most = std::max(most, rho);
  return most;
}

bool closes_rows(double reflectance, const SolveOptions& options, bool closed) {
  const bool much = options.closure == Closure::on || reflectance >= reflects_much;
  return options.closure == Closure::on ||
         (options.closure == Closure::automatic && closed && (much || options.converge <= converges_well));
}

void decide_closing(SolveState& state) {
  // What rows lack matters where it is reflected on. Where light passes glass, they lack what that takes.
  if (!state.interreflection || state.through_glass) return;
  double most = largest_reflectance(state.scene);
  if (state.textured)
    for (const double rho : state.textured->patch) most = std::max(most, rho);
  state.closes_rows = closes_rows(most, state.options, state.enclosure.closed);
  state.closes_vertices =
      state.closes_rows && (state.options.closure == Closure::on || most >= reflects_much);
}

bool can_close_rows(const SolveState& state) {
  return state.closes_rows && !state.balanced;
}

bool close_rows(Run& run, double unshot_relative) {
  SolveState& state = run.state;
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    if (state.exposed[p] <= 0 || state.slot_of_patch[p] != 0xffffffffu) continue;
    if (!run.goes_on(unshot_relative)) return false;
    trace(state, p);
  }
  state.balanced = true;
  state.rows_of_slots = 0xffffffffu;
  restate(state);
  return true;
}

bool solve_kept(Run& run, double unshot_relative) {
  SolveState& state = run.state;
  const auto stage = state.device.stage("solve the linear system of kept columns");
  set_up_rows(state);
  double area = 0;
  for (std::uint32_t p = 0; p < state.patches; ++p) area += state.mesh.patches[p].area_m2 * state.exposed[p];
  // The mean of |residual| is at most its root mean square.
  const double size = state.emitted_power / area, goal = beyond * state.options.converge * size / state.bands;
  const bool doubles = state.device.options().precision == Precision::float64;
  RealArray correction(state.device, std::uint64_t(state.bands) * state.patches, "a correction");
  bool goes_on = true;
  solve_by_gmres(state, state.unshot, correction, size, goal, doubles ? 1e-12 : 1e-5, most_steps,
                 [&](double left) { return goes_on = run.goes_on(unshot_relative * left); });
  if (!goes_on) {
    run.solution.unshot_relative = unshot_relative;
    return false;
  }
  state.device.run(balance_kernels, "correct", correction.size(), correction, state.total_shot,
                   state.total_shot_lo, state.pending, std::uint32_t(correction.size()));
  state.reshoots += state.patch_of_slot.size();
  restate(state);
  return true;
}

void restate(SolveState& state) {
  set_up_rows(state);
  {
    const auto stage = state.device.stage("account for what is absorbed and unshot");
    state.device.run(balance_kernels, "balance", std::uint64_t(state.patches) * state.bands,
                     state.patch_columns, state.colours, state.patch_of_slot_device,
                     std::uint32_t(state.patch_of_slot.size()), state.total_shot, state.total_shot_lo,
                     state.patch_emitted, state.loss, state.coupling, state.row_scale, state.patch_irradiance,
                     state.patch_irradiance_lost, state.unshot, state.unshot_lost, state.patches,
                     state.bands);
  }
  add_direct_to_patches(state);
}

void close_vertices(SolveState& state) {
  if (!state.balanced || !state.closes_vertices) return;
  hold_direct(state);
  const auto stage = state.device.stage("deliver light to the vertices");
  state.device.run(balance_kernels, "close_vertices", state.vertices, state.vertex_irradiance,
                   state.vertex_row_sum, state.covered, state.vertices, state.bands);
}

double mean_row_sum(const SolveState& state) {
  if (state.row_sum.empty() || !all_traced(state)) return NAN;
  const std::vector<double> sums = exposed_row_sums(state);
  Mean mean;
  for (std::uint32_t p = 0; p < state.patches; ++p)
    if (sums[p] >= least_row)
      mean.add(std::min(1.0, sums[p]), state.mesh.patches[p].area_m2 * state.exposed[p]);
  return mean.area > 0 ? mean.mean() : NAN;
}

void judge_rows(SolveState& state, Solution& solution) {
  auto& closure = solution.report.closure;
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  closure.proven = state.enclosure.closed;
  closure.reason = state.enclosure.reason;
  closure.applied = state.balanced;
  if (slots == 0 || !(state.emitted_power > 0)) return;
  const auto stage = state.device.stage("judge the rows of the linear system");
  set_up_rows(state);
  const bool closed = state.closes_rows || state.enclosure.closed;
  if (closed && !all_traced(state)) return;  // row sums are not known
  const std::vector<double> defect = row_defects(state, closed), sums = exposed_row_sums(state),
                            total = state.total_shot.download(), scale = state.row_scale.download();
  Mean before, after;
  std::vector<double> wrong(total.size());
  const std::size_t rows = sums.size();
  double wrong_power = 0, power = 0;
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    const double area = state.mesh.patches[p].area_m2 * state.exposed[p];
    if (!(area > 0)) continue;
    const auto left = [&](std::size_t row) {
      return is_closed_row(state, p) ? std::abs(1 - scale[p] * sums[row]) : defect[row];
    };
    for (std::size_t row = p; row < rows; row += state.patches)
      before.add(defect[row], area), after.add(left(row), area);
    for (std::uint32_t b = 0; b < state.bands; ++b) {
      const std::size_t i = std::size_t(b) * state.patches + p;
      if (state.slot_of_patch[p] == 0xffffffffu) continue;
      wrong[i] = state.reflectance(b, p) * left(i % rows) * std::abs(total[i]);
      wrong_power += area * wrong[i], power += area * total[i];
    }
  }
  closure.defect_before = before.mean(), closure.worst_defect_before = before.worst;
  closure.defect_after = after.mean(), closure.worst_defect_after = after.worst;
  // What these errors do to radiosity: they are light that comes or goes, and is reflected on like any other.
  // Where the answer is less than nothing, rows reflect more than they receive.
  double most = power > 0 ? 0 : INFINITY;
  if (wrong_power > 0 && power > 0) {
    const RealArray source(state.device, wrong, "defects");
    RealArray effect(state.device, wrong.size(), "defects");
    double area = 0;
    for (std::uint32_t p = 0; p < state.patches; ++p)
      area += state.mesh.patches[p].area_m2 * state.exposed[p];
    const double left = solve_by_gmres(state, source, effect, wrong_power / area, 0, 1e-3, 2 * most_steps);
    const std::vector<double> moved = effect.download();
    double moved_power = 0;
    for (std::size_t i = 0; i < moved.size(); ++i)
      moved_power +=
          state.mesh.patches[i % state.patches].area_m2 * state.exposed[i % state.patches] * moved[i];
    const bool sound = left < 0.1 && moved_power >= 0;
    // The system at hand has the defects in it. If they lose light, it amplifies less than the one without: of 1 / (loss +
    // defect) the share m = defect / (loss + defect) is moved, and without the defect it would be defect / loss.
    const double share = moved_power / power;
    most = sound && share < 1 ? share / (1 - share) : INFINITY;
    closure.amplification = most * power / wrong_power;
  }
  closure.amplified_defect = most;
  const bool stalled = !solution.stopped && !(solution.unshot_relative < state.options.converge);
  closure.converges = most <= 1 && !stalled;
  if (closure.converges) return;
  const std::string message = fmt::format(
      "cannot claim convergence: {}; finer patches or more samples make rows more exact{}",
      stalled
          ? fmt::format("the solve came to a stand with {:.3g} of the light unshot", solution.unshot_relative)
          : fmt::format("row sums of form factors are off by {:.3g} on average, which reflections amplify to "
                        "{:.3g} of the radiosity",
                        after.mean(), most),
      closure.proven
          ? ", and --closure auto closes them"
          : fmt::format(", and if the scene is closed --closure on does (not proven: {})", closure.reason));
  if (state.options.strict) throw DeviceError(message + " (--strict)");
  solution.report.warnings.push_back(message);
}

}  // namespace clrad
