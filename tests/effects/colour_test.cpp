#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::make_room;
using test::Room;

std::uint64_t bytes_of(const Solution& s) {
  std::uint64_t bytes = 0;
  for (const StageProfile& stage : s.report.stages) bytes += stage.bytes;
  return bytes;
}

// What two solves of one problem differ by: what each left unshot, reflected at most 1 / (1 - 0.8) times, and rounding.
double allowed(const Solution& a, const Solution& b) {
  double sum = 0;
  for (const Solution* s : {&a, &b})
    for (const ErrorPart& part : s->report.error.parts)
      sum += part.name == "convergence" ? 5 * part.relative : part.relative;
  return sum;
}

// A parameter of other stages: what it would cost is allocated by none of them.
TEST(Colour, AlikeBandsAreSolvedOnce) {
  for (const bool block : {false, true}) {
    const Scene grey = make_room({.block = block});
    Scene one = grey;
    one.bands = {"grey"};
    for (Material& m : one.materials) m.reflectance.resize(1), m.emitted_exitance.resize(1);
    test::solve_alone(
        grey, test::forced(test::coarse(1e-6), "colour"));  // scratch that a device keeps is made once
    const Solution skipped = test::solve_alone(grey, test::coarse(1e-6)),
                   single = test::solve_alone(one, test::coarse(1e-6)),
                   forced = test::solve_alone(grey, test::forced(test::coarse(1e-6), "colour"));
    EXPECT_FALSE(test::effect_of(skipped.report.effects, "colour").runs);
    EXPECT_EQ(skipped.bands, 3u);
    EXPECT_EQ(bytes_of(skipped), bytes_of(single));
    EXPECT_LT(bytes_of(skipped), bytes_of(forced));
    const std::size_t n = skipped.vertex_count();
    for (std::size_t i = 0; i < 3 * n; ++i)
      ASSERT_EQ(skipped.vertex_irradiance[i], single.vertex_irradiance[i % n]);
    EXPECT_LT(test::difference(forced, skipped), allowed(forced, skipped));
  }
}

TEST(Colour, OneLightsColourIsAFactor) {
  const Scene scene = make_room({.coloured_light = true, .block = true});
  const Solution skipped = test::solve_alone(scene, test::coarse(1e-6)),
                 forced = test::solve_alone(scene, test::forced(test::coarse(1e-6), "colour"));
  EXPECT_FALSE(test::effect_of(skipped.report.effects, "colour").runs);
  EXPECT_TRUE(test::effect_of(forced.report.effects, "colour").runs);
  EXPECT_LT(test::difference(forced, skipped), allowed(forced, skipped));
  for (std::uint32_t b = 0; b < 3; ++b)
    EXPECT_NEAR(skipped.report.energy.emitted[b], forced.report.energy.emitted[b], 1e-12);
  // Relative to the mean of all bands, whose values differ. Gathers are rounded to some 1e-5 of the light, of which the error is
  // hundreds of times as much here.
  EXPECT_GT(forced.report.error.total_relative, 2e-3);
  EXPECT_NEAR(skipped.report.error.total_relative, forced.report.error.total_relative, 1e-5);
}

TEST(Colour, ColouredWallsAndLampsOfTwoColoursCallForIt) {
  for (const Room room : {Room{.coloured_wall = true}, Room{.second_lamp = true}}) {
    const Solution s = test::solve_alone(make_room(room), test::coarse(1e-6));
    EXPECT_TRUE(test::effect_of(s.report.effects, "colour").runs);
    const std::size_t n = s.vertex_count();
    double differs = 0;
    for (std::size_t v = 0; v < n; ++v)
      differs = std::max(differs, std::abs(s.vertex_irradiance[v] - s.vertex_irradiance[2 * n + v]));
    EXPECT_GT(differs, 0.01);
  }
}

TEST(Colour, LeftOutTheSolutionIsGrey) {
  const Solution s =
      test::solve_alone(make_room({.coloured_wall = true}), test::without(test::coarse(1e-6), "colour"));
  EXPECT_EQ(s.bands, 1u);
  EXPECT_EQ(s.scene.bands, std::vector<std::string>{"grey"});
  // 0.6, 0.1 and 0.2 by their luminance, in float.
  EXPECT_NEAR(s.scene.materials[0].reflectance[0], 0.2126 * 0.6 + 0.7152 * 0.1 + 0.0722 * 0.2, 1e-7);
}

}  // namespace
}  // namespace clrad
