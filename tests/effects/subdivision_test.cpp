#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::make_room;

SolveOptions adaptive_options() {
  SolveOptions options;
  options.mesh = {1, 0.5};
  options.adaptive.tolerance = 0.05;
  return options;
}

// B = E / (1 - rho) = 2 everywhere. What is left: 1e-3 of the emitted power not yet shot, and factors whose rows were closed.
TEST(Subdivision, NotInARoomThatIsEquallyBrightEverywhere) {
  const Scene furnace = make_room({.uniform = true});
  const Solution skipped = test::solve_alone(furnace, adaptive_options());
  test::expect_no_trace(skipped, "subdivision");
  test::expect_no_trace(skipped, "near_field");
  SolveOptions options = adaptive_options();
  options.force_effects = {"subdivision", "near_field"};
  const Solution forced = test::solve_alone(furnace, options);
  test::expect_trace(forced, "subdivision");
  test::expect_trace(forced, "near_field");
  for (const Solution* s : {&skipped, &forced})
    for (const double h : s->vertex_irradiance) ASSERT_NEAR(h, 2, 2e-3);

  const Solution room = test::solve_alone(make_room({.block = true}), adaptive_options());
  test::expect_trace(room, "subdivision");
  test::expect_trace(room, "near_field");
  EXPECT_GT(room.report.refinement.elements_split, 0u);
}

TEST(Subdivision, NotWhereItIsNotAskedFor) {
  SolveOptions options = adaptive_options();
  options.adaptive.tolerance = 0;
  test::expect_no_trace(test::solve_alone(make_room({.block = true}), options), "subdivision");
}

// Where elements are so small that nothing differs by 5 % across them, judging them changes nothing.
TEST(Subdivision, ForcedWhereNothingDiffersItChangesNoBit) {
  SolveOptions options;
  options.mesh = {3, 0.05};
  Scene scene = make_room({});
  for (Material& m : scene.materials) m.emitted_exitance = test::white(1);  // nearly uniform
  options.adaptive.every = 1000;
  const Solution skipped = test::solve_alone(scene, options),
                 forced = test::solve_alone(scene, test::forced(options, "subdivision"));
  test::expect_trace(forced, "subdivision");
  ASSERT_EQ(forced.report.refinement.elements_split, 0u);
  test::expect_same_bits(skipped, forced);
}

}  // namespace
}  // namespace clrad
