#include <fmt/format.h>

#include <set>

#include "effects/effects.hpp"

namespace clrad {

Effect plan_textures(const Scene& scene, const SolveOptions&) {
  Effect effect;
  effect.stages = {"average textures over elements", "sample textures in the picture"};
  effect.needed = has_textures(scene);
  if (!effect.needed) {
    effect.reason = "no material has a texture: reflectance is the same all over each polygon";
    effect.skip_error_relative = 0;
    return effect;
  }
  std::set<std::uint32_t> used;
  std::size_t polygons = 0;
  for (const Polygon& p : scene.polygons) {
    const std::uint32_t texture = scene.materials[p.material].texture;
    if (texture == no_texture) continue;
    ++polygons;
    used.insert(texture);
  }
  double texels = 0;
  for (const std::uint32_t t : used) texels += double(scene.textures[t].width) * scene.textures[t].height;
  effect.reason = fmt::format("{} of {} polygons have a texture ({} in all, {:.3g} million texels)", polygons,
                              scene.polygons.size(), used.size(), texels / 1e6);
  return effect;
}

}  // namespace clrad
