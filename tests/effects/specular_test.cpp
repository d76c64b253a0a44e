#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

// Launches that a picture takes for what mirrors show.
std::uint64_t specular_launches(const Scene& scene, const SolveOptions& options) {
  Device device;
  const Solution solution = solve(device, scene, options);
  Camera camera;
  camera.eye = {1, 1, 1}, camera.target = {1.5, 2, 0};
  device.reset_profile();
  render(device, solution, camera, {.width = 8, .height = 8, .samples_per_pixel = 1});
  std::vector<Effect> effects = plan_effects(scene, options);
  charge(effects, "specular", device.profile());
  return test::effect_of(effects, "specular").launches;
}

TEST(Specular, PicturesFollowRaysOnlyWhereSomethingMirrors) {
  SolveOptions options;
  options.mesh = {2, 1};
  EXPECT_GT(specular_launches(test::make_room({.mirror = true}), options), 0u);
  EXPECT_EQ(specular_launches(test::make_room({}), options), 0u);
  EXPECT_EQ(specular_launches(test::make_room({}), test::forced(options, "specular")), 0u);
}

}  // namespace
}  // namespace clrad
