#include <fmt/format.h>

#include <algorithm>

#include "effects/effects.hpp"

namespace clrad {

Effect plan_lights(const Scene& scene, const SolveOptions&) {
  Effect effect;
  effect.stages = {"light from point, spot and directional lights"};
  effect.needed = !scene.lights.empty();
  if (!effect.needed) {
    effect.reason = "the file has no point, spot or directional light: all light is emitted by surfaces";
    effect.skip_error_relative = 0;
    return effect;
  }
  const auto count = [&](PunctualLight::Kind kind) {
    return std::count_if(scene.lights.begin(), scene.lights.end(),
                         [&](const PunctualLight& l) { return l.kind == kind; });
  };
  const auto emits = std::count_if(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const auto& exitance = scene.materials[p.material].emitted_exitance;
    return std::any_of(exitance.begin(), exitance.end(), [](double e) { return e > 0; });
  });
  effect.reason = fmt::format(
      "{} point, {} spot and {} directional lights shine beside {} polygons that emit: each sends one ray to "
      "every vertex that faces it",
      count(PunctualLight::Kind::point), count(PunctualLight::Kind::spot),
      count(PunctualLight::Kind::directional), emits);
  const bool dark = std::all_of(scene.lights.begin(), scene.lights.end(), [](const PunctualLight& l) {
    return std::all_of(l.intensity.begin(), l.intensity.end(), [](double i) { return i == 0; });
  });
  // Lights of no intensity bring nothing; where nothing else emits, lights are all the light there is.
  if (dark)
    effect.skip_error_relative = 0;
  else if (emits == 0)
    effect.skip_error_relative = 1;
  return effect;
}

}  // namespace clrad
