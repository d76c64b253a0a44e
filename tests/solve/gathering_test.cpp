// All solvers solve the same system.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

// Light that is still unshot is what answers may differ by: at most 2 x converge of the mean, in the mean over patches;
// float sums over 72 columns add 1e-5.
TEST(Gathering, SameAnswerAsProgressive) {
  Device device;
  const Scene scene = oracle::scene_of(
      oracle::reference_case(oracle::reference("c_scenes_with_occlusion.json"), "C-block-room-1")
          .at("scene"));
  SolveOptions options;
  options.mesh = {1.0, 0.25};
  options.converge = 1e-5;
  const Solution shot = solve(device, scene, options);
  double mean = 0;
  for (const double h : shot.vertex_irradiance) mean += h / double(shot.vertex_irradiance.size());
  const auto differs = [&](const SolveOptions& with) {
    const Solution other = solve(device, scene, with);
    EXPECT_LT(other.unshot_relative, 1e-5);
    double sum = 0;
    for (std::size_t i = 0; i < shot.vertex_irradiance.size(); ++i)
      sum += std::abs(other.vertex_irradiance[i] - shot.vertex_irradiance[i]) /
             double(shot.vertex_irradiance.size());
    return sum / mean;
  };
  options.solver = Solver::gathering;
  EXPECT_LT(differs(options), 3e-5);
  options.solver = Solver::gauss_seidel;
  EXPECT_LT(differs(options), 3e-5);
  options.solver = Solver::progressive;
  options.shooters = 8;
  EXPECT_LT(differs(options), 3e-5);
}

// A sweep of Gauss-Seidel uses what the same sweep has found already: fewer sweeps than Jacobi's iteration.
TEST(Gathering, GaussSeidelTakesFewerSweeps) {
  Device device;
  const Scene scene = oracle::scene_of(
      oracle::reference_case(oracle::reference("c_scenes_with_occlusion.json"), "C-block-room-1")
          .at("scene"));
  SolveOptions options;
  options.mesh = {1.0, 0.5};
  options.converge = 1e-4;
  options.solver = Solver::gathering;
  const std::uint64_t jacobi = solve(device, scene, options).report.reshoots;
  options.solver = Solver::gauss_seidel;
  EXPECT_LT(solve(device, scene, options).report.reshoots, jacobi);
}

}  // namespace
}  // namespace clrad
