#include "solve/shoot.hpp"

#include "clrad/primitives.hpp"
#include "solve/shooter.hpp"

namespace clrad {
namespace {

constexpr const char* deliver = "solve/deliver.cl";

template <class ArrayType>
void grow(ArrayType& array, Device& device, std::uint64_t count, const char* what) {
  if (array.size() < count || !array.buffer()()) array = ArrayType(), array = ArrayType(device, count, what);
}

// Which receivers the shooter's rays go to: state.active, and how many.
std::uint32_t emit(SolveState& state, const Shooter& shooter) {
  const auto stage = state.device.stage("emit rays to the receivers that face the shooter");
  facing(state.device, shooter, state.receivers, state.vertices, state.facing);
  state.device.run("solve/emit.cl", "drop_covered", state.vertices, state.facing, state.covered,
                   state.vertices);
  return compact(state.device, state.facing.buffer(), state.vertices, state.active.buffer());
}

void find_occluded(SolveState& state, const PointArray& samples, std::uint32_t n, std::uint32_t receivers) {
  const auto stage = state.device.stage("find which rays are occluded");
  const Segments rays{&state.receivers, &state.active, receivers, &samples, n};
  grow(state.masks, state.device, std::uint64_t(receivers) * rays.words_per_origin(), "visibility masks");
  state.engine.occluded(rays, state.masks);
}

// state.column = form factor x visible fraction at every receiver; 0 where nothing arrives.
void weigh(SolveState& state, const Shooter& shooter, const PointArray& samples, std::uint32_t n,
           std::uint32_t receivers) {
  const auto stage = state.device.stage("weigh form factors by what is visible");
  state.column.fill_zero();
  form_factors(state.device, state.options.estimator, shooter, state.receivers, &state.active, receivers,
               samples, n, state.factors);
  visible_factors(state.device, state.engine, state.options.estimator, shooter, state.receivers,
                  &state.active, receivers, samples, n, state.masks, state.factors, state.column);
}

// The column of one patch, from nothing, into state.column.
void trace_column(SolveState& state, std::uint32_t patch) {
  const Shooter shooter = shooter_of(state.scene, state.mesh, patch, state.metres_per_unit);
  const std::uint32_t n = samples_of(state, patch);
  const PointArray samples(state.device, samples_on(shooter, patch, n, state.options.seed),
                           "samples on the shooter");
  const std::uint32_t receivers = emit(state, shooter);
  find_occluded(state, samples, n, receivers);
  weigh(state, shooter, samples, n, receivers);
}

void deliver_to_vertices(SolveState& state, const RealArray& column, const RealArray& shot,
                         std::uint32_t stride, std::uint32_t at) {
  const auto stage = state.device.stage("deliver light to the vertices");
  state.device.run(deliver, "deliver_to_vertices", state.vertices, column, shot, stride, at,
                   state.vertex_irradiance, state.vertex_irradiance_lost, state.vertices, state.bands);
}

void gather_column(SolveState& state, std::uint32_t slot) {
  const auto stage = state.device.stage("gather vertices to elements and patches");
  state.gatherer.gather(state.column, state.patch_columns, std::uint64_t(slot) * state.patches);
}

void account(SolveState& state, std::uint32_t slot) {
  const auto stage = state.device.stage("account for what is absorbed and unshot");
  state.device.run(deliver, "deliver_to_patches", state.patches, state.patch_columns,
                   std::uint64_t(slot) * state.patches, state.shot, state.patch_rho, state.patch_irradiance,
                   state.patch_irradiance_lost, state.unshot, state.unshot_lost, state.patches, state.bands);
}

void keep_column(SolveState& state) {
  auto kept = state.vertex_column();
  if (kept) state.device.copy(state.column.buffer(), kept->buffer(), state.column.bytes());
  state.vertex_columns.push_back(std::move(kept));
}

}  // namespace

void shoot(SolveState& state, std::uint32_t patch) {
  trace_column(state, patch);
  const std::uint32_t slot = state.add_slot(patch);
  state.device.run("solve/select.cl", "take_shot", state.bands, state.unshot, state.unshot_lost,
                   state.total_shot, state.shot, patch, state.patches, state.bands);
  deliver_to_vertices(state, state.column, state.shot, 1, 0);
  gather_column(state, slot);
  account(state, slot);
  keep_column(state);
  ++state.shoots;
}

void reshoot_kept(SolveState& state) {
  const auto stage = state.device.stage("shoot again from kept columns");
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  grow(state.shot_by_slot, state.device, std::uint64_t(state.bands) * slots, "shots by slot");
  state.device.run("solve/select.cl", "take_shots", state.patches, state.unshot, state.unshot_lost,
                   state.total_shot, state.pending, state.slot_of_patch_device, state.shot_by_slot, slots,
                   state.patches, state.bands);
  state.device.run(deliver, "deliver_kept", std::uint64_t(state.patches) * state.bands, state.patch_columns,
                   state.patches, state.shot_by_slot, slots, state.patch_rho, state.patch_irradiance,
                   state.patch_irradiance_lost, state.unshot, state.unshot_lost, state.patches, state.bands);
  state.reshoots += slots;
}

void deliver_pending(SolveState& state) {
  const std::vector<double> pending = state.pending.download();
  for (std::uint32_t slot = 0; slot < state.patch_of_slot.size(); ++slot) {
    const std::uint32_t patch = state.patch_of_slot[slot];
    bool any = false;
    for (std::uint32_t b = 0; b < state.bands; ++b)
      any |= pending[std::size_t(b) * state.patches + patch] != 0;
    if (!any) continue;
    const RealArray* column = state.vertex_columns[slot].get();
    if (!column) trace_column(state, patch), column = &state.column;
    deliver_to_vertices(state, *column, state.pending, state.patches, patch);
  }
  state.pending.fill_zero();
}

}  // namespace clrad
