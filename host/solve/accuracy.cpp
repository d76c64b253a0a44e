#include "solve/accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "output/displayed.hpp"
#include "solve/check_gather.hpp"
#include "solve/check_points.hpp"
#include "solve/clip.hpp"
#include "solve/seen_error.hpp"
#include "solve/seen_points.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// Points and rays: enough for an RMS that is good to a third where errors are spread evenly, at a tenth of a solve's work.
constexpr std::uint32_t fewest_points = 96, most_points = 1024, fewest_rays = 64, most_rays = 2048;
constexpr double share_of_work = 1.0 / 54, most_pairs = 1e7;

// Values at points, [point][band], and the share of the surfaces that each point stands for.
struct Values {
  std::uint32_t bands = 1;
  std::vector<double> weight, all;
  std::size_t points() const { return weight.size(); }
};

Values minus(const Values& a, const Values& b) {
  Values d = a;
  for (std::size_t i = 0; i < d.all.size(); ++i) d.all[i] -= b.all[i];
  return d;
}

double mean_of(const Values& v, std::uint32_t band) {
  double sum = 0;
  for (std::size_t k = 0; k < v.points(); ++k) sum += v.weight[k] * v.all[k * v.bands + band];
  return sum;
}

// Two measurements of one difference, whose noises are independent.
struct Twice {
  Values first, second;

  double product(std::uint32_t band) const {
    double sum = 0;
    for (std::size_t k = 0; k < first.points(); ++k)
      sum += first.weight[k] * first.all[k * first.bands + band] * second.all[k * first.bands + band];
    return sum;
  }
  /// Square of the mean over the scene, less what so few points give it by chance.
  double mean_square(std::uint32_t band) const {
    const double m = (mean_of(first, band) + mean_of(second, band)) / 2;
    double by_chance = 0;
    for (std::size_t k = 0; k < first.points(); ++k) {
      const std::size_t i = k * first.bands + band;
      by_chance += std::pow(first.weight[k], 2) * (first.all[i] - m) * (second.all[i] - m);
    }
    return std::max(0.0, m * m - std::max(0.0, by_chance));
  }
  /// Mean over bands of the square of the error that this difference makes: what is the same everywhere counts `amplification`
  /// times.
  double error_square(const std::vector<double>& amplification) const {
    double sum = 0;
    for (std::uint32_t b = 0; b < first.bands; ++b)
      sum += product(b) + (amplification[b] * amplification[b] - 1) * mean_square(b);
    return sum / first.bands;
  }
};

Twice minus(const Twice& a, const Twice& b) {
  return {minus(a.first, b.first), minus(a.second, b.second)};
}

// What another way to make columns would have given at these vertices: by exact form factors, from the same samples.
Values by_exact_factors(SolveState& state, const CheckVertices& chosen) {
  const std::vector<std::uint32_t>& vertices = chosen.vertex;
  SolveOptions options = state.options;
  options.estimator = Estimator::exact;
  std::vector<std::uint8_t> others(state.vertices, 1);
  for (const std::uint32_t v : vertices) others[v] = 0;
  SolveState exact(state.device, state.scene, state.mesh, state.bands, state.engine, options, others,
                   state.metres_per_unit, state.glass);
  exact.emitted_power = state.emitted_power;
  exact.occlusion = state.occlusion;
  for (const std::uint32_t patch : state.patch_of_slot) {
    const RealArray& column = trace_some(exact, patch, 0, nullptr);
    deliver_column(exact, column, state.total_shot, patch);
  }
  const std::vector<double> h = exact.vertex_irradiance.download();
  Values values{state.bands, chosen.weight, {}};
  for (const std::uint32_t v : vertices)
    for (std::uint32_t b = 0; b < state.bands; ++b)
      values.all.push_back(h[std::size_t(b) * state.vertices + v]);
  return values;
}

// How much more light there is than what the emitters send, per band: so often does an error that is the same everywhere count.
// Rows that are closed do not hand it on.
std::vector<double> amplification_of(const SolveState& state, const Solution& solution) {
  std::vector<double> result(state.bands, 1);
  if (!state.interreflection || state.balanced) return result;
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    double arriving = 0;
    for (std::uint32_t p = 0; p < state.patches; ++p)
      arriving +=
          state.mesh.patches[p].area_m2 * solution.patch_irradiance[std::size_t(b) * state.patches + p];
    const double emitted = solution.report.energy.emitted[b];
    if (emitted > 0) result[b] = std::max(1.0, arriving / emitted);
  }
  return result;
}

double mean_reflectance(const SolveState& state) {
  double area = 0, reflecting = 0;
  for (std::uint32_t p = 0; p < state.patches; ++p)
    for (std::uint32_t b = 0; b < state.bands; ++b)
      area += state.mesh.patches[p].area_m2,
          reflecting += state.mesh.patches[p].area_m2 * state.reflectance(b, p);
  return area > 0 ? reflecting / area : 0;
}

// By how much errors of the mesh come back. They are largest along edges, where the neighbouring surface is half of what a
// point sees, and off alike: e = r + rho e / 2.
double echo_of(const SolveState& state) {
  return state.interreflection ? 1 / (1 - mean_reflectance(state) / 2) : 1;
}

// Takes away the points where no light comes at all though the elements around are lit: something stands there.
void drop_covered(const Solution& solution, Twice& gathered, std::vector<CheckPoint>& inside) {
  const std::size_t bands = solution.bands;
  std::size_t kept = 0;
  double weights = 0;
  for (std::size_t k = 0; k < inside.size(); ++k) {
    const std::array<std::uint32_t, 4>& corner = solution.mesh.elements[inside[k].where.element].vertex;
    const bool in_part = std::any_of(corner.begin(), corner.end(), [&](std::uint32_t v) {
      return v != 0xffffffffu && solution.vertex_covered[v] != 0;
    });
    double light = 0;
    for (std::size_t i = k * bands; i < (k + 1) * bands; ++i)
      light += gathered.first.all[i] + gathered.second.all[i];
    if (in_part && light == 0) continue;
    for (Values* values : {&gathered.first, &gathered.second})
      std::copy_n(values->all.begin() + std::ptrdiff_t(k * bands), bands,
                  values->all.begin() + std::ptrdiff_t(kept * bands));
    inside[kept++] = inside[k];
    weights += inside[k].weight;
  }
  inside.resize(kept);
  std::vector<double> weight;
  for (CheckPoint& p : inside) p.weight /= weights, weight.push_back(p.weight);
  for (Values* values : {&gathered.first, &gathered.second})
    values->all.resize(kept * bands), values->weight = weight;
}

double mean_over_bands_of_square(const std::vector<double>& v) {
  return std::inner_product(v.begin(), v.end(), v.begin(), 0.0) / double(std::max<std::size_t>(1, v.size()));
}

// A part so much smaller than the others, by a guess that may be some ten times too low, is left at that.
constexpr double negligible = 0.005;

// RMS per band of the irradiance that unshot light still brings: first from the patches that have it, then reflected again and again
// where that arrives. The ambient light (Cohen et al. 1988) spreads it over the whole scene, of which a room may be a small part.
std::vector<double> missing_light(SolveState& state, const Solution& solution,
                                  const std::vector<CheckPoint>& inside, std::uint64_t seed) {
  std::vector<Point> at;
  at.reserve(inside.size());
  for (const CheckPoint& p : inside) at.push_back(p.point);
  const PointArray points(state.device, at, "check points");
  const std::vector<double> found =
      gather_of_patches(state.device, solution, state.engine, state.unshot.download(),
                        {&points, fewest_rays, seed, true}, state.glass);
  std::vector<double> result;
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    double arriving = 0, reflected = 0, squares = 0;
    for (std::size_t k = 0; k < inside.size(); ++k) {
      const double h = found[k * solution.bands + b], w = inside[k].weight;
      arriving += w * std::abs(h), squares += w * h * h;
      if (state.interreflection)
        reflected += w * std::abs(h) * solution.material_of(inside[k].polygon).reflectance[b];
    }
    result.push_back(arriving > reflected ? std::sqrt(squares) / (1 - reflected / arriving)
                                          : std::sqrt(squares));
  }
  return result;
}

// A share of the pairs of patch and vertex that the solve traced, and of sensors' rays: first for points, then for rays from each.
struct Effort {
  std::uint32_t points, rays;
};
Effort effort_for(const SolveState& state, const SensorGather& gathered) {
  const double pairs = double(state.vertices) * double(state.patch_of_slot.size());
  const double work = share_of_work * (pairs + double(gathered.rays));
  const double wanted = work / (double(state.patches) + fewest_rays);
  const double points = std::max(
      48.0,
      std::min(std::clamp(wanted, double(fewest_points), double(most_points)), most_pairs / state.patches));
  const double rays = work / points - double(state.patches);
  return {std::uint32_t(points), std::uint32_t(std::clamp(rays, double(fewest_rays), double(most_rays)))};
}

// Root of the sum of their squares.
double of_mesh_and_rays(const std::vector<ErrorPart>& parts) {
  double squares = 0;
  for (const ErrorPart& part : parts)
    if (!part.bound && part.name != "convergence") squares += part.relative * part.relative;
  return std::sqrt(squares);
}

// RMS error of sensors relative to the mean of all, with squares per band of what they are off by with the light they see.
double of_sensors(const Solution& solution, const std::vector<double>& seen) {
  double squares = 0, irradiance = 0, values = 0;
  for (const SensorResult& sensor : solution.sensors)
    for (std::size_t b = 0; b < seen.size(); ++b) {
      squares += std::pow(sensor.irradiance_error[b], 2) + seen[b];
      irradiance += sensor.irradiance[b], values += 1;
    }
  return irradiance > 0 ? std::sqrt(squares / values) / (irradiance / values) : 0;
}

// The estimate from so few points is good to a third. Where that may be all that keeps a target from being met, which another solve would cost,
// it is made of more of them.
constexpr double near_miss = 1.5;
constexpr std::uint32_t more_points = 3;
// So many are enough for what sensors see, which is a sum over them; of as many again, spread over the surfaces, half are taken.
constexpr std::uint32_t fewest_seen = 128, most_seen = 256;

// Square per band of what sensors are off by, with the light that they see.
std::vector<double> seen_square(SolveState& state, const Solution& solution, SensorGather& gathered,
                                std::uint32_t points_inside, std::uint32_t rays, std::uint64_t seed,
                                Random& random) {
  const std::vector<Point> sensors = some_sensors(gathered);
  const auto measured = [&](std::uint32_t count, std::uint64_t of_seed) {
    const std::vector<CheckPoint> points = seen_points(
        state, solution, gathered, points_in_elements(solution, count, random), count, of_seed, random);
    const Residual residual = residual_of_seen(state, solution, gathered, points, rays, of_seed);
    return seen_error_square(state, solution, sensors, points, residual);
  };
  const std::uint32_t count = std::clamp(points_inside, fewest_seen, most_seen);
  std::vector<double> seen = measured(count, seed);
  const double target = state.options.target_error, error = of_sensors(solution, seen),
               by_rays = of_sensors(solution, std::vector<double>(seen.size(), 0));
  const bool near = target > 0 && error > target && error < near_miss * target && by_rays < target &&
                    2 * by_rays * by_rays < error * error;
  if (!near || solution.stopped || state.options.target_of == TargetOf::worst_sensor) return seen;
  const std::vector<double> more = measured(more_points * count, seed + 2);
  for (std::size_t b = 0; b < seen.size(); ++b)
    seen[b] = (seen[b] + more_points * more[b]) / (1 + more_points);
  return seen;
}

void total_up(Report& report) {
  double squares = 0;
  for (const ErrorPart& part : report.error.parts)
    if (!part.bound) squares += part.relative * part.relative;
  report.error.total_relative = std::sqrt(squares);
}

}  // namespace

void total_at_sensors(Solution& solution, const std::vector<double>& seen) {
  const double all = of_sensors(solution, seen),
               rays = of_sensors(solution, std::vector<double>(seen.size(), 0));
  solution.report.error.sensors_relative = all;
  solution.report.error.sensor_parts = {
      {"sensor rays", rays, false}, {"light seen", std::sqrt(std::max(0.0, all * all - rays * rays)), false}};
  for (SensorResult& sensor : solution.sensors)
    for (std::size_t b = 0; b < seen.size(); ++b)
      sensor.irradiance_error[b] = std::hypot(sensor.irradiance_error[b], std::sqrt(seen[b]));
}

std::vector<double> estimate_error(SolveState& state, Solution& solution,
                                   const std::vector<double>& before_near_field, SensorGather& gathered) {
  const auto stage = state.device.stage("estimate the error");
  const auto [count, rays] = effort_for(state, gathered);
  const std::uint32_t bands = solution.bands;
  Random random(state.options.seed);
  const CheckVertices chosen = check_vertices(solution, count / 2, random);
  const std::vector<std::uint32_t>& vertices = chosen.vertex;
  std::vector<CheckPoint> inside = points_in_elements(solution, count, random);
  auto& parts = solution.report.error.parts;
  if (vertices.empty() || inside.empty()) return {};
  // Each point twice, as rays are told apart by their point's number; vertices first, flat or not.
  std::vector<Point> twice;
  twice.reserve(2 * (vertices.size() + inside.size()));
  for (int k = 0; k < 2; ++k)
    for (const std::uint32_t v : vertices) twice.push_back(solution.mesh.receivers[v]);
  const PointArray at_chosen(state.device, twice, "check points");
  for (int k = 0; k < 2; ++k)
    for (const CheckPoint& p : inside) twice.push_back(p.point);
  const PointArray at_all(state.device, twice, "check points");
  const std::uint64_t seed = 2 * state.options.seed;
  const std::array<CheckGather, 2> ways{
      {{&at_all, rays, seed + 1, false}, {&at_chosen, rays, seed + 1, true}}};
  const auto found = gather_for_check(state.device, solution, state.engine, state.total_shot.download(),
                                      state.interreflection, ways, state.glass,
                                      state.direct ? &state.direct->lights : nullptr);
  std::vector<double> weight;
  weight.reserve(inside.size());
  for (const CheckPoint& p : inside) weight.push_back(p.weight);
  const auto part = [&](const std::vector<double>& values, std::size_t point, std::size_t points) {
    const auto begin = values.begin() + std::ptrdiff_t(point * bands);
    return std::vector<double>(begin, begin + std::ptrdiff_t(points * bands));
  };
  const auto both = [&](const std::vector<double>& values, std::size_t first,
                        const std::vector<double>& weights) {
    const std::size_t n = weights.size();
    return Twice{{bands, weights, part(values, first, n)}, {bands, weights, part(values, first + n, n)}};
  };
  const Twice there = both(found[0], 0, chosen.weight), there_flat = both(found[1], 0, chosen.weight);
  Twice here = both(found[0], 2 * vertices.size(), weight);
  drop_covered(solution, here, inside);

  const Displayed displayed(solution, display_irradiance(solution));
  Values shown{bands, here.first.weight, {}}, at_vertices{bands, chosen.weight, {}},
      by_columns{bands, chosen.weight, {}};
  for (const CheckPoint& p : inside)
    for (std::uint32_t b = 0; b < bands; ++b) shown.all.push_back(displayed.at(b, p.where));
  for (const std::uint32_t v : vertices)
    for (std::uint32_t b = 0; b < bands; ++b) {
      at_vertices.all.push_back(solution.vertex_irradiance[std::size_t(b) * state.vertices + v]);
      by_columns.all.push_back(before_near_field[std::size_t(b) * state.vertices + v]);
    }
  double mean = 0;
  for (std::uint32_t b = 0; b < bands; ++b) mean += mean_of(shown, b) / bands;

  const std::vector<double> amplification = amplification_of(state, solution);
  const auto relative = [&](double square) {
    // Written so that what is not a number stays that.
    return mean > 0 ? std::sqrt(square < 0 ? 0 : square) / mean : 0.0;
  };
  // What the near field does not make up for of what patches' averages hide.
  const Values near = minus(at_vertices, by_columns);
  const Twice hidden = minus(there, there_flat);
  const Twice shooting{minus(near, hidden.first), minus(near, hidden.second)};
  Values sampled = by_columns;
  double factors = 0;
  if (state.options.estimator != Estimator::exact) {
    sampled = by_exact_factors(state, chosen);
    const Values by_factors = minus(by_columns, sampled);
    factors = Twice{by_factors, by_factors}.error_square(amplification);
  }
  const Twice visible{minus(sampled, there_flat.first), minus(sampled, there_flat.second)};
  const Twice at_vertex{minus(at_vertices, there.first), minus(at_vertices, there.second)};
  const Twice everywhere{minus(shown, here.first), minus(shown, here.second)};
  // Where shooters were clipped it has no error, and what is measured is the check's own noise.
  const double visibility = visible.error_square(amplification) * (state.clip ? state.clip->share_left() : 1);
  // The near field corrects columns in proportion: with wrong form factors what it leaves is their fault, and the rest counts.
  const double shot = state.options.estimator == Estimator::exact
                          ? shooting.error_square(amplification)
                          : at_vertex.error_square(amplification) - factors - visibility;
  const double echo2 = std::pow(echo_of(state), 2);
  const double receiving =
      echo2 * (everywhere.error_square(amplification) - at_vertex.error_square(amplification));
  parts.push_back({"form factor", relative(factors), false});
  parts.push_back({"visibility", relative(visibility), false});
  parts.push_back({"mesh-receive", relative(receiving), false});
  parts.push_back({"mesh-shoot", relative(echo2 * shot), false});
  std::vector<double> missing = solution.ambient;
  if (relative(mean_over_bands_of_square(missing)) > negligible * of_mesh_and_rays(parts))
    missing = missing_light(state, solution, inside, seed + 3);
  parts.push_back({"convergence", relative(mean_over_bands_of_square(missing)), false});
  total_up(solution.report);
  if (solution.sensors.empty()) return {};
  std::vector<double> seen = seen_square(state, solution, gathered, count, rays, seed + 4, random);
  total_at_sensors(solution, seen);
  return seen;
}

}  // namespace clrad
