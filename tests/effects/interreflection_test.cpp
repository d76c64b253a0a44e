#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::make_room;

// Vertices get the same shots. Patches get the mean of the vertices' sums, not the sum of means: three roundings a term of
// eps = 6e-8 in sums of weights that add up to 1, and compensated sums of either.
TEST(Interreflection, OnlyWhereSomethingReflects) {
  for (const bool block : {false, true}) {
    const Scene black = make_room({.block = block, .black = true});
    Scene dark = black;
    for (Material& m : dark.materials) m.reflectance = test::white(0);
    SolveOptions options = test::coarse(1e-6);
    options.closure = Closure::off;  // closed rows would be scaled where interreflection runs
    const Solution skipped = test::solve_alone(dark, options),
                   forced = test::solve_alone(dark, test::forced(options, "interreflection"));
    test::expect_no_trace(skipped, "interreflection");
    test::expect_trace(forced, "interreflection");
    EXPECT_EQ(skipped.vertex_irradiance, forced.vertex_irradiance);
    double worst = 0, most = 0;
    for (std::size_t i = 0; i < skipped.patch_irradiance.size(); ++i) {
      worst = std::max(worst, std::abs(skipped.patch_irradiance[i] - forced.patch_irradiance[i]));
      most = std::max(most, skipped.patch_irradiance[i]);
    }
    EXPECT_GT(most, 0);
    EXPECT_LT(worst, 10 * 0x1p-24 * most);
    EXPECT_FALSE(skipped.stopped);
    EXPECT_LT(std::abs(skipped.report.energy.unaccounted_relative), 0.02);  // of the mesh: a closed room
  }
}

// In a closed room of mean reflectance R direct light is at least 1 - R_max of all.
TEST(Interreflection, LeftOutItsErrorIsWithinWhatThePlanSays) {
  const Scene scene = make_room({.coloured_wall = true, .block = true});
  const Solution all = test::solve_alone(scene, test::coarse(1e-6)),
                 direct = test::solve_alone(scene, test::without(test::coarse(1e-6), "interreflection"));
  const double bound = test::effect_of(direct.report.effects, "interreflection").skip_error_relative;
  EXPECT_EQ(bound, 0.8);  // the ceiling's
  double with = 0, without = 0;
  for (std::size_t i = 0; i < all.patch_irradiance.size(); ++i) {
    const double area = all.mesh.patches[i % all.mesh.patches.size()].area_m2;
    with += area * all.patch_irradiance[i], without += area * direct.patch_irradiance[i];
  }
  EXPECT_LT(without, with);
  EXPECT_GT(without, (1 - bound) * with);
  EXPECT_EQ(direct.report.reshoots, 0u);
  // What was reflected and not followed is not lost to the account.
  EXPECT_LT(std::abs(direct.report.energy.unaccounted_relative), 0.02);
  EXPECT_GT(direct.report.energy.unshot[0], 0.1 * direct.report.energy.emitted[0]);
}

TEST(Interreflection, DarkScenesNeedFewBounces) {
  Scene scene = make_room({});
  for (Material& m : scene.materials) m.reflectance = test::white(0.05);
  SolveOptions options;
  options.converge = 1e-3;
  const std::string reason = test::effect_of(plan_effects(scene, options), "interreflection").reason;
  EXPECT_NE(reason.find("after 3 bounces at most 0.00013"), std::string::npos) << reason;  // 0.05^3
}

TEST(Interreflection, GatheringWithoutItShootsInstead) {
  SolveOptions options = test::without(test::coarse(1e-6), "interreflection");
  const Scene scene = make_room({});
  const Solution progressive = test::solve_alone(scene, options);
  for (const Solver solver : {Solver::gathering, Solver::gauss_seidel}) {
    options.solver = solver;
    EXPECT_EQ(test::solve_alone(scene, options).vertex_irradiance, progressive.vertex_irradiance);
  }
}

}  // namespace
}  // namespace clrad
