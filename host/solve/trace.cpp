#include "solve/trace.hpp"

#include <algorithm>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "solve/clip.hpp"
#include "solve/shooter.hpp"

namespace clrad {
namespace {

constexpr const char* emission = "solve/emit.cl";

// A column under way, and what of the state's scratch is its own.
struct Traced {
  Shooter shooter;
  std::uint32_t samples = 0;    // rays to a receiver
  std::uint32_t receivers = 0;  // that face the shooter: scratch.active
  std::uint32_t left = 0;       // of them, those in scratch.rest: undecided, or not clipped
  RealArray& column;
  ColumnScratch& scratch;
};

// How many each column has of something, which compact_on_device() counted. The host waits.
std::vector<std::uint32_t> counted(SolveState& state, std::size_t columns) {
  std::vector<std::uint32_t> words = state.counts.download(0, 2 * columns), result;
  for (std::size_t k = 0; k < columns; ++k) result.push_back(words[2 * k]);
  return result;
}

// The receivers from `first` on, neighbours in space one after another.
Array<std::uint32_t> order_from(SolveState& state, std::uint32_t first) {
  const std::uint32_t count = state.vertices - first;
  Array<std::uint32_t> order(state.device, state.vertices, "order of new receivers");
  state.device.run(emission, "newer", state.vertices, state.order, first, state.vertices, state.chosen);
  compact_on_device(state.device, state.chosen.buffer(), state.vertices, order.buffer(),
                    state.counts.buffer());
  state.device.run(emission, "receivers_at", count, order, state.order, count);
  return order;
}

// scratch.active: the receivers of each shooter's rays.
void emit(SolveState& state, std::vector<Traced>& all, std::uint32_t first, const DropFlags& also) {
  const auto stage = state.device.stage("emit rays to the receivers that face the shooter");
  const std::uint32_t count = state.vertices - first;
  Array<std::uint32_t> newer;
  if (first > 0) newer = order_from(state, first);
  const Array<std::uint32_t>& order = first > 0 ? newer : state.order;
  for (std::size_t k = 0; k < all.size(); ++k) {
    grow(all[k].scratch.active, state.device, count, "active receivers");
    facing(state.device, all[k].shooter, state.receivers, first, count, state.facing);
    if (also) also(state.facing);
    state.device.run(emission, "choose", count, state.facing, state.covered, order, first, count,
                     state.chosen);
    compact_on_device(state.device, state.chosen.buffer(), count, all[k].scratch.active.buffer(),
                      state.counts.buffer(), 8 * k);
  }
  const std::vector<std::uint32_t> receivers = counted(state, all.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k].receivers = receivers[k];
    state.device.run(emission, "receivers_at", receivers[k], all[k].scratch.active, order, receivers[k]);
  }
}

PointArray samples_for(SolveState& state, const ColumnTask& task, const Traced& t) {
  return PointArray(state.device, samples_on(t.shooter, task.patch, t.samples, state.options.seed),
                    "samples on the shooter");
}

void find_occluded(SolveState& state, const Traced& t, const PointArray& samples,
                   const Array<std::uint32_t>& active, std::uint32_t receivers) {
  const auto stage = state.device.stage("find which rays are occluded");
  const Segments rays{&state.receivers, &active, receivers, &samples, t.samples};
  grow(state.masks, state.device, std::uint64_t(receivers) * rays.words_per_origin(), "visibility masks");
  state.engine.occluded(rays, state.masks);
}

// scratch.factors: form factors of the whole shooter, at its receivers in their order.
void find_factors(SolveState& state, const Traced& t, const PointArray& samples) {
  grow(t.scratch.factors, state.device, t.receivers, "form factors");
  form_factors(state.device, state.options.estimator, t.shooter, state.receivers, &t.scratch.active,
               t.receivers, samples, t.samples, t.scratch.factors);
}

// column = form factor x visible fraction (x what glass lets pass). Those that no sample tells of: scratch.rest, counted on the device.
void weigh(SolveState& state, const Traced& t, const PointArray& samples, std::size_t k) {
  const auto stage = state.device.stage("weigh form factors by what is visible");
  find_factors(state, t, samples);
  visible_factors(state.device, state.options.estimator, t.shooter, state.receivers, &t.scratch.active,
                  t.receivers, samples, t.samples, state.masks, t.scratch.factors, t.column, state.glass,
                  state.chosen);
  grow(t.scratch.rest, state.device, t.receivers, "undecided receivers");
  compact_on_device(state.device, state.chosen.buffer(), t.receivers, t.scratch.rest.buffer(),
                    state.counts.buffer(), 8 * k);
}

void decide(SolveState& state, const Traced& t) {
  const auto stage = state.device.stage("weigh form factors by what is visible");
  decide_undecided(state.device, state.engine, t.shooter, state.receivers, &t.scratch.active, t.scratch.rest,
                   t.left, t.scratch.factors, t.column, state.glass);
}

// The same by samples where the shooter could not be clipped.
std::uint64_t sample_left(SolveState& state, const ColumnTask& task, const Traced& t) {
  state.device.run(emission, "receivers_at", t.left, t.scratch.rest, t.scratch.active, t.left);
  const PointArray samples = samples_for(state, task, t);
  find_occluded(state, t, samples, t.scratch.rest, t.left);
  const auto stage = state.device.stage("weigh form factors by what is visible");
  form_factors(state.device, state.options.estimator, t.shooter, state.receivers, &t.scratch.rest, t.left,
               samples, t.samples, t.scratch.factors);
  visible_factors(state.device, state.engine, state.options.estimator, t.shooter, state.receivers,
                  &t.scratch.rest, t.left, samples, t.samples, state.masks, t.scratch.factors, t.column,
                  state.glass);
  return std::uint64_t(t.left) * t.samples;
}

// column = form factor of the visible part. Those that have no room: scratch.rest, counted on the device.
void clip(SolveState& state, const Traced& t, std::size_t k) {
  const auto stage = state.device.stage("clip shooters to what is visible");
  find_factors(state, t, {});
  state.clip->visible_factors(t.shooter, state.receivers, t.scratch.active, t.receivers, t.scratch.factors,
                              t.column, state.chosen);
  grow(t.scratch.rest, state.device, t.receivers, "receivers left to samples");
  compact_on_device(state.device, state.chosen.buffer(), t.receivers, t.scratch.rest.buffer(),
                    state.counts.buffer(), 8 * k);
}

// The same where nothing can stand between.
void weigh_unoccluded(SolveState& state, const Traced& t, const PointArray* samples) {
  const auto stage = state.device.stage("weigh form factors where nothing is hidden");
  unoccluded_factors(state.device, state.options.estimator, t.shooter, state.receivers, t.scratch.active,
                     t.receivers, samples, t.samples, t.column);
}

// 0 at every receiver from `first` on.
void clear(SolveState& state, std::uint32_t first, RealArray& column) {
  const auto stage =
      state.device.stage(state.clip                       ? "clip shooters to what is visible"
                         : state.occlusion || state.glass ? "weigh form factors by what is visible"
                                                          : "weigh form factors where nothing is hidden");
  const std::uint64_t real = column.bytes() / column.size();
  for (std::uint32_t c = 0; c < state.colours; ++c)
    state.device.fill_bytes(column.buffer(), 0, (state.vertices - first) * real,
                            (std::uint64_t(c) * state.vertices + first) * real);
}

}  // namespace

std::uint64_t trace_columns(SolveState& state, std::span<const ColumnTask> tasks, std::uint32_t first,
                            const DropFlags& also) {
  if (first == state.vertices || tasks.empty()) return 0;
  const bool in_the_way = state.occlusion || state.glass;
  const bool exact = state.options.estimator == Estimator::exact;
  grow(state.counts, state.device, 2 * tasks.size(), "counts of receivers");
  if (state.scratch.size() < tasks.size()) state.scratch.resize(tasks.size());
  std::vector<Traced> all;
  for (std::size_t k = 0; k < tasks.size(); ++k)
    all.push_back({shooter_of(state.scene, state.mesh, tasks[k].patch, state.metres_per_unit),
                   samples_of(state, tasks[k].patch), 0, 0, *tasks[k].column, state.scratch[k]});
  emit(state, all, first, also);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Traced& t = all[k];
    clear(state, first, t.column);
    if (!in_the_way) {
      const PointArray samples = exact ? PointArray() : samples_for(state, tasks[k], t);
      weigh_unoccluded(state, t, exact ? nullptr : &samples);
    } else if (state.clip) {
      clip(state, t, k);
    } else {
      const PointArray samples = samples_for(state, tasks[k], t);
      find_occluded(state, t, samples, t.scratch.active, t.receivers);
      weigh(state, t, samples, k);
    }
  }
  std::uint64_t rays = 0;
  if (!in_the_way) return rays;
  const std::vector<std::uint32_t> left =
      exact ? counted(state, all.size()) : std::vector<std::uint32_t>(all.size(), 0);
  for (std::size_t k = 0; k < all.size(); ++k) {
    Traced& t = all[k];
    t.left = t.receivers > 0 ? left[k] : 0;
    if (state.clip) {
      state.clip->note(t.receivers, t.left);
      if (t.left > 0) rays += sample_left(state, tasks[k], t);
      continue;
    }
    if (t.left > 0) decide(state, t);
    // What the engine counts, without the wait that asking it costs; where nothing occludes it traces none.
    if (state.occlusion) rays += std::uint64_t(t.receivers) * t.samples;
  }
  return rays;
}

std::uint32_t columns_at_once(const SolveState& state, std::uint32_t first) {
  constexpr std::uint64_t bytes_of_vertex = 16, most = 64;
  const std::uint64_t of_column = bytes_of_vertex * std::max(1u, state.vertices - first);
  return std::uint32_t(std::clamp<std::uint64_t>(state.device.ledger()->limit / 64 / of_column, 1, most));
}

}  // namespace clrad
