// Errors that are handed on to sensors, where what comes of them is known.
#include "solve/seen_error.hpp"

#include <gtest/gtest.h>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "visibility/open.hpp"

namespace clrad {
namespace {

// A box of one reflectance, two sensors in it, and 400 points of its walls. Rays have nothing in their way.
struct Box {
  double rho = 0.5;
  Scene scene = oracle::box_scene({1, 2, 1.5}, {rho}, {1});
  Device device;
  std::vector<Point> sensors;
  Solution s;
  std::unique_ptr<VisibilityEngine> engine = make_open(device);
  std::unique_ptr<SolveState> state;
  std::vector<CheckPoint> points;

  Box() {
    SolveOptions o;
    o.mesh = {0.5, 0.125}, o.error = false;
    s = solve(device, scene, o);
    state = std::make_unique<SolveState>(device, s.scene, s.mesh, 1, *engine, o, s.vertex_covered,
                                         s.frame.metres());
    state->enclosure = find_enclosure(scene);
    for (const Sensor& at : {Sensor{{0.5, 1, 0.7}, {0, 0, 1}}, Sensor{{0.2, 0.4, 0.3}, {0, 1, 0}}})
      sensors.push_back({s.frame.to_frame(at.position_m), at.normal, 0xffffffffu, 0xffffffffu});
    Random random(1);
    points = points_in_elements(s, 400, random);
  }
  double square(const std::vector<double>& first, const std::vector<double>& second) {
    return seen_error_square(*state, s, sensors, points, {first, second}).at(0);
  }
};

// In a closed box of one reflectance an error r of the light everywhere that is not yet handed on is seen as rho r, and each reflection hands
// on rho of it: r rho / (1 - rho).
TEST(SeenError, WhatIsTheSameEverywhereIsAGeometricSeries) {
  Box box;
  ASSERT_TRUE(box.state->enclosure.closed);
  const double off = 0.3, all = off * box.rho / (1 - box.rho);
  const std::vector<double> residual(box.points.size(), off);
  // 400 points count alike but for a factor of a few, and of the square half of their own products, a few 400ths, is taken away; of the
  // series what comes after less than 0.02 is left, 4 % of the square.
  const auto expect = [&](double expected) {
    const double square = box.square(residual, residual);
    EXPECT_LT(square, expected * expected);
    EXPECT_GT(square, 0.9 * expected * expected);
  };
  expect(all);
  // Without interreflection only the first step is there.
  box.state->interreflection = false;
  expect(off * box.rho);
  // Balanced rows leave the mean as it is, but what is far more than chance is no mistake of the few points.
  box.state->interreflection = box.state->balanced = true;
  expect(all);
}

// Errors of either sign from point to point leave their mean over 400 points, of which half the chance is kept; a mean that is chance is handed
// on by no balanced rows.
TEST(SeenError, WhatIsNotTheSameEverywhereHardlyAddsUp) {
  Box box;
  std::vector<double> either(box.points.size());
  for (std::size_t k = 0; k < either.size(); ++k) either[k] = k % 2 == 0 ? 0.3 : -0.3;
  EXPECT_LT(box.square(either, either), 0.1 * std::pow(0.3 * box.rho, 2));
  either[0] += 3;  // the mean is 3 / 400, the chance by which it may be that 3 / 400, too
  const double open = box.square(either, either);
  box.state->balanced = true;
  EXPECT_LT(box.square(either, either), open);
}

// Noise of either measurement is half of their difference: it cannot be told from an error of that size, and counts as one.
TEST(SeenError, NoiseCountsAsAnError) {
  Box box;
  const std::vector<double> first(box.points.size(), 0.1), second(box.points.size(), -0.1);
  const double all = 0.1 * box.rho / (1 - box.rho), square = box.square(first, second);
  EXPECT_LT(square, all * all);
  EXPECT_GT(square, 0.9 * all * all);
}

}  // namespace
}  // namespace clrad
