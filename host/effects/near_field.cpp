#include <fmt/format.h>

#include "effects/effects.hpp"
#include "effects/uniform.hpp"

namespace clrad {

Effect plan_near_field(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"gather near patches by their elements"};
  if (!options.near_field) {
    effect.needed = false;
    effect.reason = "not wanted: --no-near-field lights vertices by the mean of a patch however near it is";
  } else if (is_uniform_enclosure(scene)) {
    effect.needed = false;
    effect.skip_error_relative = 0;
    effect.reason =
        "a closed room whose surfaces all emit and reflect alike: the mean of a patch says it all";
  } else {
    effect.reason = "vertices next to a patch see how its brightness varies, not its mean";
  }
  return effect;
}

}  // namespace clrad
