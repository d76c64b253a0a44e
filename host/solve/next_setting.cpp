#include "solve/next_setting.hpp"

#include <algorithm>

#include "clrad/error.hpp"
#include "solve/more_rays.hpp"
#include "solve/sensor.hpp"
#include "solve/vertex_gather.hpp"

namespace clrad {
namespace {

// How the parts of the error fall with what they are made of; from `./run bench budget`. Patches sample each other's light, so that
// finer ones lessen the error of visibility, too. Those of what sensors see are from grids of settings at the rooms' points (`./run bench targets --steps`).
constexpr double order_of_receiving = 1.2, order_of_shooting = 1.2, order_of_samples = 0.5,
                 order_of_visibility_in_patches = 0.5, order_of_seen_in_patches = 0.8;
// Light is smooth where nothing stands in its way.
constexpr double order_of_seen_in_elements = 0.9, order_of_smooth_in_elements = 1.2;
// What the estimate of what sensors see comes to where there is nothing to be seen, by its points' own rays and chance.
constexpr double least_seen = 0.0005;
// Where none that takes so long meets the target, the one with the least error x seconds to this power: at sensors about the most that may be taken.
constexpr double order_of_seconds = 0.4, order_of_seconds_at_sensors = 0.2;
// Predictions are not exact: the next setting is to come out a little below the target, and well inside the time.
constexpr double aim_at_sensors = 0.86, aim_all_over = 0.9, share_of_time_left = 0.75;
// The estimate at sensors is of few points and may be too low: while there is a way to, it is brought this far below the target.
constexpr double enough_at_sensors = 0.95;
// What a sensor sees is off by this much more where the mesh is too fine for its vertices to be gathered anew.
constexpr double without_vertices = 2.5;
// Unshot light that makes more of the error than this share of what is aimed at is shot on, down to the second share: it is cheap,
// and how much error goes with it depends on the scene (where most light leaves, more).
constexpr double much_unshot = 0.25, little_unshot = 0.15, least_converge = 1e-7;
// Patches get finer by eighths of a power of two; at sensors by halves of one, as how two meshes that are nearly alike differ is chance, and in the
// steps of a time budget by whole ones: what lines up with a mesh does so with the next.
constexpr int steps_to_target = 4, steps_in_time = 8;
constexpr std::uint32_t most_rays_to_a_patch = 1024;

}  // namespace

bool aims_at_sensors(const SolveOptions& o) {
  return o.target_of == TargetOf::sensors || o.target_of == TargetOf::worst_sensor ||
         (o.target_of == TargetOf::automatic && !o.sensors.empty());
}

double enough(const SolveOptions& o) {
  return o.target_error * (aims_at_sensors(o) ? enough_at_sensors : 1);
}

namespace {

double error_part(const Report& report, const char* name) {
  for (const ErrorPart& p : report.error.parts)
    if (p.name == name) return p.relative;
  return 0;
}

// The largest error of a sensor, relative to the mean of all.
double worst_sensor(const Solution& s) {
  double worst = 0, mean = 0, values = 0;
  for (const SensorResult& sensor : s.sensors)
    for (std::size_t b = 0; b < sensor.irradiance.size(); ++b)
      worst = std::max(worst, sensor.irradiance_error[b]), mean += sensor.irradiance[b], values += 1;
  return mean > 0 ? worst / (mean / values) : 0;
}

}  // namespace

TargetErrors errors_of(const Solution& s, const SolveOptions& o) {
  const Report& r = s.report;
  TargetErrors e;
  e.receiving = error_part(r, "mesh-receive"), e.shooting = error_part(r, "mesh-shoot"),
  e.visibility = error_part(r, "visibility"), e.unshot = error_part(r, "convergence");
  const double known = std::hypot(std::hypot(e.receiving, e.shooting, e.visibility), e.unshot);
  e.rest = std::sqrt(std::max(0.0, r.error.total_relative * r.error.total_relative - known * known));
  e.at_sensors = aims_at_sensors(o);
  if (!e.at_sensors) return e;
  for (const ErrorPart& p : r.error.sensor_parts)
    (p.name == "sensor rays" ? e.sampling : e.seen) = p.relative;
  // What they see is taken to be off alike at all of them.
  if (o.target_of == TargetOf::worst_sensor)
    e.sampling = std::sqrt(std::max(0.0, std::pow(worst_sensor(s), 2) - e.seen * e.seen));
  return e;
}

TargetErrors tempered(const TargetErrors& found, const TargetErrors& foretold) {
  TargetErrors e = found;
  for (double TargetErrors::*part :
       {&TargetErrors::receiving, &TargetErrors::shooting, &TargetErrors::visibility, &TargetErrors::seen})
    e.*part = (found.*part + foretold.*part) / 2;
  return e;
}

namespace {

// A candidate's mesh with as much more of everything as the last one had in the end.
MeshSize grown(const SolveCost& now, MeshSize mesh) {
  for (double MeshSize::*count :
       {&MeshSize::patches, &MeshSize::elements, &MeshSize::vertices, &MeshSize::edges})
    if (now.before.*count > 0) mesh.*count *= now.mesh.*count / (now.before.*count);
  return mesh;
}

double rays_at_vertices(const SolveCost& now, const MeshSize& mesh, const SolveSetting& setting) {
  return rays_at_vertices(mesh, now.uncovered, now.sensors, setting.sensor_rays);
}

// Edges of elements and patches go by their numbers: polygons are cut into whole ones.
TargetErrors predicted(const TargetErrors& now, const SolveSetting& at, const SolveCost& cost,
                       const SolveSetting& next, const MeshSize& mesh, double least_of_seen) {
  const double elements = std::sqrt(cost.mesh.elements / mesh.elements),
               patches = std::sqrt(cost.mesh.patches / mesh.patches);
  const double samples = double(next.samples) / at.samples, rays = double(next.sensor_rays) / at.sensor_rays;
  TargetErrors e = now;
  e.receiving *= std::pow(elements, order_of_receiving);
  e.shooting *= std::pow(patches, order_of_shooting);
  e.visibility *= std::pow(samples, -order_of_samples) * std::pow(patches, order_of_visibility_in_patches);
  e.sampling *= std::pow(rays, -order_of_sensor_rays);
  // Sensors see means over surfaces, which patches' sizes matter less for; noise has the share in it that it has all over, unless light at
  // the vertices is gathered anew.
  const double before = std::hypot(now.receiving, now.shooting, now.visibility),
               noise = before > 0 && !(rays_at_vertices(cost, mesh, next) > 0)
                           ? std::pow(now.visibility / before, 2)
                           : 0,
               less_noise = now.visibility > 0 ? e.visibility / now.visibility : 1;
  const bool before_regathers = rays_at_vertices(cost, cost.mesh, at) > 0,
             regathers = rays_at_vertices(cost, mesh, next) > 0;
  // Where light is not gathered anew at vertices, it is elements that are too coarse for it.
  const double order_in_elements = cost.occlusion ? order_of_seen_in_elements : order_of_smooth_in_elements,
               order_in_patches = before_regathers || regathers ? order_of_seen_in_patches : 0;
  double finer = std::pow(patches, order_in_patches) * std::pow(elements, order_in_elements);
  if (before_regathers != regathers) finer *= regathers ? 1 / without_vertices : without_vertices;
  const double least = std::min(e.seen, least_of_seen), certain = e.seen * e.seen - least * least;
  e.seen =
      std::sqrt(certain * ((1 - noise) * finer * finer + noise * less_noise * less_noise) + least * least);
  return e;
}

double gather_work(const SolveCost& now, const MeshSize& mesh, const SolveSetting& setting) {
  return gather_work(mesh, now.uncovered, now.sensors, setting.sensor_rays);
}

// Columns are patches x vertices, with some launches for each patch whatever its size, more for the solve, and rays by their samples. From
// 45 solves of the reference's rooms, of 19 to 1243 patches: 30 to 50 ms, 0.45 ms a patch and 0.2 us a vertex of a column.
double predicted_seconds(const SolveCost& now, const SolveSetting& at, const SolveSetting& next,
                         const MeshSize& mesh) {
  // Of a solve and of a column, in vertices.
  constexpr double solve_launches = 2.5e5, launches = 2250;
  const auto work = [&](const MeshSize& of) {
    return solve_launches + of.patches * (launches + of.vertices);
  };
  const auto rays = [](const MeshSize& of, std::uint32_t samples) {
    return of.patches * of.vertices * samples;
  };
  const double shooting = (now.shooting_s - now.rays_s) * work(mesh) / work(now.mesh) +
                          now.rays_s * rays(mesh, next.samples) / rays(now.mesh, at.samples);
  const double sensors = now.sensors_s * gather_work(now, mesh, next) / gather_work(now, now.mesh, at);
  return shooting + sensors;
}

// None where a polygon would have more patches along one side than can be numbered.
std::optional<MeshSize> size_of_mesh(const Scene& scene, const SolveSetting& setting) {
  try {
    return count_mesh(scene, {setting.patch_edge_m, setting.element_edge_m()});
  } catch (const UsageError&) {
    return std::nullopt;
  }
}

// All settings that are as fine as `at`, and a little finer at a time, and how large a mesh they have.
template <class Visit>
void each_finer(const Scene& scene, const SolveSetting& at, bool sensors, bool sampled, int step,
                Visit visit) {
  const int most_levels = sensors ? std::max(2, at.level) : 5;
  for (int p = 0; p <= 24; p += step)
    for (int level = std::max(1, at.level - 3); level <= std::min(most_levels, at.level + 3); ++level) {
      SolveSetting meshed = at;
      meshed.patch_edge_m = at.patch_edge_m * std::exp2(-p / 8.0), meshed.level = level;
      if (meshed.element_edge_m() > at.element_edge_m() * 1.001) continue;
      const std::optional<MeshSize> mesh = size_of_mesh(scene, meshed);
      if (!mesh) return;
      for (std::uint32_t samples = 1; samples <= (sampled ? 64u : 1u); samples *= 4)
        for (std::uint32_t rays = 1; rays <= (sensors ? 1024u : 1u); rays *= 2) {
          SolveSetting next = meshed;
          next.samples *= samples, next.light_samples *= samples, next.sensor_rays *= rays;
          if (next.samples > most_rays_to_a_patch || (rays > 1 && next.sensor_rays > most_sensor_rays))
            continue;
          visit(next, *mesh);
        }
    }
}

// Less unshot light, where that makes much of the error; says whether. At sensors it is part of what they see, and not told apart.
bool shoot_on(SolveSetting& setting, TargetErrors& errors, double unshot_relative, double target) {
  const double aim = target > 0 ? target : errors.total();
  if (errors.at_sensors || errors.unshot <= much_unshot * aim) return false;
  const double converge = unshot_relative * little_unshot * aim / errors.unshot;
  if (converge < least_converge) return false;
  setting.converge = converge;
  errors.unshot = little_unshot * aim;
  return true;
}

}  // namespace

// The estimate at sensors is of few points: what a coarse solve says too much by is not to be paid for with all that it asks for.
double longest_of_target(bool at_sensors) {
  return at_sensors ? 4 : longest_step;
}

// Steps of a time budget: where the next one may not take all that is left, it is the one in the middle of two that grow alike, so that
// another after it still fits in.
double longest_of_budget(const SolveCost& cost, double seconds_left) {
  const double growth = seconds_left * share_of_time_left / cost.total();
  return growth > longest_step ? std::min(longest_step, std::sqrt(growth)) : longest_step;
}

std::optional<NextSetting> next_setting(const Scene& scene, TargetErrors errors, SolveSetting at,
                                        const SolveCost& cost, double target, double seconds_left,
                                        double longest) {
  const double before = errors.total();
  const bool again = shoot_on(at, errors, cost.unshot_relative, target);
  const double aim = target * (errors.at_sensors ? aim_at_sensors : aim_all_over);
  std::optional<NextSetting> best;
  double best_cost = 0;
  const double most_seconds = std::min(seconds_left * share_of_time_left, longest * cost.total());
  // Where nothing stands in the way samples are no help.
  const bool sampled = !errors.at_sensors || cost.occlusion;
  const int step = !errors.at_sensors ? 1 : target > 0 ? steps_to_target : steps_in_time;
  each_finer(
      scene, at, errors.at_sensors, sampled, step, [&](const SolveSetting& next, const MeshSize& counted) {
        const MeshSize mesh = grown(cost, counted);
        if (!again && counted.patches == cost.before.patches && counted.elements == cost.before.elements &&
            next.samples == at.samples && next.sensor_rays == at.sensor_rays)
          return;
        const double seconds = predicted_seconds(cost, at, next, mesh);
        if (seconds > most_seconds) return;
        const TargetErrors then = predicted(errors, at, cost, next, mesh, target > 0 ? least_seen : 0);
        const double error = then.total();
        const bool meets = target > 0 && error <= aim, best_meets = target > 0 && best && best->error <= aim;
        if (!meets && error > (target > 0 ? 0.75 : 0.9) * before) return;
        // Where none meets the target: the most for the time.
        const double cost_of_error =
            target > 0 ? error * std::pow(seconds,
                                          errors.at_sensors ? order_of_seconds_at_sensors : order_of_seconds)
                       : error;
        const bool better = !best                 ? true
                            : meets != best_meets ? meets
                            : meets               ? seconds < best->seconds
                                                  : cost_of_error < best_cost;
        if (better) best = NextSetting{next, then, error, seconds}, best_cost = cost_of_error;
      });
  return best;
}

StageSeconds stage_seconds(const std::vector<StageProfile>& stages) {
  StageSeconds seconds;
  for (const StageProfile& stage : stages) {
    if (stage.name == "gather at sensors") seconds.sensors = stage.seconds;
    if (stage.name == "find which rays are occluded") seconds.rays = stage.seconds;
  }
  return seconds;
}

SolveCost cost_of(const Scene& scene, const Solution& s, double seconds, StageSeconds& before) {
  const StageSeconds now = stage_seconds(s.report.stages);
  SolveCost cost;
  cost.sensors_s = now.sensors - before.sensors;
  cost.shooting_s = std::max(1e-4, seconds - cost.sensors_s);
  cost.rays_s = std::min(cost.shooting_s, now.rays - before.rays);
  before = now;
  const auto covered = std::count(s.vertex_covered.begin(), s.vertex_covered.end(), 1);
  cost.before = count_mesh(scene, {s.mesh.patch_edge_m, s.mesh.element_edge_m});
  const double elements = double(s.mesh.elements.size()), vertices = s.vertex_count();
  cost.mesh = {double(s.mesh.patches.size()), elements, vertices,
               vertices + elements - double(s.scene.polygons.size())};
  cost.uncovered = 1 - double(covered) / double(std::max(1u, s.vertex_count()));
  cost.sensors = s.sensors.size();
  const std::vector<Effect>& effects = s.report.effects;
  cost.occlusion = std::any_of(effects.begin(), effects.end(),
                               [](const Effect& e) { return e.name == "occlusion" && e.runs; });
  cost.unshot_relative = s.unshot_relative;
  return cost;
}

}  // namespace clrad
