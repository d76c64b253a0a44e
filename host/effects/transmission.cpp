#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "effects/effects.hpp"
#include "scene/extent.hpp"

namespace clrad {
namespace {

// Glass polygons that are looked at one by one: more of them are some object, with something behind it.
constexpr std::size_t most_looked_at = 256;
// What is nearer to a plane is in it, relative to the scene's size: some steps of the grid on which visibility is decided
// (2^-38 of a frame that is up to twice as large).
constexpr double as_in_plane = 0x1p-35;
// Sizes of lists that people read.
constexpr std::size_t most_names = 3;

// Is there any surface or sensor on either side of the polygon's plane? If not, no light passes the polygon to anything.
bool parts_the_scene(const Scene& scene, const SolveOptions& options, const Polygon& glass, double extent) {
  const glm::dvec3 normal = glass.normal();
  bool front = false, back = false;
  const auto look_at = [&](const glm::dvec3& p) {
    const double height = glm::dot(p - glass.corner[0], normal);
    // Written so that NaN counts as both.
    front |= !(height <= as_in_plane * extent);
    back |= !(height >= -as_in_plane * extent);
  };
  for (const Sensor& sensor : options.sensors) look_at(sensor.position_m);
  for (const Polygon& p : scene.polygons) {
    for (std::uint32_t k = 0; k < p.corners; ++k) look_at(p.corner[k]);
    if (front && back) return true;
  }
  return front && back;
}

std::string names_of_glass(const Scene& scene) {
  std::vector<std::string> names;
  std::size_t more = 0;
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) {
    if (!scene.materials[m].is_glass()) continue;
    const bool used = std::any_of(scene.polygons.begin(), scene.polygons.end(),
                                  [&](const Polygon& p) { return p.material == m; });
    if (!used) continue;
    if (names.size() < most_names)
      names.push_back(fmt::format("\"{}\"", scene.materials[m].name));
    else
      ++more;
  }
  return fmt::format("{}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

}  // namespace

Effect plan_transmission(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"multiply by what glass lets pass"};
  std::vector<const Polygon*> glass;
  for (const Polygon& p : scene.polygons)
    if (scene.materials[p.material].is_glass()) glass.push_back(&p);
  effect.needed = false;
  effect.skip_error_relative = 0;
  if (glass.empty()) {
    effect.reason = "no surface is glass: what is in the way of light stops it";
    return effect;
  }
  const double extent = extent_m(scene);
  effect.needed = glass.size() > most_looked_at ||
                  std::any_of(glass.begin(), glass.end(),
                              [&](const Polygon* p) { return parts_the_scene(scene, options, *p, extent); });
  const std::string count =
      fmt::format("{} of {} polygons {} glass ({})", glass.size(), scene.polygons.size(),
                  glass.size() == 1 ? "is" : "are", names_of_glass(scene));
  if (effect.needed) {
    effect.reason = fmt::format("{}: light passes them to what is behind", count);
    effect.skip_error_relative = -1;
  } else {
    effect.reason = fmt::format("{}, and nothing is behind them: what light they let pass is gone", count);
  }
  return effect;
}

}  // namespace clrad
