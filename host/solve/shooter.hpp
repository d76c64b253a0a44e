// Patch -> shooter: corners, samples.
#pragma once
#include "solve/form_factor.hpp"
#include "solve/state.hpp"

namespace clrad {

/// The patch as the form-factor kernels want it, in the frame.
Shooter shooter_of(const Scene& scene, const Mesh& mesh, std::uint32_t patch, double metres_per_unit);

/// How many samples the patch gets: options.samples, times four until one sample carries less than 1/light_samples of the
/// scene's emitted power, so that shadows of bright sources do not show as steps.
std::uint32_t samples_of(const SolveState& state, std::uint32_t patch);

/// The samples themselves: common to all receivers of this shooter and new for the next, so that errors do not add up.
std::vector<Point> samples_on(const Shooter& shooter, std::uint32_t patch, std::uint32_t n,
                              std::uint64_t seed);

}  // namespace clrad
