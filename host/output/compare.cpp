#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clrad/accuracy.hpp"
#include "clrad/error.hpp"
#include "mesh/average.hpp"

namespace clrad {
namespace {

struct Sums {
  double squares = 0, reference = 0, weight = 0, worst = 0;
  void add(double value, double expected, double of_weight) {
    squares += of_weight * (value - expected) * (value - expected);
    reference += of_weight * expected, weight += of_weight;
    if (of_weight > 0) worst = std::max(worst, std::abs(value - expected));
  }
};

bool same_mesh(const Mesh& a, const Mesh& b) {
  return a.vertex_count() == b.vertex_count() && a.elements.size() == b.elements.size() &&
         a.lattice == b.lattice;
}

}  // namespace

Comparison compare(const Solution& solution, const Solution& reference) {
  if (solution.scene.polygons.size() != reference.scene.polygons.size())
    throw UsageError(
        fmt::format("solutions of {} and {} polygons cannot be compared: they are of different scenes",
                    solution.scene.polygons.size(), reference.scene.polygons.size()));
  const std::uint32_t bands = std::max(solution.bands, reference.bands);
  if (std::min(solution.bands, reference.bands) != 1 && solution.bands != reference.bands)
    throw UsageError(
        fmt::format("solutions of {} and {} bands cannot be compared", solution.bands, reference.bands));
  const auto band_of = [](const Solution& s, std::uint32_t b) { return std::min(b, s.bands - 1); };
  Sums sums;
  Comparison result;
  result.by_vertices = same_mesh(solution.mesh, reference.mesh);
  if (result.by_vertices) {
    const std::vector<double> area = vertex_areas(reference.mesh, reference.vertex_covered);
    const std::size_t n = area.size();
    for (std::uint32_t b = 0; b < bands; ++b)
      for (std::size_t v = 0; v < n; ++v)
        sums.add(solution.vertex_irradiance[band_of(solution, b) * n + v],
                 reference.vertex_irradiance[band_of(reference, b) * n + v], area[v]);
    result.points = std::uint64_t(std::count_if(area.begin(), area.end(), [](double a) { return a > 0; }));
  } else {
    const auto mine = polygon_means(solution), theirs = polygon_means(reference);
    for (std::size_t p = 0; p < mine.size(); ++p)
      for (std::uint32_t b = 0; b < bands; ++b)
        sums.add(mine[p].irradiance[band_of(solution, b)], theirs[p].irradiance[band_of(reference, b)],
                 theirs[p].area_m2);
    result.points = mine.size();
  }
  const double mean = sums.weight > 0 ? sums.reference / sums.weight : 0;
  if (mean > 0) {
    result.rms_relative = std::sqrt(sums.squares / sums.weight) / mean;
    result.worst_relative = sums.worst / mean;
  }
  return result;
}

}  // namespace clrad
