#include <fmt/format.h>

#include "effects/effects.hpp"
#include "scene/backs.hpp"

namespace clrad {

// No stage is there for it alone: a back is a polygon as others are.
Effect plan_two_sided(const Scene& scene, const SolveOptions&) {
  Effect effect;
  const TwoSided found = find_two_sided(scene);
  std::size_t fronts = 0;
  if (!found.backs.empty())
    for (const Polygon& p : scene.polygons) fronts += !p.back;
  effect.needed = !found.backs.empty();
  const std::string inside =
      found.dark == 0
          ? ""
          : fmt::format("; the dark insides of closed solids, {} polygons, are left out", found.dark);
  if (effect.needed) {
    effect.reason =
        fmt::format("{} of {} polygons reflect and emit on both sides: each is solved as two, back to back{}",
                    found.backs.size(), fronts, inside);
  } else {
    effect.reason = found.dark == 0
                        ? "no material is two-sided: the backs of all polygons are black"
                        : "only closed solids are two-sided, and no light gets into them" + inside;
    effect.skip_error_relative = 0;
  }
  return effect;
}

}  // namespace clrad
