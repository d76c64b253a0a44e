// Options that no scene could be solved with.
#pragma once
#include "clrad/options.hpp"

namespace clrad {

/// Throws UsageError that says which and why. solve() begins with it; the command line calls it before it reads the scene.
void check_options(const SolveOptions& options);

}  // namespace clrad
