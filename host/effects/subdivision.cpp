#include <fmt/format.h>

#include "effects/effects.hpp"
#include "effects/uniform.hpp"

namespace clrad {
Effect plan_subdivision(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"find elements to split", "subdivide elements"};
  if (!(options.adaptive.tolerance > 0)) {
    effect.needed = false;
    effect.reason = "not asked for: --adaptive splits elements where light changes quickly";
    return effect;
  }
  if (is_uniform_enclosure(scene)) {
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
