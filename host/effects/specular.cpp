#include <fmt/format.h>

#include <algorithm>

#include "effects/effects.hpp"

namespace clrad {

Effect plan_specular(const Scene& scene, const SolveOptions&) {
  Effect effect;
  effect.stages = {"find what mirrors and glass show", "send rays on from mirrors and glass"};
  const auto count = std::count_if(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    return m.is_glass() || m.is_mirror();
  });
  effect.needed = count > 0;
  if (effect.needed) {
    effect.reason = fmt::format("{} of {} polygons mirror or are glass: pictures follow rays past them",
                                count, scene.polygons.size());
  } else {
    effect.reason = "no surface mirrors or is glass: what a picture's ray meets first is what it shows";
    effect.skip_error_relative = 0;
  }
  return effect;
}

}  // namespace clrad
