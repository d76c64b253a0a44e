#include <gtest/gtest.h>

#include "render/render.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::polygon;

// A floor, a wall and a block's two sides: edges, occlusion, a triangle and a general quad.
Solution corner_scene() {
  const Scene scene = test::scene({polygon({{0, 0, 2}, {2, 0, 2}, {2, 0, 0}, {0, 0, 0}}),
                                   polygon({{0, 0, 0}, {2, 0, 0}, {1.8, 1.5, 0}, {0, 1.7, 0}}),
                                   polygon({{0.6, 0, 1.2}, {1.1, 0, 1.3}, {1.1, 0.9, 1.3}, {0.6, 0.8, 1.2}}),
                                   polygon({{1.1, 0, 1.3}, {1.2, 0, 0.8}, {1.1, 0.9, 1.3}})},
                                  3);
  return test::solution(scene, 0.25, [](std::uint32_t p, std::uint32_t band, const glm::dvec3& x) {
    return 2.0 + p + std::sin(5 * x.x + band) + std::cos(4 * x.y + 3 * x.z);
  });
}

Camera corner_camera() {
  Camera camera;
  camera.eye = {1.6, 1.2, 4}, camera.target = {0.9, 0.5, 0.5};
  return camera;
}

constexpr ImageOptions small_picture{.width = 61, .height = 47, .samples_per_pixel = 5};

TEST(Render, SameBitsWhateverWorkGroupMemoryOrEngine) {
  const Solution solution = corner_scene();
  Device& device = test::device();
  const Image first = render(device, solution, corner_camera(), small_picture);
  EXPECT_EQ(render(device, solution, corner_camera(), small_picture).radiance, first.radiance)
      << "second run";
  for (const unsigned group : {16u, 128u}) {
    Device other({.work_group_size = group});
    EXPECT_EQ(render(other, solution, corner_camera(), small_picture).radiance, first.radiance)
        << "work-groups of " << group;
  }
  const auto triangles = occluder_triangles(solution.scene, solution.frame, plane_ids(solution.scene));
  {
    // 1 MiB: the picture takes several batches of pixels.
    Device other({.memory_bytes = 1 << 20});
    const auto engine = make_engine("serial", other, triangles);
    EXPECT_EQ(render_through(other, *engine, triangles, solution, corner_camera(), small_picture).radiance,
              first.radiance)
        << "batches";
    EXPECT_LE(other.ledger()->peak, 1u << 20);
    for (const auto& stage : other.profile())
      if (stage.name == "shade pixels") {
        EXPECT_GT(stage.launches, 2u);
      }
  }
  for (const auto& name : engine_names()) {
    const auto engine = make_engine(name, device, triangles);
    EXPECT_EQ(render_through(device, *engine, triangles, solution, corner_camera(), small_picture).radiance,
              first.radiance)
        << name;
  }
  test::PlainEngine plain(triangles, false);
  EXPECT_EQ(render_through(device, plain, triangles, solution, corner_camera(), small_picture).radiance,
            first.radiance)
      << "brute force on the host";
}

TEST(Render, ImageCarriesSizeBandsAndUnit) {
  Solution solution = corner_scene();
  Device& device = test::device();
  Image image = render(device, solution, corner_camera(), small_picture);
  EXPECT_EQ(image.width, 61u);
  EXPECT_EQ(image.height, 47u);
  EXPECT_EQ(image.bands, 3u);
  EXPECT_EQ(image.radiance.size(), 3u * 61 * 47);
  EXPECT_EQ(image.unit, "W/(sr m^2)");
  solution.scene.quantity = Quantity::photometric;
  EXPECT_EQ(render(device, solution, corner_camera(), small_picture).unit, "cd/m^2");
}

TEST(Render, TooLittleMemoryIsAClearError) {
  Device device({.memory_bytes = 4096});
  EXPECT_THROW(render(device, corner_scene(), corner_camera(), small_picture), DeviceError);
}

}  // namespace
}  // namespace clrad
