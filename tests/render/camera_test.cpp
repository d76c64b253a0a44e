#include <gtest/gtest.h>

#include <numbers>

#include "render/render.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::meet;
using test::polygon;
using test::ray;

struct View {
  const char* name;
  glm::dvec3 eye;
  double field;
};

// Every pixel whose middle is inside the quad by projection is lit, every other is black. Pixels whose middle
// lies within `margin` metres of the outline may be either: 1e-5 of the quad's size, about 1/1000 of a pixel.
class Projection : public testing::TestWithParam<std::tuple<View, Precision>> {};

TEST_P(Projection, LitPixelsAreThoseInsideTheQuad) {
  const auto& [view, precision] = GetParam();
  const Scene scene =
      test::scene({polygon({{-0.7, -0.6, 0.1}, {0.8, -0.6, 0.1}, {0.7, 0.5, 0.1}, {-0.5, 0.7, 0.1}})});
  Camera camera;
  camera.eye = view.eye, camera.target = {0.1, 0.05, 0.1}, camera.vertical_field_of_view_rad = view.field;
  const ImageOptions options{.width = 120, .height = 80, .samples_per_pixel = 1};
  Device& device = test::device(precision);
  const Image image =
      render(device, test::solution(scene, 0.5, [](auto, auto, auto&) { return 2.0; }), camera, options);
  unsigned lit = 0, undecided = 0;
  for (unsigned y = 0; y < options.height; ++y)
    for (unsigned x = 0; x < options.width; ++x) {
      const double inside =
          meet(scene.polygons[0], camera.eye, ray(camera, options.width, options.height, x + 0.5, y + 0.5))
              .inside;
      if (std::abs(inside) < 1e-5) {
        ++undecided;
        continue;
      }
      ASSERT_EQ(image.radiance[y * options.width + x] > 0, inside > 0) << "pixel " << x << ", " << y;
      lit += inside > 0;
    }
  EXPECT_GT(lit, 800u);
  EXPECT_LT(lit, 9000u);
  EXPECT_LT(undecided, 5u);
}
INSTANTIATE_TEST_SUITE_P(Camera, Projection,
                         testing::Combine(testing::Values(View{"Near", {0.3, 0.4, 1.9}, 1.2},
                                                          View{"JustOutside", {0.5, 0.2, 4.5}, 0.5},
                                                          View{"Far", {30, 20, 100}, 0.02},
                                                          View{"VeryFar", {3e4, 2e4, 1e5}, 2e-5},
                                                          View{"Grazing", {1.9, 0.1, 0.6}, 0.8}),
                                          testing::Values(Precision::float32, Precision::float64)),
                         [](const auto& p) {
                           return std::string(std::get<0>(p.param).name) +
                                  (std::get<1>(p.param) == Precision::float32 ? "Float" : "Double");
                         });

TEST(Camera, CornersLandWhereProjectionSays) {
  // Eye 2 before the plane, 90 degrees: x = y = 1 lies at the middle of the half picture.
  const Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}})});
  Camera camera;
  camera.eye = {0, 0, 2}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = std::numbers::pi / 2;
  Device& device = test::device();
  const Image image = render(device, test::solution(scene, 1, [](auto, auto, auto&) { return 2.0; }), camera,
                             {.width = 80, .height = 40, .samples_per_pixel = 1});
  for (unsigned y = 0; y < 40; ++y)
    for (unsigned x = 0; x < 80; ++x)
      EXPECT_EQ(image.radiance[80 * y + x] > 0, x >= 30 && x < 50 && y >= 10 && y < 30) << x << ", " << y;
}

TEST(Camera, RaysThatMissTheSceneMeetNothing) {
  const Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}})});
  const Solution solution = test::solution(scene, 1, [](auto, auto, auto&) { return 2.0; });
  Device& device = test::device();
  for (const glm::dvec3 eye : {glm::dvec3(0, 0, 2), glm::dvec3(0, 0, 500)})
    for (const glm::dvec3 away : {glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0.3, 0.2, 1)}) {
      Camera camera;
      camera.eye = eye, camera.target = eye + away, camera.vertical_field_of_view_rad = 1;
      for (const float radiance :
           render(device, solution, camera, {.width = 15, .height = 15, .samples_per_pixel = 2}).radiance)
        ASSERT_EQ(radiance, 0);
    }
}

// n samples fall in n columns and (n a power of two) n rows: an edge parallel to the pixels covers to 1/n.
TEST(Camera, SamplesOfAPixelAreStratified) {
  const unsigned n = 16;
  for (const double edge : {0.1, 0.37, 0.5, 0.81})
    for (const bool upright : {true, false}) {
      const double x = upright ? 2 * edge - 1 : 1, y = upright ? -1 : 1 - 2 * edge;
      const Scene scene = test::scene({polygon({{-1, y, 0}, {x, y, 0}, {x, 1, 0}, {-1, 1, 0}})});
      Camera camera;
      camera.eye = {0, 0, 1}, camera.target = {0, 0, 0},
      camera.vertical_field_of_view_rad = std::numbers::pi / 2;
      Device& device = test::device();
      const Image image =
          render(device, test::solution(scene, 1, [](auto, auto, auto&) { return 2 * std::numbers::pi; }),
                 camera, {.width = 1, .height = 1, .samples_per_pixel = n});
      EXPECT_NEAR(image.radiance[0], edge, 1.0 / n + 1e-6);
    }
}

TEST(Camera, ImpossibleViewsAreRefused) {
  const Solution solution = test::solution(test::scene({polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})}), 0.5,
                                           [](auto, auto, auto&) { return 1.0; });
  Device& device = test::device();
  Camera camera;
  camera.target = camera.eye;
  EXPECT_THROW(render(device, solution, camera, {}), UsageError);
  camera.target = camera.eye + camera.up;
  EXPECT_THROW(render(device, solution, camera, {}), UsageError);
  camera = Camera{};
  camera.vertical_field_of_view_rad = 3.2;
  EXPECT_THROW(render(device, solution, camera, {}), UsageError);
  camera = Camera{};
  EXPECT_THROW(render(device, solution, camera, {.width = 0}), UsageError);
  EXPECT_THROW(render(device, solution, camera, {.samples_per_pixel = 0}), UsageError);
  EXPECT_THROW(render(device, solution, camera, {.width = 1u << 20, .height = 1u << 20}), UsageError);
}

}  // namespace
}  // namespace clrad
