#include "viewfactors/integrate.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "viewfactors/cells.hpp"
#include "viewfactors/cull.hpp"

namespace clrad {
namespace {

constexpr const char* integrate_kernels = "viewfactors/integrate.cl";
// As in the kernel file.
constexpr std::uint64_t cell_points = 25, piece_reals = 49, point_reals = 4, result_reals = 7;
constexpr std::uint64_t occluder_words = 5, side_words = 4, plane_reals = 5;
// The error of a first cell, as a share of how much the integrand varies over it: where something may be hidden, and where
// all is smooth.
constexpr double unconfirmed_hidden = 0.1, unconfirmed_free = 1e-2;
// The same as a share of what the cell would see without occluders: all its points may have missed a slit or a shadow.
constexpr double unconfirmed_missed = 1e-2;
// Of what halving a cell with occluders changed, the least that counts as error of the halves: rules of both may
// overlook the same kinks.
constexpr double least_of_change = 0.1;
// Of the highest null rules, the least that counts as error: where something may be hidden, and where all is smooth.
constexpr double least_part_hidden = 0.1, least_part_free = 0.02;
// Cells below this x the relative error asked for x the smaller area of the two are not looked at more closely at first.
constexpr double negligible = 1e-3;
constexpr std::uint64_t cells_at_once = 8192;  // without occluders

struct Cell {
  std::uint32_t part = 0, quad = 0;
  CellPlace place{};
  std::uint64_t first_occluder = 0;  // in Integration::lists_; of the cell it was halved from until culled
  std::uint32_t occluders = 0;       // or `hidden`
  double value = 0, unsure = 0, free = 0;
  double raw[2] = {0, 0}, error[2] = {0, 0},
         varies[2] = {0, 0};           // along u and v; raw: the rule's own estimate
  bool confirmed[2] = {false, false};  // some halving that way has been compared with the whole
  int child =
      -1;  // of a cell with this value and error, halved along u (0) or v (1); siblings follow each other
  double parent_value = 0, parent_error = 0;

  double total_error() const { return error[0] + error[1] + unsure; }
};

// The tasks as the kernels will see them.
struct Tables {
  std::vector<std::uint32_t> pairs, occluders, sides;
  std::vector<double> normals, planes, vertices, quads;
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
    on_device_.pairs = Array<std::uint32_t>(device, std::span<const std::uint32_t>(tables_.pairs), "pairs");
    on_device_.occluders = Array<std::uint32_t>(device, some(tables_.occluders), "occluders of pairs");
    on_device_.normals = RealArray(device, tables_.normals, "pairs");
    on_device_.sides = Array<std::uint32_t>(device, some(tables_.sides), "occluders of pairs");
    on_device_.planes = RealArray(device, some(tables_.planes), "occluders of pairs");
    on_device_.vertices = RealArray(device, tables_.vertices, "corners of pairs");
    on_device_.quads = RealArray(device, tables_.quads, "receivers of pairs");
  }

  void run(const std::function<bool()>& go_on) {
    while (!fresh_.empty()) {
      if (go_on && !go_on()) return;
      evaluate(fresh_);
      for (const Cell& c : fresh_) states_[tables_.task_of[c.part]].cells.push_back(c);
      fresh_.clear();
      for (std::size_t t = 0; t < states_.size(); ++t) refine(states_[t], tasks_[t]);
      counts_.rounds++;
    }
  }

  std::vector<PairIntegral> results() const {
    std::vector<PairIntegral> all;
    for (const PairState& s : states_)
      all.push_back({s.value, s.error, s.unsure, std::uint32_t(s.cells.size()), s.done});
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
    const std::uint64_t list = lists_.size();
    add_occluders(part);
    const auto n = std::uint32_t(part.shooter.size());
    tables_.pairs.insert(tables_.pairs.end(), {first, n});
    const glm::dvec3& normal = part.receiver_normal;
    tables_.normals.insert(tables_.normals.end(), {normal.x, normal.y, normal.z});
    double whole = 0;
    for (const Convex& r : part.receiver) whole += area_of(r);
    const CellGrading grading(part, negligible * limits_.relative * std::min(whole, area_of(part.shooter)));
    for (const Convex& r : part.receiver)
      for (const Quad& quad : quads_of(r)) {
        std::vector<CellPlace> places;
        grading.grade(quad, places);
        for (const CellPlace& place : places) {
          Cell cell;
          cell.part = index, cell.quad = std::uint32_t(tables_.quads.size() / 12);
          cell.place = place;
          cell.first_occluder = list, cell.occluders = std::uint32_t(lists_.size() - list);
          fresh_.push_back(cell);
        }
        for (const auto& c : quad) tables_.quads.insert(tables_.quads.end(), {c.x, c.y, c.z});
      }
  }

  // A list of them, bodies once.
  void add_occluders(const PairPart& part) {
    double whole = 0;
    glm::dvec3 middle(0);
    for (const Convex& r : part.receiver) whole += area_of(r), middle += area_of(r) * middle_of(r);
    middle /= whole;
    double reach = 0;
    for (const Convex& r : part.receiver) reach = std::max(reach, reach_of(r, middle));
    const double edge_on = device_.options().precision == Precision::float64 ? 1e-12 : 1e-5;
    const auto add_one = [&](const Convex& corner, std::uint32_t sides) {
      lists_.push_back(std::uint32_t(tables_.occluders.size() / occluder_words));
      tables_.occluders.insert(tables_.occluders.end(),
                               {tables_.add(corner), std::uint32_t(corner.size()),
                                std::uint32_t(tables_.planes.size() / plane_reals),
                                std::uint32_t(tables_.sides.size() / side_words), sides});
      return edge_on * (reach_of(corner, middle) + reach);
    };
    const auto add_plane = [&](const glm::dvec3& n, const glm::dvec3& on, double doubt) {
      tables_.planes.insert(tables_.planes.end(), {n.x, n.y, n.z, glm::dot(n, on), doubt});
    };
    std::vector<bool> listed(part.bodies.size());
    for (const auto& o : part.occluders) {
      if (o.body == Surface::no_body) {
        const double doubt = add_one(o.corner, 0);
        add_plane(o.normal, o.corner[0], doubt);
      } else if (!listed[o.body]) {
        listed[o.body] = true;
        const PairPart::Body& body = part.bodies[o.body];
        const double doubt = add_one(body.corner, std::uint32_t(body.side.size()));
        for (const auto& face : body.face) add_plane(face.normal, face.point, doubt);
        for (const auto& s : body.side)
          tables_.sides.insert(tables_.sides.end(), {s.from, s.to, s.face, s.neighbour});
      }
    }
  }

  static void add_words(const Cell& c, std::uint64_t first_occluder, std::vector<std::uint32_t>& words) {
    words.insert(words.end(), {c.part, c.quad, c.place.u, c.place.v, c.place.level_u, c.place.level_v,
                               std::uint32_t(first_occluder), c.occluders});
  }

  // Leaves each cell the occluders that matter to it, of those that mattered to the cell it was halved from.
  void cull(std::vector<Cell>& cells) {
    std::vector<std::uint32_t> words, list;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Cell& c = cells[i];
      if (c.occluders == 0) continue;
      of.push_back(i);
      add_words(c, list.size(), words);
      list.insert(list.end(), lists_.begin() + std::ptrdiff_t(c.first_occluder),
                  lists_.begin() + std::ptrdiff_t(c.first_occluder + c.occluders));
    }
    const std::vector<std::uint32_t> kept = cull_cells(device_, on_device_, words, list);
    for (std::size_t k = 0; k < of.size(); ++k) {
      Cell& c = cells[of[k]];
      const auto begin = list.begin() + words[cell_words * k + 6];
      c.occluders = kept[k];
      c.first_occluder = lists_.size();
      if (c.occluders != hidden) lists_.insert(lists_.end(), begin, begin + c.occluders);
    }
  }

  // Values and errors of these cells. Those without occluders go first: they need no stacks.
  void evaluate(std::vector<Cell>& cells) {
    cull(cells);
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < cells.size(); ++i)
      if (cells[i].occluders == 0) order.push_back(i);
    const auto free = std::uint64_t(order.size());
    for (std::size_t i = 0; i < cells.size(); ++i)
      if (cells[i].occluders > 0 && cells[i].occluders != hidden) order.push_back(i);
    const auto all = std::uint64_t(order.size());
    std::vector<std::uint32_t> words, occluders;
    words.reserve(all * cell_words);
    for (const std::size_t i : order) {
      const Cell& c = cells[i];
      add_words(c, occluders.size(), words);
      occluders.insert(occluders.end(), lists_.begin() + std::ptrdiff_t(c.first_occluder),
                       lists_.begin() + std::ptrdiff_t(c.first_occluder + c.occluders));
    }
    if (all > 0) evaluate(cells, order, free, words, occluders);
    for (std::size_t i = 0; i < cells.size(); ++i)
      if (cells[i].child >= 0) compare(cells[i], cells[i + 1]), ++i;
    // An estimate that no halving has confirmed counts only where little can be wrong.
    for (Cell& c : cells) {
      if (c.occluders == hidden) continue;
      for (int k = 0; k < 2; ++k) {
        if (c.confirmed[k]) continue;
        const double unknown = c.occluders > 0
                                   ? std::max(unconfirmed_hidden * c.varies[k], unconfirmed_missed * c.free)
                                   : unconfirmed_free * c.varies[k];
        c.error[k] = std::max(c.error[k], unknown);
      }
    }
    counts_.cells += all;
    counts_.points += all * cell_points;
  }

  void evaluate(std::vector<Cell>& cells, const std::vector<std::size_t>& order, std::uint64_t free,
                const std::vector<std::uint32_t>& words, std::vector<std::uint32_t>& occluders) {
    const auto all = std::uint64_t(order.size());
    const Array<std::uint32_t> list(device_, std::span<const std::uint32_t>(words), "cells");
    const Array<std::uint32_t> lists(device_, some(occluders), "occluders of cells");
    RealArray results(device_, result_reals * all, "cells");
    const std::uint64_t at_once = std::max<std::uint64_t>(1, limits_.points_at_once / cell_points);
    const std::uint64_t most =
        std::min(std::max(std::min(free, cells_at_once), std::min(all - free, at_once)), all);
    RealArray points(device_, most * cell_points * point_reals, "points of cells");
    evaluate(list, 0, free, cells_at_once, 0, lists, points, results);
    evaluate(list, free, all, at_once, limits_.stack_pieces, lists, points, results);
    const std::vector<double> found = results.download();
    for (std::uint64_t i = 0; i < all; ++i) {
      const double* r = found.data() + result_reals * i;
      Cell& c = cells[order[i]];
      c.value = r[0], c.unsure = r[1];
      c.error[0] = c.raw[0] = r[2], c.error[1] = c.raw[1] = r[3];
      c.varies[0] = r[4], c.varies[1] = r[5];
      c.free = r[6];
    }
  }

  void evaluate(const Array<std::uint32_t>& list, std::uint64_t from, std::uint64_t to, std::uint64_t at_once,
                std::uint32_t capacity, const Array<std::uint32_t>& lists, RealArray& points,
                RealArray& results) {
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
        device_.run(integrate_kernels, "cell_points", count * cell_points, list, std::uint32_t(first),
                    std::uint32_t(count * cell_points), on_device_.quads, on_device_.pairs,
                    on_device_.normals, on_device_.occluders, on_device_.sides, on_device_.planes,
                    on_device_.vertices, lists, stack_, capacity, points);
      }
      const auto stage = device_.stage("sum cells");
      device_.run(integrate_kernels, "cell_sums", count, points, std::uint32_t(first), count,
                  Real{capacity ? least_part_hidden : least_part_free}, results);
    }
  }

  // Two siblings with their parent: if its estimate was too low, theirs are, too; and with occluders they are some part of
  // what halving changed in any case.
  static void compare(Cell& a, Cell& b) {
    const double moved = std::abs(a.parent_value - a.value - b.value);
    // A kink's error falls by about 5 from halving to halving.
    const double part = moved > a.parent_error ? 0.2 : least_of_change;
    for (Cell* c : {&a, &b}) {
      if (c->occluders == hidden || (c->occluders == 0 && moved <= a.parent_error)) continue;
      c->error[c->child] = std::max(c->error[c->child], part * moved);
    }
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
        child.first_occluder = c.first_occluder, child.occluders = c.occluders;
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
  std::vector<std::uint32_t> lists_;  // occluders of cells, those of each cell in a row
  PairTables on_device_;
  RealArray stack_;
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
    return std::vector<PairIntegral>(tasks.size(), PairIntegral{0, 0, 0, 0, true});
  Integration integration(device, tasks, limits, counts);
  integration.run(go_on);
  return integration.results();
}

}  // namespace clrad
