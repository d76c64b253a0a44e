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
  std::vector<std::string> kinds;
  const auto name = [&](PunctualLight::Kind kind, const char* word) {
    if (const auto n = count(kind); n > 0)
      kinds.push_back(fmt::format("{} {} light{}", n, word, n == 1 ? "" : "s"));
  };
  name(PunctualLight::Kind::point, "point"), name(PunctualLight::Kind::spot, "spot"),
      name(PunctualLight::Kind::directional, "directional");
  effect.reason = fmt::format(
      "there {} {} beside {} of {} polygons that emit: one ray from every vertex that faces it to each light",
      scene.lights.size() == 1 ? "is" : "are", fmt::join(kinds, ", "), emits, scene.polygons.size());
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
