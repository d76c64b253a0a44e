#include "viewfactors/integrate.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "viewfactors/cells.hpp"

namespace clrad {
namespace {

constexpr const char* file = "viewfactors/integrate.cl";
// As in the kernel file.
constexpr std::uint64_t cell_points = 25, cell_words = 6, piece_reals = 49, point_reals = 3, result_reals = 6;
// The error of a first cell, as a share of how much the integrand varies over it: where something may be hidden, and where
// all is smooth.
constexpr double unconfirmed_hidden = 0.1, unconfirmed_free = 1e-2;
// Of the highest null rules, the least that counts as error: where something may be hidden, and where all is smooth.
constexpr double least_hidden = 0.1, least_free = 0.02;
// Cells below this x the relative error asked for x the smaller area of the two are not looked at more closely at first.
constexpr double negligible = 1e-3;
constexpr std::uint64_t cells_at_once = 8192;  // without occluders

struct Cell {
  std::uint32_t part = 0, quad = 0;
  CellPlace place{};
  double value = 0, unsure = 0;
  double raw[2] = {0, 0}, error[2] = {0, 0},
         varies[2] = {0, 0};           // along u and v; raw: the rule's own estimate
  bool confirmed[2] = {false, false};  // some halving that way has been compared with the whole
  int child =
      -1;  // of a cell with this value and error, halved along u (0) or v (1); siblings follow each other
  double parent_value = 0, parent_error = 0;

  double total_error() const { return error[0] + error[1] + unsure; }
};

// The tasks as the kernels see them.
struct Tables {
  std::vector<std::uint32_t> pairs, occluders;
  std::vector<double> normals, occluder_reals, vertices, quads;
  std::vector<std::uint32_t> task_of;  // of each part

  std::uint32_t add(const Convex& polygon) {
    const auto first = std::uint32_t(vertices.size() / 3);
    for (const glm::dvec3& c : polygon) vertices.insert(vertices.end(), {c.x, c.y, c.z});
    return first;
  }
};

struct PairState {
  std::vector<Cell> cells;
  double value = 0, error = 0, unsure = 0;
  bool done = false;
};

class Integration {
 public:
  Integration(Device& device, const std::vector<PairTask>& tasks, const IntegrationLimits& limits,
              IntegrationCounts& counts)
      : device_(device), tasks_(tasks), limits_(limits), counts_(counts), states_(tasks.size()) {
    for (std::uint32_t t = 0; t < tasks.size(); ++t)
      for (const PairPart& part : tasks[t].parts) add(t, part);
    pairs_ = Array<std::uint32_t>(device, std::span<const std::uint32_t>(tables_.pairs), "pairs");
    occluders_ = Array<std::uint32_t>(device, some(tables_.occluders), "occluders of pairs");
    normals_ = RealArray(device, tables_.normals, "pairs");
    occluder_reals_ = RealArray(device, some(tables_.occluder_reals), "occluders of pairs");
    vertices_ = RealArray(device, tables_.vertices, "corners of pairs");
    quads_ = RealArray(device, tables_.quads, "receivers of pairs");
  }

  bool run(const std::function<bool()>& go_on) {
    while (!fresh_.empty()) {
      if (go_on && !go_on()) return false;
      evaluate(fresh_);
      for (const Cell& c : fresh_) states_[tables_.task_of[c.part]].cells.push_back(c);
      fresh_.clear();
      for (std::size_t t = 0; t < states_.size(); ++t) refine(states_[t], tasks_[t]);
      counts_.rounds++;
    }
    return true;
  }

  std::vector<PairIntegral> results() const {
    std::vector<PairIntegral> all;
    for (const PairState& s : states_)
      all.push_back({s.value, s.error, s.unsure, std::uint32_t(s.cells.size())});
    return all;
  }

 private:
  template <class T>
  static std::span<const T> some(std::vector<T>& values) {  // a kernel argument may not be an empty buffer
    if (values.empty()) values.push_back(T(0));
    return values;
  }

  void add(std::uint32_t task, const PairPart& part) {
    const auto index = std::uint32_t(tables_.task_of.size());
    tables_.task_of.push_back(task);
    const std::uint32_t first = tables_.add(part.shooter);
    const auto first_occluder = std::uint32_t(tables_.occluders.size() / 2);
    double whole = 0;
    glm::dvec3 middle(0);
    for (const Convex& r : part.receiver) whole += area_of(r), middle += area_of(r) * middle_of(r);
    middle /= whole;
    double reach = 0;
    for (const Convex& r : part.receiver) reach = std::max(reach, reach_of(r, middle));
    const double edge_on = device_.options().precision == Precision::float64 ? 1e-12 : 1e-5;
    for (const auto& o : part.occluders) {
      tables_.occluders.push_back(tables_.add(o.corner));
      tables_.occluders.push_back(std::uint32_t(o.corner.size()));
      tables_.occluder_reals.insert(tables_.occluder_reals.end(),
                                    {o.normal.x, o.normal.y, o.normal.z, glm::dot(o.normal, o.corner[0]),
                                     edge_on * (reach_of(o.corner, middle) + reach)});
    }
    const auto n = std::uint32_t(part.shooter.size());
    tables_.pairs.insert(tables_.pairs.end(),
                         {first, n, first_occluder, std::uint32_t(part.occluders.size())});
    const glm::dvec3& normal = part.receiver_normal;
    tables_.normals.insert(tables_.normals.end(), {normal.x, normal.y, normal.z});
    const CellGrading grading(part, negligible * limits_.relative * std::min(whole, area_of(part.shooter)));
    for (const Convex& r : part.receiver)
      for (const Quad& quad : quads_of(r)) {
        std::vector<CellPlace> places;
        grading.grade(quad, places);
        for (const CellPlace& place : places) {
          Cell cell;
          cell.part = index, cell.quad = std::uint32_t(tables_.quads.size() / 12);
          cell.place = place;
          fresh_.push_back(cell);
        }
        for (const auto& c : quad) tables_.quads.insert(tables_.quads.end(), {c.x, c.y, c.z});
      }
  }

  bool occluded(const Cell& cell) const { return tables_.pairs[4 * cell.part + 3] > 0; }

  // Values and errors of these cells. Those without occluders go first: they need no stacks.
  void evaluate(std::vector<Cell>& cells) {
    const auto middle =
        std::stable_partition(cells.begin(), cells.end(), [&](const Cell& c) { return !occluded(c); });
    const auto free = std::uint64_t(middle - cells.begin()), all = std::uint64_t(cells.size());
    std::vector<std::uint32_t> words;
    words.reserve(all * cell_words);
    for (const Cell& c : cells)
      words.insert(words.end(), {c.part, c.quad, c.place.u, c.place.v, c.place.level_u, c.place.level_v});
    const Array<std::uint32_t> list(device_, std::span<const std::uint32_t>(words), "cells");
    RealArray results(device_, result_reals * all, "cells");
    const std::uint64_t at_once = std::max<std::uint64_t>(1, limits_.points_at_once / cell_points);
    const std::uint64_t most =
        std::min(std::max(std::min(free, cells_at_once), std::min(all - free, at_once)), all);
    RealArray points(device_, most * cell_points * point_reals, "points of cells");
    evaluate(list, 0, free, cells_at_once, 0, points, results);
    evaluate(list, free, all, at_once, limits_.stack_pieces, points, results);
    const std::vector<double> found = results.download();
    for (std::uint64_t i = 0; i < all; ++i) {
      const double* r = found.data() + result_reals * i;
      Cell& c = cells[i];
      c.value = r[0], c.unsure = r[1];
      c.error[0] = c.raw[0] = r[2], c.error[1] = c.raw[1] = r[3];
      c.varies[0] = r[4], c.varies[1] = r[5];
    }
    for (std::uint64_t i = 0; i < all; ++i)
      if (cells[i].child >= 0) compare(cells[i], cells[i + 1]), ++i;
    // An estimate that no halving has confirmed counts only where little can be wrong.
    for (Cell& c : cells)
      for (int k = 0; k < 2; ++k)
        if (!c.confirmed[k])
          c.error[k] =
              std::max(c.error[k], c.varies[k] * (occluded(c) ? unconfirmed_hidden : unconfirmed_free));
    counts_.cells += all;
    counts_.points += all * cell_points;
  }

  void evaluate(const Array<std::uint32_t>& list, std::uint64_t from, std::uint64_t to, std::uint64_t at_once,
                std::uint32_t capacity, RealArray& points, RealArray& results) {
    const std::uint64_t wanted =
        std::max<std::uint64_t>(1, std::min(at_once, to - from) * cell_points * capacity * piece_reals);
    if (from < to && stack_.size() < wanted) {
      stack_ = RealArray();
      stack_ = RealArray(device_, wanted, "pieces of shooters");
    }
    for (std::uint64_t first = from; first < to; first += at_once) {
      const auto count = std::uint32_t(std::min(at_once, to - first));
      {
        const auto stage = device_.stage(capacity ? "factors of points to what they see"
                                                  : "factors of points that see everything");
        device_.run(file, "cell_points", count * cell_points, list, std::uint32_t(first),
                    std::uint32_t(count * cell_points), quads_, pairs_, normals_, occluders_, occluder_reals_,
                    vertices_, stack_, capacity, points);
      }
      const auto stage = device_.stage("sum cells");
      device_.run(file, "cell_sums", count, points, std::uint32_t(first), count,
                  Real{capacity ? least_hidden : least_free}, results);
    }
  }

  // Two siblings with their parent: if its estimate was too low, theirs are, too.
  static void compare(Cell& a, Cell& b) {
    const double moved = std::abs(a.parent_value - a.value - b.value);
    if (moved <= a.parent_error) return;
    // A kink's error falls by about 5 from halving to halving.
    a.error[a.child] = std::max(a.error[a.child], 0.2 * moved);
    b.error[b.child] = std::max(b.error[b.child], 0.2 * moved);
  }

  void refine(PairState& state, const PairTask& task) {
    if (state.done) return;
    state.value = state.error = state.unsure = 0;
    for (const Cell& c : state.cells) {
      state.value += c.value;
      state.error += c.total_error();
      state.unsure += c.unsure;
    }
    const double goal = std::max(limits_.relative * state.value, task.least);
    state.done = state.error <= goal || state.unsure > 0.5 * goal || state.cells.size() >= limits_.most_cells;
    if (state.done) return;
    const double most = goal / double(state.cells.size());
    std::vector<Cell> kept;
    const std::size_t before = fresh_.size();
    for (const Cell& c : state.cells) {
      const bool can[2] = {c.place.level_u < deepest_cell, c.place.level_v < deepest_cell};
      if (!(c.error[0] + c.error[1] > most) || (!can[0] && !can[1])) {
        kept.push_back(c);
        continue;
      }
      const bool along_v = can[1] && (c.error[1] > c.error[0] || !can[0]);
      for (const std::uint32_t which : {0u, 1u}) {
        Cell child;
        child.part = c.part, child.quad = c.quad;
        child.place = c.place.half(along_v, which);
        child.confirmed[0] = c.confirmed[0] || !along_v;
        child.confirmed[1] = c.confirmed[1] || along_v;
        child.child = along_v;
        child.parent_value = c.value;
        child.parent_error = c.raw[along_v] + c.unsure;
        fresh_.push_back(child);
      }
    }
    if (fresh_.size() == before)
      state.done = true;
    else
      state.cells = std::move(kept);
  }

  Device& device_;
  const std::vector<PairTask>& tasks_;
  const IntegrationLimits& limits_;
  IntegrationCounts& counts_;
  Tables tables_;
  std::vector<PairState> states_;
  std::vector<Cell> fresh_;
  Array<std::uint32_t> pairs_, occluders_;
  RealArray normals_, occluder_reals_, vertices_, quads_, stack_;
};

}  // namespace

std::uint64_t bytes_of(const PairPart& part) {
  std::uint64_t corners = part.shooter.size();
  for (const auto& o : part.occluders) corners += o.corner.size() + 4;
  return 24 * corners + 200 * part.receiver.size() + 100;
}

std::vector<PairIntegral> integrate(Device& device, const std::vector<PairTask>& tasks,
                                    const IntegrationLimits& limits, IntegrationCounts& counts,
                                    const std::function<bool()>& go_on) {
  if (std::all_of(tasks.begin(), tasks.end(), [](const PairTask& t) { return t.parts.empty(); }))
    return std::vector<PairIntegral>(tasks.size());
  Integration integration(device, tasks, limits, counts);
  if (!integration.run(go_on)) return {};
  return integration.results();
}

}  // namespace clrad
