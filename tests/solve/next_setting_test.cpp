// Which setting a search tries next, by what the last one was off by and took.
#include "solve/next_setting.hpp"

#include <gtest/gtest.h>

#include "effects/rooms.hpp"

namespace clrad {
namespace {

class NextSettingOf : public testing::Test {
 protected:
  const Scene scene = test::make_room({});
  const SolveSetting at{
      .patch_edge_m = 1, .level = 1, .samples = 4, .light_samples = 256, .sensor_rays = 1024};

  // A solve at `at` that took a second, half of it at sensors where there are some.
  SolveCost cost(std::uint64_t sensors) const {
    SolveCost c;
    c.sensors = sensors;
    c.sensors_s = sensors ? 0.5 : 0;
    c.shooting_s = 1 - c.sensors_s;
    c.before = c.mesh = count_mesh(scene, {at.patch_edge_m, at.element_edge_m()});
    return c;
  }
};

TEST_F(NextSettingOf, MakesFinerWhatTheErrorIsOf) {
  TargetErrors of_elements;
  of_elements.receiving = 0.04;
  const auto finer = next_setting(scene, of_elements, at, cost(0), 0.02, INFINITY, longest_step);
  ASSERT_TRUE(finer);
  EXPECT_LT(finer->setting.element_edge_m(), at.element_edge_m());
  EXPECT_EQ(finer->setting.samples, at.samples);
  EXPECT_LE(finer->error, 0.02);
  EXPECT_GT(finer->error, 0.01);  // no finer than need be

  TargetErrors of_rays;
  of_rays.at_sensors = true, of_rays.sampling = 0.04, of_rays.seen = 0.001;
  const auto more = next_setting(scene, of_rays, at, cost(20), 0.02, INFINITY, longest_step);
  ASSERT_TRUE(more);
  EXPECT_GT(more->setting.sensor_rays, at.sensor_rays);
  EXPECT_EQ(more->setting.patch_edge_m, at.patch_edge_m);
  EXPECT_EQ(more->setting.element_edge_m(), at.element_edge_m());
}

TEST_F(NextSettingOf, MoreSamplesTakeWhatTheirRaysTook) {
  TargetErrors e;
  e.visibility = 0.04;
  SolveCost c = cost(0);
  for (const double rays_s : {0.0, 0.1}) {
    c.rays_s = rays_s;
    const auto next = next_setting(scene, e, at, c, 0.025, INFINITY, longest_step);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->setting.samples, 4 * at.samples);
    EXPECT_EQ(next->setting.element_edge_m(), at.element_edge_m());
    EXPECT_NEAR(next->seconds, 1 + 3 * rays_s, 1e-9);
  }
}

TEST_F(NextSettingOf, AtSensorsNoStepIsTooLong) {
  TargetErrors e;
  e.at_sensors = true, e.seen = 0.2, e.sampling = 0.001;
  const double longest = longest_of_target(true);
  EXPECT_LT(longest, longest_of_target(false));
  const auto next = next_setting(scene, e, at, cost(20), 0.001, INFINITY, longest);
  ASSERT_TRUE(next);
  EXPECT_LE(next->seconds, longest);
  // What helps most, whether it meets the target or not: half of that time at least is made use of.
  EXPECT_GT(next->seconds, longest / 2);
}

TEST_F(NextSettingOf, StaysInTheTimeThatIsLeftAndInTheLongestStep) {
  TargetErrors e;
  e.receiving = e.shooting = 0.05;
  for (const double left : {2.0, 5.0, 100.0})
    for (const double longest : {3.0, longest_step}) {
      const auto next = next_setting(scene, e, at, cost(0), 0, left, longest);
      ASSERT_TRUE(next) << left << " " << longest;
      EXPECT_LE(next->seconds, std::min(left, longest));
      EXPECT_LT(next->error, 0.9 * e.total());
    }
  EXPECT_FALSE(next_setting(scene, e, at, cost(0), 0, 0.5, longest_step));
}

TEST_F(NextSettingOf, ShootsOnWhereUnshotLightIsMuchOfTheError) {
  TargetErrors e;
  e.unshot = 0.03, e.receiving = 0.001;
  SolveCost c = cost(0);
  c.unshot_relative = 0.1;
  const auto next = next_setting(scene, e, at, c, 0.02, INFINITY, longest_step);
  ASSERT_TRUE(next);
  // In proportion: 15 % of what is aimed at is left of it.
  EXPECT_NEAR(next->setting.converge, 0.1 * 0.15 * 0.02 / 0.03, 1e-9);
  EXPECT_EQ(next->setting.element_edge_m(), at.element_edge_m());
}

TEST_F(NextSettingOf, TwoStepsOfATimeBudgetGrowAlike) {
  const SolveCost c = cost(0);  // a second
  // All that is left in one step where that is no longer than the longest; else the root of it, so that another as long fits in.
  EXPECT_EQ(longest_of_budget(c, 8), longest_step);
  EXPECT_NEAR(longest_of_budget(c, 64 / 0.75), 8, 1e-9);
  EXPECT_EQ(longest_of_budget(c, 1e6), longest_step);
}

}  // namespace
}  // namespace clrad
