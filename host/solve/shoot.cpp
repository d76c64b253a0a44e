#include "solve/shoot.hpp"

#include <algorithm>

#include "device/grow.hpp"
#include "solve/trace.hpp"

namespace clrad {
namespace {

constexpr const char* deliver = "solve/deliver.cl";

std::uint64_t trace_column(SolveState& state, std::uint32_t patch, std::uint32_t first, RealArray& column,
                           const DropFlags& also = nullptr) {
  const ColumnTask task{patch, &column};
  return trace_columns(state, {&task, 1}, first, also);
}

void deliver_to_vertices(SolveState& state, const RealArray& column, const RealArray& shot,
                         std::uint32_t stride, std::uint32_t at, std::uint32_t first = 0) {
  const auto stage = state.device.stage("deliver light to the vertices");
  state.device.run(deliver, "deliver_to_vertices", state.vertices - first, column, state.colours, shot,
                   stride, at, state.vertex_irradiance, state.vertex_irradiance_lost, first, state.vertices,
                   state.bands);
}

void gather_column(SolveState& state, const RealArray& column, std::uint32_t slot) {
  const auto stage = state.device.stage("gather vertices to elements and patches");
  for (std::uint32_t c = 0; c < state.colours; ++c)
    state.gatherer->gather(column, state.patch_columns,
                           (std::uint64_t(slot) * state.colours + c) * state.patches,
                           std::uint64_t(c) * state.vertices);
}

void account(SolveState& state, std::uint32_t slot, std::uint32_t stride, std::uint32_t at) {
  if (!state.interreflection) return;  // gather_direct() says at the end what arrived
  const auto stage = state.device.stage("account for what is absorbed and unshot");
  state.device.run(deliver, "deliver_to_patches", state.patches, state.patch_columns,
                   std::uint64_t(slot) * state.colours * state.patches, state.colours, state.shot, stride, at,
                   state.patch_rho, state.patch_irradiance, state.patch_irradiance_lost, state.unshot,
                   state.unshot_lost, state.patches, state.bands);
}

// Once for each column, at the vertices from `first` on.
void add_to_row_sums(SolveState& state, const RealArray& column, std::uint32_t first = 0) {
  const auto stage = state.device.stage("gather vertices to elements and patches");
  const RealArray one(state.device, std::vector<double>{1}, "one");
  state.device.run(deliver, "deliver_to_vertices", state.vertices - first, column, 1u, one, 1u, 0u,
                   state.vertex_row_sum, state.vertex_row_sum_lost, first, state.vertices, 1u);
}

void keep_column(SolveState& state) {
  add_to_row_sums(state, state.column);
  auto kept = state.vertex_column();
  if (kept) state.device.copy(state.column.buffer(), kept->buffer(), state.column.bytes());
  state.vertex_columns.push_back(std::move(kept));
}

void take_shots(SolveState& state, std::span<const std::uint32_t> patches) {
  const auto count = std::uint32_t(patches.size());
  grow(state.shot, state.device, std::uint64_t(state.bands) * count, "shots");
  const Array<std::uint32_t> chosen(state.device, patches, "chosen patches");
  state.device.run("solve/select.cl", "take_shot", std::uint64_t(state.bands) * count, state.unshot,
                   state.unshot_lost, state.total_shot, state.shot, chosen, count, state.patches,
                   state.bands);
}

}  // namespace

void shoot(SolveState& state, std::span<const std::uint32_t> patches) {
  const auto stride = std::uint32_t(patches.size());
  take_shots(state, patches);
  for (std::uint32_t k = 0; k < stride; ++k) {
    trace_column(state, patches[k], 0, state.column);
    const std::uint32_t slot = state.add_slot(patches[k]);
    deliver_to_vertices(state, state.column, state.shot, stride, k);
    gather_column(state, state.column, slot);
    account(state, slot, stride, k);
    keep_column(state);
    ++state.shoots;
    ++state.shoots_since_refined;
  }
}

const RealArray& trace_some(SolveState& state, std::uint32_t patch, std::uint32_t first,
                            const std::function<void(Array<std::uint32_t>&)>& keep) {
  trace_column(state, patch, first, state.column, keep);
  return state.column;
}

void trace(SolveState& state, std::uint32_t patch) {
  trace_column(state, patch, 0, state.column);
  gather_column(state, state.column, state.add_slot(patch));
  keep_column(state);
  ++state.shoots;
  ++state.shoots_since_refined;
}

void reshoot_kept(SolveState& state) {
  const auto stage = state.device.stage("shoot again from kept columns");
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  grow(state.shot_by_slot, state.device, std::uint64_t(state.bands) * slots, "shots by slot");
  state.device.run("solve/select.cl", "take_shots", state.patches, state.unshot, state.unshot_lost,
                   state.total_shot, state.pending, state.slot_of_patch_device, state.shot_by_slot, slots,
                   state.patches, state.bands);
  state.reshoots += slots;
  if (state.balanced) return restate(state);
  state.device.run(deliver, "deliver_kept", std::uint64_t(state.patches) * state.bands, state.patch_columns,
                   state.colours, state.shot_by_slot, slots, state.patch_rho, state.patch_irradiance,
                   state.patch_irradiance_lost, state.unshot, state.unshot_lost, state.patches, state.bands);
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
    if (!column) trace_column(state, patch, 0, state.column), column = &state.column;
    deliver_to_vertices(state, *column, state.pending, state.patches, patch);
  }
  state.pending.fill_zero();
}

void deliver_column(SolveState& state, const RealArray& column, const RealArray& shot, std::uint32_t patch) {
  deliver_to_vertices(state, column, shot, state.patches, patch);
}

std::uint64_t shoot_to_new(SolveState& state, std::uint32_t first) {
  const auto slots = std::uint32_t(state.patch_of_slot.size());
  const std::uint32_t at_once = columns_at_once(state, first);
  std::uint64_t rays = 0;
  for (std::uint32_t begin = 0; begin < slots; begin += at_once) {
    const std::uint32_t end = std::min(begin + at_once, slots);
    std::vector<ColumnTask> tasks;
    for (std::uint32_t slot = begin; slot < end; ++slot)
      tasks.push_back({state.patch_of_slot[slot], &state.extend_column(slot)});
    rays += trace_columns(state, tasks, first);
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      const RealArray& column = *tasks[slot - begin].column;
      add_to_row_sums(state, column, first);
      deliver_to_vertices(state, column, state.total_shot, state.patches, state.patch_of_slot[slot], first);
      gather_column(state, column, slot);
    }
  }
  return rays;
}

void interpolate_to_new(SolveState& state, std::uint32_t first, const Array<std::uint32_t>& parents) {
  const auto stage = state.device.stage("interpolate new vertices");
  for (std::uint32_t slot = 0; slot < state.patch_of_slot.size(); ++slot) {
    RealArray& column = state.extend_column(slot);
    for (std::uint32_t c = 0; c < state.colours; ++c)
      state.device.run("solve/refine.cl", "interpolate_new", state.vertices - first, column,
                       std::uint64_t(c) * state.vertices, parents, first, state.vertices);
    add_to_row_sums(state, column, first);
    deliver_to_vertices(state, column, state.total_shot, state.patches, state.patch_of_slot[slot], first);
    gather_column(state, column, slot);
  }
}

void gather_direct(SolveState& state) {
  const auto stage = state.device.stage("gather vertices to elements and patches");
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    const std::uint64_t row = state.vertex_irradiance.bytes() / state.bands;
    state.device.copy(state.vertex_irradiance.buffer(), state.column.buffer(), row, b * row);
    state.gatherer->gather(state.column, state.patch_irradiance, std::uint64_t(b) * state.patches);
  }
}

void gather_row(SolveState& state, std::uint32_t patch) {
  state.device.run("solve/balance.cl", "gather_row", state.bands, state.patch_columns, state.colours,
                   state.patch_of_slot_device, std::uint32_t(state.patch_of_slot.size()), state.patch_emitted,
                   state.loss, state.coupling, state.total_shot, state.total_shot_lo, state.pending, patch,
                   state.patches, state.bands);
}

}  // namespace clrad
