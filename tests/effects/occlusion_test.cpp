#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::make_room;

TEST(Occlusion, OnlyWhereSomethingMayStandBetween) {
  for (const bool turned : {false, true}) {
    const Scene open = make_room({.turned = turned});
    const Solution skipped = test::solve_alone(open, test::coarse());
    test::expect_no_trace(skipped, "occlusion");
    EXPECT_EQ(skipped.report.rays, 0u);
    for (const char* engine : {"auto", "chop", "serial"}) {
      SolveOptions options = test::forced(test::coarse(), "occlusion");
      options.engine = engine;
      const Solution forced = test::solve_alone(open, options);
      test::expect_trace(forced, "occlusion");
      EXPECT_GT(forced.report.rays, 0u);
      test::expect_same_bits(skipped, forced);
    }
    test::expect_trace(test::solve_alone(make_room({.block = true, .turned = turned}), test::coarse()),
                       "occlusion");
  }
}

// Also in the sampled estimators, in double, and for sensors.
TEST(Occlusion, SkippingItChangesNoBit) {
  const Scene open = make_room({.coloured_wall = true});
  for (const Estimator estimator : {Estimator::exact, Estimator::subdisk, Estimator::disk})
    for (const Precision precision : {Precision::float32, Precision::float64}) {
      SolveOptions options = test::coarse();
      options.estimator = estimator;
      options.sensors = {{{1, 1, 1}, {0, 0, 1}}, {{2, 3, 0}, {0, 0, 1}}};
      const Solution skipped = test::solve_alone(open, options, precision),
                     forced = test::solve_alone(open, test::forced(options, "occlusion"), precision);
      test::expect_no_trace(skipped, "occlusion");
      test::expect_same_bits(skipped, forced);
      for (std::size_t i = 0; i < 2; ++i)
        EXPECT_EQ(skipped.sensors[i].irradiance, forced.sensors[i].irradiance);
    }
}

// A lamp let into the ceiling lies in its plane, and covers it.
TEST(Occlusion, WhatLiesInAPlaneCoversWithoutIt) {
  Scene scene = make_room({});
  Polygon lamp = scene.polygons[5];
  for (auto& c : lamp.corner) c = 0.5 * (c + glm::dvec3(1.5, 2, 2.5));
  scene.polygons.push_back(lamp);
  const Solution skipped = test::solve_alone(scene, test::coarse()),
                 forced = test::solve_alone(scene, test::forced(test::coarse(), "occlusion"));
  EXPECT_FALSE(test::effect_of(skipped.report.effects, "occlusion").needed);
  EXPECT_GT(std::count(skipped.vertex_covered.begin(), skipped.vertex_covered.end(), 1), 0);
  test::expect_same_bits(skipped, forced);
}

TEST(Occlusion, ASensorBehindAWallCallsForIt) {
  SolveOptions options = test::coarse();
  options.sensors = {{{1, 1, 1}, {0, 0, 1}}};
  EXPECT_FALSE(test::effect_of(plan_effects(make_room({}), options), "occlusion").needed);
  options.sensors.push_back({{1, 1, 5}, {0, 0, -1}});
  const auto plan = plan_effects(make_room({}), options);
  EXPECT_TRUE(test::effect_of(plan, "occlusion").needed);
  EXPECT_NE(test::effect_of(plan, "occlusion").reason.find("sensor 2 "), std::string::npos);
}

TEST(Occlusion, LeftOutItIsSaidAndTheBlockCastsNoShadow) {
  const Scene scene = make_room({.block = true});
  const Solution all = test::solve_alone(scene, test::coarse()),
                 open = test::solve_alone(scene, test::without(test::coarse(), "occlusion"));
  EXPECT_GT(test::difference(all, open), 0.1);
  const auto& warnings = open.report.warnings;
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) {
    return w.find("occlusion was left out") != std::string::npos;
  }));
  const auto& parts = open.report.error.parts;
  EXPECT_TRUE(std::any_of(parts.begin(), parts.end(),
                          [](const ErrorPart& p) { return p.name == "without occlusion"; }));
}

}  // namespace
}  // namespace clrad
