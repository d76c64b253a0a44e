// Errors that are handed on to sensors, where what comes of them is known.
#include "solve/seen_error.hpp"

#include <gtest/gtest.h>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "visibility/open.hpp"

namespace clrad {
namespace {

// In a closed box of one reflectance an error r of the light everywhere that is not yet handed on is seen as rho r, and each reflection hands
// on rho of it: r rho / (1 - rho), or with one step between, times rho.
TEST(SeenError, WhatIsTheSameEverywhereIsAGeometricSeries) {
  const double rho = 0.5, off = 0.3;
  const Scene scene = oracle::box_scene({1, 2, 1.5}, {rho}, {1});
  Device device;
  SolveOptions o;
  o.mesh = {0.5, 0.125}, o.error = false;
  o.sensors = {{{0.5, 1, 0.7}, {0, 0, 1}}, {{0.2, 0.4, 0.3}, {0, 1, 0}}};
  Solution s = solve(device, scene, o);
  const auto engine = make_open(device);
  SolveState state(device, s.scene, s.mesh, 1, *engine, o, s.vertex_covered, s.frame.metres());
  state.enclosure = find_enclosure(scene);
  ASSERT_TRUE(state.enclosure.closed);
  Random random(1);
  const std::vector<CheckPoint> points = points_in_elements(s, 400, random);
  const std::vector<double> residual(points.size(), off);
  const double all = off * rho / (1 - rho);
  // 192 places count alike but for a factor of a few, and of the square their own products, a few 192nds, are taken away; of the series
  // what comes after less than 0.02 is left, 4 % of the square.
  const auto expect = [&](bool regathered, double expected) {
    const std::vector<double> square = seen_error_square(state, s, points, residual, residual, regathered);
    ASSERT_EQ(square.size(), 1u);
    EXPECT_LT(square[0], expected * expected);
    EXPECT_GT(square[0], 0.9 * expected * expected);
  };
  expect(false, all);
  expect(true, rho * all);
  // Without interreflection only the first step is there; of balanced rows what is the same everywhere is not handed on.
  state.interreflection = false;
  expect(false, off * rho);
  state.interreflection = true, state.balanced = true;
  expect(true, rho * rho * off);
  // Of errors of either sign from point to point little is left: their mean over 400 points.
  std::vector<double> either(points.size());
  for (std::size_t k = 0; k < either.size(); ++k) either[k] = k % 2 == 0 ? off : -off;
  EXPECT_LT(seen_error_square(state, s, points, either, either, false)[0], 0.1 * off * rho * off * rho);
}

}  // namespace
}  // namespace clrad
