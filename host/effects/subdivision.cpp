#include <fmt/format.h>

#include <algorithm>

#include "effects/effects.hpp"
#include "scene/enclosure.hpp"

namespace clrad {
namespace {

// The same reflectance and emission everywhere.
bool is_uniform(const Scene& scene) {
  const Material& first = scene.materials[scene.polygons.front().material];
  return std::all_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    return m.reflectance == first.reflectance && m.emitted_exitance == first.emitted_exitance;
  });
}

}  // namespace

Effect plan_subdivision(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"judge elements", "subdivide elements"};
  if (!(options.adaptive.tolerance > 0)) {
    effect.needed = false;
    effect.reason = "not asked for: --adaptive splits elements where light changes quickly";
    return effect;
  }
  // Where every row of form factors sums to 1, B = E / (1 - rho) solves B = E + rho F B.
  if (!scene.polygons.empty() && scene.lights.empty() && is_uniform(scene) && find_enclosure(scene).closed) {
    effect.needed = false;
    effect.skip_error_relative = 0;
    effect.reason = "a closed room whose surfaces all emit and reflect alike is equally bright everywhere";
    return effect;
  }
  effect.reason = fmt::format(
      "elements are split where radiosity differs by more than {:.3g} of its mean; patches where it "
      "does not stay as they are",
      options.adaptive.tolerance);
  return effect;
}

}  // namespace clrad
