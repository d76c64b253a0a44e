// The linear system of the kept columns, solved by GMRES on the device.
#pragma once
#include <functional>

#include "solve/state.hpp"

namespace clrad {

/// solution ~ A^-1 rhs, both [band][patch], A the balance form of `state` (kernels/solve/balance.cl) on the patches that
/// have columns. One cycle of at most `steps` steps for each band, ended where the residual in the norm sqrt(sum area x^2 / sum
/// area) is below `least` or below `relative` x that of rhs. Returns the largest such residual / that of rhs over the
/// bands, as the recurrence has it (0 where rhs is 0; NaN where something is not finite). `scale`: about the size of
/// rhs [W/m^2], which keeps squares in range. `goes_on` is told after each step what share of rhs is left; when it says no, the
/// solution is what the steps so far give. Same bits however the device divides the work.
double solve_by_gmres(SolveState& state, const RealArray& rhs, RealArray& solution, double scale,
                      double least, double relative, std::uint32_t steps,
                      const std::function<bool(double)>& goes_on = {});

}  // namespace clrad
