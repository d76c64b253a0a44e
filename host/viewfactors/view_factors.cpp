#include "clrad/view_factors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>

#include "viewfactors/integrate.hpp"
#include "viewfactors/pairs.hpp"

namespace clrad {
namespace {

constexpr std::size_t pairs_at_once = 4096;
constexpr std::uint64_t batch_bytes = 64u << 20;
constexpr int most_halvings = 8;  // of a shooter
// Factors of the smaller polygon of a pair below which the error may be as large as there: when something partly hides
// the other, and when nothing does.
constexpr double least_hidden = 1e-3, least_free = 1e-9;
constexpr double no_factor =
    1e-13;  // of the smaller polygon: what slivers leave of a pair that is hidden whole

// An integral of one pair of polygons, receiver first.
struct Entry {
  std::uint32_t receiver = 0, shooter = 0;
  bool hidden = false;  // something stands in between
  PairIntegral integral{};
};

// Which row each polygon belongs to.
std::vector<std::uint32_t> rows_of(const Scene& scene, ViewFactorRows rows) {
  std::vector<std::uint32_t> row(scene.polygons.size());
  std::map<std::string, std::uint32_t> named;
  std::uint32_t count = 0;
  std::optional<std::size_t> last[2];  // the last front and the last back
  for (std::size_t p = 0; p < row.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    if (rows == ViewFactorRows::objects) {
      const auto [at, is_new] = named.emplace(polygon.name, count);
      count += is_new;
      row[p] = at->second;
      continue;
    }
    // Pieces of one face follow each other and share its line.
    std::optional<std::size_t>& before = last[polygon.back];
    const bool same = before && polygon.where.line > 0 &&
                      polygon.where.line == scene.polygons[*before].where.line &&
                      polygon.where.file == scene.polygons[*before].where.file;
    row[p] = same ? row[*before] : count++;
    before = p;
  }
  return row;
}

class ViewFactorRun {
 public:
  ViewFactorRun(Device& device, const Scene& scene, const ViewFactorOptions& options)
      : device_(device), scene_(scene), options_(options), surfaces_(surfaces_of(scene)), tree_(surfaces_) {
    limits_.relative = options.target_error;
    limits_.stack_pieces = options.stack_pieces;
    // Stacks may take a quarter of the memory.
    const std::uint64_t real = device.options().precision == Precision::float64 ? 8 : 4;
    const std::uint64_t stack = std::uint64_t(options.stack_pieces) * 49 * real;
    limits_.points_at_once = std::clamp<std::uint64_t>(device.options().memory_bytes / 4 / stack, 25, 4096);
  }

  ViewFactors result() {
    // Pairs of which the smaller polygon receives: over it the factor varies less.
    const auto n = std::uint32_t(scene_.polygons.size());
    total_ = std::uint64_t(n) * (n ? n - 1 : 0) / 2;
    finished_.assign(n, true);
    std::uint32_t i = 0;
    for (; i < n && go_on(); ++i) {
      for (std::uint32_t j = i + 1; j < n && !stopped_; ++j) {
        const bool swap = surfaces_.surface[j].area < surfaces_.surface[i].area;
        ++done_;
        add(swap ? j : i, swap ? i : j);
      }
      if (stopped_) finished_[i] = false;
    }
    for (; i < n; ++i) finished_[i] = false;
    flush();
    ViewFactors result;
    if (!stopped_) measure_reciprocity(result);
    assemble(result);
    return result;
  }

 private:
  PairTask task(std::uint32_t receiver, std::uint32_t shooter) const {
    PairTask task{parts_of_pair(surfaces_, tree_, receiver, shooter)};
    const bool hidden = std::any_of(task.parts.begin(), task.parts.end(),
                                    [](const PairPart& p) { return !p.occluders.empty(); });
    // Where all is visible the integrand is smooth and the target cheap, however small the factor.
    task.hidden = hidden;
    task.least = options_.target_error * (hidden ? least_hidden : least_free) *
                 std::min(surfaces_.surface[receiver].area, surfaces_.surface[shooter].area);
    return task;
  }

  void add(std::uint32_t receiver, std::uint32_t shooter) {
    PairTask next = task(receiver, shooter);
    if (next.parts.empty()) return;
    ++pairs_;
    hidden_ += next.hidden;
    for (const PairPart& part : next.parts) bytes_ += bytes_of(part);
    entries_.push_back({receiver, shooter, next.hidden});
    tasks_.push_back(std::move(next));
    if (tasks_.size() >= pairs_at_once || bytes_ >= std::min(batch_bytes, device_.options().memory_bytes / 4))
      flush();
  }

  // Asked until the answer is no.
  bool go_on() {
    if (stopped_ || !options_.progress) return !stopped_;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    stopped_ = !options_.progress({done_ - tasks_.size(), total_, seconds});
    return !stopped_;
  }

  // Integrates, and halves the shooters of pairs whose pieces had no room.
  std::vector<PairIntegral> integrals(std::vector<PairTask>& tasks) {
    const auto ask = [this] { return go_on(); };
    std::vector<PairIntegral> results = integrate(device_, tasks, limits_, counts_, ask);
    for (int halving = 0; halving < most_halvings && !stopped_; ++halving) {
      std::vector<PairTask> again;
      std::vector<std::size_t> of;
      for (std::size_t t = 0; t < tasks.size(); ++t) {
        const double goal = std::max(limits_.relative * results[t].value, tasks[t].least);
        if (!(results[t].unsure > 0.5 * goal)) continue;
        PairTask halved{{}, tasks[t].least, tasks[t].hidden};
        for (const PairPart& part : tasks[t].parts)
          for (PairPart& half : with_halved_shooter(part)) halved.parts.push_back(std::move(half));
        of.push_back(t);
        again.push_back(std::move(halved));
      }
      if (again.empty()) break;
      const std::vector<PairIntegral> better = integrate(device_, again, limits_, counts_, ask);
      for (std::size_t k = 0; k < of.size(); ++k) {
        if (stopped_ && !better[k].done) continue;
        results[of[k]] = better[k];
        tasks[of[k]] = std::move(again[k]);
      }
    }
    // A shooter that should have been halved again.
    for (std::size_t t = 0; stopped_ && t < tasks.size(); ++t)
      if (results[t].unsure > 0.5 * std::max(limits_.relative * results[t].value, tasks[t].least))
        results[t].done = false;
    return results;
  }

  void flush() {
    if (tasks_.empty()) return;
    const std::size_t first = entries_.size() - tasks_.size();
    std::vector<PairIntegral> results(tasks_.size());  // not done
    if (!stopped_) results = integrals(tasks_);
    for (std::size_t k = 0; k < results.size(); ++k) {
      Entry& e = entries_[first + k];
      e.integral = results[k];
      if (!e.integral.done) finished_[e.receiver] = finished_[e.shooter] = false;
    }
    done_ -= std::uint64_t(
        std::count_if(results.begin(), results.end(), [](const PairIntegral& r) { return !r.done; }));
    tasks_.clear();
    bytes_ = 0;
  }

  void measure_reciprocity(ViewFactors& result) {
    std::vector<std::size_t> seen;
    for (std::size_t e = 0; e < entries_.size(); ++e)
      if (entries_[e].integral.value > 0) seen.push_back(e);
    const std::size_t count = std::min<std::size_t>(options_.reciprocity_sample, seen.size());
    std::vector<PairTask> reversed;
    std::vector<std::size_t> of;
    for (std::size_t k = 0; k < count; ++k) {
      of.push_back(seen[k * seen.size() / count]);
      reversed.push_back(task(entries_[of[k]].shooter, entries_[of[k]].receiver));
    }
    const std::vector<PairIntegral> results = integrals(reversed);
    if (stopped_) return;
    for (std::size_t k = 0; k < results.size(); ++k) {
      const PairIntegral &a = entries_[of[k]].integral, &b = results[k];
      // Small factors of hidden pairs were held to an absolute error.
      const double size = std::max(a.value, reversed[k].least / options_.target_error);
      const double defect = std::abs(a.value - b.value) / size, estimated = (a.error + b.error) / size;
      result.reciprocity.beyond += defect > estimated;
      result.reciprocity.far_beyond += defect > 3 * estimated;
      if (result.reciprocity.pairs++ == 0 || defect > result.reciprocity.worst) {
        result.reciprocity.worst = defect;
        result.reciprocity.estimated = estimated;
      }
    }
  }

  void assemble(ViewFactors& result) {
    const std::vector<std::uint32_t> row = rows_of(scene_, options_.rows);
    const std::uint32_t n = row.empty() ? 0 : *std::max_element(row.begin(), row.end()) + 1;
    result.name.resize(n);
    result.where.resize(n);
    result.area_m2.assign(n, 0);
    result.emissivity.assign(n, 0);
    result.complete.assign(n, true);
    for (std::size_t p = row.size(); p-- > 0;) {
      const Polygon& polygon = scene_.polygons[p];
      const Material& material = scene_.materials[polygon.material];
      result.name[row[p]] = polygon.name;
      result.where[row[p]] = polygon.where;
      const double area = polygon.area_m2();
      result.area_m2[row[p]] += area;
      if (!finished_[p]) result.complete[row[p]] = false;
      double reflected = 0;
      for (const double rho : material.reflectance) reflected += rho / double(material.reflectance.size());
      result.emissivity[row[p]] += area * (1 - reflected);
    }
    for (std::uint32_t i = 0; i < n; ++i) result.emissivity[i] /= result.area_m2[i];

    struct Term {
      std::uint32_t i, j;
      double value, error;
    };
    std::vector<Term> terms;
    terms.reserve(2 * entries_.size());
    const double m2 = surfaces_.frame.metres() * surfaces_.frame.metres();
    for (const Entry& e : entries_) {
      const double smaller = std::min(surfaces_.surface[e.receiver].area, surfaces_.surface[e.shooter].area);
      if (!(e.integral.value > (e.hidden ? no_factor * smaller : 0))) continue;
      const std::uint32_t a = row[e.receiver], b = row[e.shooter];
      const double value = e.integral.value * m2, error = e.integral.error * m2;
      terms.push_back({a, b, value / result.area_m2[a], error / result.area_m2[a]});
      terms.push_back({b, a, value / result.area_m2[b], error / result.area_m2[b]});
    }
    std::stable_sort(terms.begin(), terms.end(),
                     [](const Term& a, const Term& b) { return a.i != b.i ? a.i < b.i : a.j < b.j; });
    result.row_sum.assign(n, 0);
    result.row_error.assign(n, 0);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (; at < terms.size() && terms[at].i == i; ++at) {
        const Term& t = terms[at];
        if (result.column.size() > result.first.back() && result.column.back() == t.j) {
          result.factor.back() += t.value;
          result.error.back() += t.error;
        } else {
          result.column.push_back(t.j);
          result.factor.push_back(t.value);
          result.error.push_back(t.error);
        }
        result.row_sum[i] += t.value;
        result.row_error[i] += t.error;
      }
      result.first.push_back(result.column.size());
    }
    judge(result);
  }

  void judge(ViewFactors& result) {
    for (std::uint32_t i = 0; i < result.rows(); ++i)
      for (std::uint64_t k = result.first[i]; result.complete[i] && k < result.first[i + 1]; ++k) {
        const double small =
            least_hidden * std::min(1.0, result.area_m2[result.column[k]] / result.area_m2[i]);
        const double relative = result.error[k] / std::max(result.factor[k], small);
        result.worst_relative_error = std::max(result.worst_relative_error, relative);
        result.over_target += relative > options_.target_error * (1 + 1e-9);
      }
    result.closed = is_watertight(scene_);
    for (std::uint32_t i = 0; result.closed && i < result.rows(); ++i)
      if (result.complete[i])
        result.worst_row_defect = std::max(result.worst_row_defect, std::abs(result.row_sum[i] - 1));
    result.pairs_done = done_;
    result.pairs_asked = total_;
    result.pairs = pairs_;
    result.hidden_pairs = hidden_;
    result.points = counts_.points;
    result.stopped = done_ < total_;  // not when only reciprocity was not measured any more
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  Device& device_;
  const Scene& scene_;
  const ViewFactorOptions& options_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  SurfaceList surfaces_;
  BoxTree tree_;
  IntegrationLimits limits_;
  IntegrationCounts counts_;
  std::vector<Entry> entries_;
  std::vector<PairTask> tasks_;  // of the last entries
  std::uint64_t bytes_ = 0, done_ = 0, total_ = 0, pairs_ = 0, hidden_ = 0;
  std::vector<bool> finished_;  // of each polygon: all its pairs are done
  bool stopped_ = false;
};

}  // namespace

double ViewFactors::at(std::uint32_t i, std::uint32_t j) const {
  const auto begin = column.begin() + std::ptrdiff_t(first[i]),
             end = column.begin() + std::ptrdiff_t(first[i + 1]);
  const auto found = std::lower_bound(begin, end, j);
  return found != end && *found == j ? factor[std::size_t(found - column.begin())] : 0;
}

double ViewFactors::error_at(std::uint32_t i, std::uint32_t j) const {
  const auto begin = column.begin() + std::ptrdiff_t(first[i]),
             end = column.begin() + std::ptrdiff_t(first[i + 1]);
  const auto found = std::lower_bound(begin, end, j);
  return found != end && *found == j ? error[std::size_t(found - column.begin())] : 0;
}

ViewFactors view_factors(Device& device, const Scene& scene, const ViewFactorOptions& options) {
  if (!(options.target_error > 0 && options.target_error <= 0.1))
    throw UsageError(fmt::format("the target error of view factors is {}; it is above 0 and at most 0.1",
                                 options.target_error));
  if (options.stack_pieces == 0) throw UsageError("stack_pieces is at least 1");
  const Scene both_sides = with_backs(scene);
  return ViewFactorRun(device, both_sides, options).result();
}

}  // namespace clrad
