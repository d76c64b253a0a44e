// Direct light alone: the ray tracer that the radiosity picture is compared with.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "oracle/point_factor.hpp"
#include "render/render.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::meet;
using test::polygon;
using test::ray;

constexpr double pi = std::numbers::pi;

// Material 0: a floor of reflectance 0.5; 1: a lamp of exitance 10 pi; 2: black; 3: a mirror of 0.8.
Scene lit(std::vector<Polygon> polygons) {
  Scene scene = test::scene(polygons);
  scene.materials = {test::material(1, 0.5), test::material(1, 0, 10 * pi), test::material(1, 0),
                     test::material(1, 0)};
  scene.materials[3].specular = {0.8};
  return scene;
}
Polygon floor_at(double y) {
  return polygon({{-2, y, -2}, {-2, y, 2}, {2, y, 2}, {2, y, -2}});
}
// A unit square that faces down.
Polygon lamp(double y) {
  return polygon({{-0.5, y, -0.5}, {0.5, y, -0.5}, {0.5, y, 0.5}, {-0.5, y, 0.5}}, 1);
}
Camera view(const glm::dvec3& eye, const glm::dvec3& target, double field) {
  Camera camera;
  camera.eye = eye, camera.target = target, camera.up = {0, 0, 1};
  camera.vertical_field_of_view_rad = field;
  return camera;
}

// The closed form of Lambert at every point of the floor. In float a point is off by up to 2^-17 units of the frame
// (shade_test.cpp), over which the factor, with the lamp one metre up, changes by less than 1 a metre; the
// factor itself is good to 1e-5 (kernels/shared/factor.cl).
TEST(Whitted, UnoccludedSquareLightIsLambertsFormula) {
  const Scene scene = lit({floor_at(0), lamp(1)});
  const Camera camera = view({0.1, 0.9, 0.2}, {0.2, 0, 0}, 1.6);
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    const Image image = render_whitted(test::device(precision), scene, camera,
                                       {.width = 48, .height = 32, .samples_per_pixel = 1});
    const double bound = 0.5 * 10 * (1e-5 + frame_of(scene).metres() * std::ldexp(1, -17));
    for (unsigned y = 0; y < 32; ++y)
      for (unsigned x = 0; x < 48; ++x) {
        const auto m = meet(scene.polygons[0], camera.eye, ray(camera, 48, 32, x + 0.5, y + 0.5));
        if (m.inside < 1e-4) continue;
        const auto& c = scene.polygons[1].corner;
        const double factor = oracle::point_factor<double>(m.point, {0, 1, 0}, {c[0], c[1], c[2], c[3]});
        ASSERT_NEAR(image.radiance[y * 48 + x], 0.5 * 10 * factor, bound) << x << ", " << y;
      }
    EXPECT_EQ(image.unit, "W/(sr m^2)");
  }
}

// From right below a square of half-side a at height h: 4 times the factor of a corner's quarter,
//   F = 4 / (2 pi) (2 a / sqrt(a^2 + h^2)) atan(a / sqrt(a^2 + h^2)).
TEST(Whitted, RightBelowALightIsTheClosedForm) {
  const double h = 1.3, a = 0.5, root = std::sqrt(a * a + h * h);
  const double factor = 2 / pi * (2 * a / root) * std::atan(a / root);
  const Image image =
      render_whitted(test::device(), lit({floor_at(0), lamp(h)}), view({0, 1, 0}, {0, 0, 0}, 1e-3),
                     {.width = 1, .height = 1, .samples_per_pixel = 1});
  EXPECT_NEAR(image.radiance[0], 5 * factor, 5 * 1e-5);
}

// A sheet halfway up hides one half of the light from the point below its edge, by symmetry half of the irradiance. The
// samples are 8 x 8 cells, 32 on either side; one weighs 1 / r^4 with r^2 between 16 and 16.5, so all weights are
// within 6.2 % of each other. The share of one half is then off by at most a quarter of that.
TEST(Whitted, HalfOccludedLightGivesHalf) {
  const double h = 4;
  const Polygon sheet = polygon({{-2, h / 2, -2}, {0, h / 2, -2}, {0, h / 2, 2}, {-2, h / 2, 2}}, 2);
  const Camera camera = view({0.4, 1, 0.3}, {1e-9, 0, 0}, 1e-7);
  const auto at = [&](std::vector<Polygon> polygons) {
    return render_whitted(test::device(Precision::float64), lit(std::move(polygons)), camera,
                          {.width = 1, .height = 1, .samples_per_pixel = 1, .light_samples = 64})
        .radiance[0];
  };
  const float open = at({floor_at(0), lamp(h)}), half = at({floor_at(0), lamp(h), sheet});
  EXPECT_GT(open, 0);
  EXPECT_NEAR(half / open, 0.5, 0.25 * 0.062);
  const Polygon all = polygon({{-2, h / 2, -2}, {2, h / 2, -2}, {2, h / 2, 2}, {-2, h / 2, 2}}, 2);
  EXPECT_EQ(at({floor_at(0), lamp(h), all}), 0);
}

TEST(Whitted, LampsShowTheirEmissionAndNothingElseIsLit) {
  // A lamp, a floor that it lights, and a floor that only sees the lit one.
  const Scene scene =
      lit({floor_at(0), lamp(1), polygon({{-2, -1, -2}, {2, -1, -2}, {2, -1, 2}, {-2, -1, 2}})});
  const Image up = render_whitted(test::device(), scene, view({0, 0.2, 0}, {0, 1, 0}, 0.1),
                                  {.width = 2, .height = 2, .samples_per_pixel = 2});
  for (const float radiance : up.radiance) EXPECT_NEAR(radiance, 10, 1e-5);
  const Image below = render_whitted(test::device(), scene, view({0, -1.5, 0}, {0, -1, 0}, 0.1),
                                     {.width = 2, .height = 2, .samples_per_pixel = 2});
  for (const float radiance : below.radiance) EXPECT_EQ(radiance, 0);
  Scene dark = scene;
  dark.materials[1] = test::material(1, 0.5);
  for (const float radiance : render_whitted(test::device(), dark, view({0, 0.5, 0}, {0, 0, 0}, 1),
                                             {.width = 4, .height = 4, .samples_per_pixel = 2})
                                  .radiance)
    EXPECT_EQ(radiance, 0);
}

// A mirror at x = 1.5 shows the floor from the mirrored eye, left and right exchanged: the same points, lit alike.
// Rounding of positions as in reflect_test.cpp, 6 x 2^-17 units in all, against the factor's gradient as above.
TEST(Whitted, MirrorsShowDirectLight) {
  const Polygon mirror = polygon({{1.5, 0, -2}, {1.5, 0, 2}, {1.5, 2, 2}, {1.5, 2, -2}}, 3);
  const Scene with = lit({floor_at(0), lamp(1), mirror}), without = lit({floor_at(0), lamp(1)});
  Camera camera = view({0.6, 0.9, 0.3}, {1.5, 0.5, 0.3}, 0.4), other = camera;
  camera.up = other.up = {0, 1, 0};
  other.eye.x = 3 - camera.eye.x;
  const ImageOptions options{.width = 31, .height = 20, .samples_per_pixel = 1};
  const Image seen = render_whitted(test::device(), with, camera, options),
              direct = render_whitted(test::device(), without, other, options);
  const double bound =
      0.5 * 10 *
      (2e-5 + 6 * std::max(frame_of(with).metres(), frame_of(without).metres()) * std::ldexp(1, -17));
  unsigned compared = 0;
  for (unsigned y = 0; y < 20; ++y)
    for (unsigned x = 0; x < 31; ++x) {
      const glm::dvec3 d = ray(camera, 31, 20, x + 0.5, y + 0.5), on = meet(mirror, camera.eye, d).point;
      const glm::dvec3 back(-d.x, d.y, d.z);
      const auto floor = meet(with.polygons[0], on, back), light = meet(with.polygons[1], on, back);
      if (back.y >= 0 || floor.inside < 1e-4 || std::abs(light.inside) < 1e-4) continue;
      const float exact = direct.radiance[y * 31 + (30 - x)];
      ASSERT_GT(exact, 0);
      ASSERT_NEAR(seen.radiance[y * 31 + x], 0.8 * exact, bound) << x << ", " << y;
      ++compared;
    }
  EXPECT_GT(compared, 300u);
}

TEST(Whitted, SameBitsWhateverWorkGroupMemoryOrEngine) {
  Scene scene = lit({floor_at(0), lamp(1), polygon({{-0.6, 0.4, -0.3}, {0.3, 0.5, -0.3}, {0.2, 0.5, 0.6}}, 2),
                     polygon({{1.5, 0, -2}, {1.5, 0, 2}, {1.5, 2, 2}, {1.5, 2, -2}}, 3)});
  const Camera camera = view({0.4, 0.9, 0.2}, {0.5, 0, 0}, 1.6);
  const ImageOptions options{.width = 37, .height = 29, .samples_per_pixel = 3, .light_samples = 40};
  const Image first = render_whitted(test::device(), scene, camera, options);
  Device other({.work_group_size = 16});
  EXPECT_EQ(render_whitted(other, scene, camera, options).radiance, first.radiance);
  const Frame frame = frame_of(scene);
  const auto triangles = occluder_triangles(scene, frame, plane_ids(scene));
  for (const auto& name : engine_names()) {
    const auto engine = make_engine(name, test::device(), triangles);
    EXPECT_EQ(
        render_whitted_through(test::device(), *engine, triangles, scene, frame, camera, options).radiance,
        first.radiance)
        << name;
  }
  Device tight({.memory_bytes = 2 << 20});
  const auto engine = make_engine("serial", tight, triangles);
  EXPECT_EQ(render_whitted_through(tight, *engine, triangles, scene, frame, camera, options).radiance,
            first.radiance)
      << "batches";
  // From a solution it is the same picture: none of the solution is used but the scene.
  ImageOptions direct = options;
  direct.whitted = true;
  const Solution solution = test::solution(scene, 0.5, [](auto, auto, auto&) { return 99.0; });
  EXPECT_EQ(render(test::device(), solution, camera, direct).radiance, first.radiance);
}

// A pane of index 1 over the camera takes its share of each band and throws no shadow. A float's roundings: of the product, and
// of a picture's sum.
TEST(Whitted, LightPassesGlass) {
  Scene scene =
      lit({floor_at(0), lamp(1), polygon({{-2, 0.95, -2}, {2, 0.95, -2}, {2, 0.95, 2}, {-2, 0.95, 2}}, 4)});
  scene.bands = {"a", "b"};
  scene.materials = {test::material(2, 0.5), test::material(2, 0, 10 * pi), test::material(2, 0),
                     test::material(2, 0), test::material(2, 0)};
  const auto picture = [&](double a, double b) {
    scene.materials[4].transmission = {a, b}, scene.materials[4].ior = 1;
    return render_whitted(test::device(), scene, view({0.1, 0.9, 0.2}, {0.2, 0, 0}, 1.6),
                          {.width = 24, .height = 16, .samples_per_pixel = 1})
        .radiance;
  };
  const auto clear = picture(1, 1), tinted = picture(0.5, 0.125);
  for (std::size_t i = 0; i < clear.size(); i += 2) {
    EXPECT_NEAR(tinted[i], 0.5 * clear[i], 1e-6 * clear[i]);
    EXPECT_NEAR(tinted[i + 1], 0.125 * clear[i + 1], 1e-6 * clear[i + 1]);
    EXPECT_EQ(clear[i], clear[i + 1]);
  }
  EXPECT_GT(*std::max_element(clear.begin(), clear.end()), 0.1f);
}

TEST(Whitted, ImpossibleSampleCountsAreRefused) {
  const Scene scene = lit({floor_at(0), lamp(1)});
  EXPECT_THROW(render_whitted(test::device(), scene, view({0, 0.5, 0}, {0, 0, 0}, 1), {.light_samples = 0}),
               UsageError);
}

// A point light beside a lamp: I cos / r^2 more of irradiance, nothing of it in the lamp's own shadow. A point is off as
// above, over which H changes by less than 2 I a metre at a distance of 1.
TEST(Whitted, PointLight) {
  Scene scene = lit({floor_at(0), lamp(0.5)});
  scene.materials[1].emitted_exitance = {0};
  PunctualLight light;
  light.position_m = {0.2, 1, 0.1};
  light.intensity = {3};
  scene.lights = {light};
  const Camera camera = view({0.1, 0.45, 0.2}, {0.2, 0, 0}, 1.6);
  const Image image =
      render_whitted(test::device(), scene, camera, {.width = 48, .height = 32, .samples_per_pixel = 1});
  const double bound = 0.5 / pi * 3 * (1e-5 + 2 * frame_of(scene).metres() * std::ldexp(1, -17));
  int dark = 0, bright = 0;
  for (unsigned y = 0; y < 32; ++y)
    for (unsigned x = 0; x < 48; ++x) {
      const auto m = meet(scene.polygons[0], camera.eye, ray(camera, 48, 32, x + 0.5, y + 0.5));
      if (m.inside < 1e-4) continue;
      const glm::dvec3 to = light.position_m - m.point, hit = m.point + 0.5 * to;
      const double edge = std::max(std::abs(hit.x), std::abs(hit.z));
      if (std::abs(edge - 0.5) < 1e-3) continue;
      const double h = edge < 0.5 ? 0 : 3 * to.y / std::pow(glm::length(to), 3);
      ASSERT_NEAR(image.radiance[y * 48 + x], 0.5 / pi * h, bound) << x << ", " << y;
      ++(edge < 0.5 ? dark : bright);
    }
  EXPECT_GT(dark, 50);
  EXPECT_GT(bright, 50);
}

}  // namespace
}  // namespace clrad
