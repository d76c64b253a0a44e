#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effects/effects.hpp"

namespace clrad {

namespace {

// Of all bands; of a material with a texture its factor x the largest texel.
double largest_diffuse(const Scene& scene) {
  std::vector<bool> used(scene.materials.size(), false);
  for (const Polygon& p : scene.polygons) used[p.material] = true;
  double most = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Material& m = scene.materials[i];
    float texel = 1;
    if (m.texture != no_texture) {
      const std::vector<float>& texels = scene.textures[m.texture].texels;
      texel = texels.empty() ? 0 : *std::max_element(texels.begin(), texels.end());
    }
    for (const double rho : m.reflectance) most = std::max(most, rho * double(texel));
  }
  return std::min(most, 0.999999);  // a factor of 1 and a texel of nearly 1 round to that
}

}  // namespace

// With R the largest reflectance, flux that arrives after k reflections is at most R^k of what is emitted, in all. So direct
// light is at least 1 - R of all light: leaving the rest out errs by at most R of it.
Effect plan_interreflection(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"account for what is absorbed and unshot", "shoot again from kept columns",
                   "solve the linear system of kept columns"};
  const double most = largest_diffuse(scene);
  effect.needed = most > 0;
  effect.skip_error_relative = most;
  if (!effect.needed) {
    effect.reason = "no surface reflects diffusely: all light is direct";
    return effect;
  }
  const double bounces = std::ceil(std::log(options.converge) / std::log(most));
  effect.reason =
      bounces <= 16
          ? fmt::format(
                "surfaces reflect up to {:.3g} of the light: after {} bounces at most {:.2g} of it is left",
                most, bounces, std::pow(most, bounces))
          : fmt::format(
                "surfaces reflect up to {:.3g} of the light: {} bounces could matter, so the linear system "
                "is "
                "solved for all of them",
                most, bounces);
  return effect;
}

}  // namespace clrad
