/// One function an effect, each in a file of its own: what the scene calls for and why. They fill in everything but
/// Effect::runs, which plan_effects() decides from the options.
#pragma once
#include "clrad/effects.hpp"

namespace clrad {

/// Throws UsageError where options.force_effects or options.without name an effect that there is not.
void check_effect_names(const SolveOptions& options);

Effect plan_colour(const Scene& scene, const SolveOptions& options);
Effect plan_occlusion(const Scene& scene, const SolveOptions& options);
Effect plan_interreflection(const Scene& scene, const SolveOptions& options);
Effect plan_subdivision(const Scene& scene, const SolveOptions& options);
Effect plan_lights(const Scene& scene, const SolveOptions& options);
Effect plan_near_field(const Scene& scene, const SolveOptions& options);
Effect plan_specular(const Scene& scene, const SolveOptions& options);
Effect plan_transmission(const Scene& scene, const SolveOptions& options);
Effect plan_two_sided(const Scene& scene, const SolveOptions& options);
Effect plan_textures(const Scene& scene, const SolveOptions& options);

}  // namespace clrad
