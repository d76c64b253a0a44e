/// One function an effect, each in a file of its own: what the scene calls for and why. They fill in everything but
/// Effect::runs, which plan_effects() decides from the options.
#pragma once
#include "clrad/effects.hpp"

namespace clrad {

Effect plan_specular(const Scene& scene, const SolveOptions& options);
Effect plan_two_sided(const Scene& scene, const SolveOptions& options);
Effect plan_textures(const Scene& scene, const SolveOptions& options);

}  // namespace clrad
