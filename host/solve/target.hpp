// Solving to a target: an error that is asked for, or what can be had in a time.
#pragma once
#include <functional>

#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/solution.hpp"
#include "clrad/solver.hpp"

namespace clrad {

using SolveOnce = std::function<Solution(const SolveOptions&)>;

/// Solves coarsely (for a target at sensors as fine as a plain room needs), and again with finer patches, elements, more samples or rays from sensors, until the estimated error is at most
/// options.target_error (0: none asked for) or options.time_budget_s is used up (0: there is no limit). Each next setting is the cheapest one that
/// should meet the target by what the last one's parts of the error were (with a time budget, the best that should be
/// done in time), so that the last solve takes most of all time. Returns the best solution; its report says what was tried.
/// `device` is what `solve_once` runs on: kernels are loaded at their first use, which says nothing of the next solve's time.
Solution solve_to_target(Device& device, const Scene& scene, const SolveOptions& options,
                         const SolveOnce& solve_once);

/// What that would come to, by its first, coarse solves alone.
TargetForecast foretell_target(Device& device, const Scene& scene, const SolveOptions& options,
                               const SolveOnce& solve_once);

}  // namespace clrad
