// Glass against closed forms: slabs, sheets, a prism, tints.
#include "render/reflect.hpp"

#include <gtest/gtest.h>

#include "render/specular.hpp"

namespace clrad {
namespace {

using namespace test;

// Through a slab of thickness w the ray goes on in its old direction, moved along the slab: it advances by
// w tan t in it instead of w tan i. What goes to and fro inside comes out 2 w tan t further on each time.
TEST(Reflect, ASlabOfGlassShiftsTheViewAndWeakensItByFresnel) {
  const double ior = 1.5, w = 0.3, top = 0.8, share = 0.9;
  const Behind behind(box({-1.9, -1.9, top - w}, {1.9, 1.9, top}, 1), glass(1, share, ior));
  ASSERT_EQ(specular_kinds(behind.scene)[0], SpecularKind::solid);
  const Camera camera = oblique();
  for (const unsigned depth : {2u, 4u})
    for (const Precision precision : {Precision::float32, Precision::float64}) {
      const Image image = render(test::device(precision), behind.solution, camera,
                                 {.width = 40, .height = 30, .samples_per_pixel = 1, .depth = depth});
      for (unsigned y = 0; y < 30; ++y)
        for (unsigned x = 0; x < 40; ++x) {
          const glm::dvec3 d = glm::normalize(ray(camera, 40, 30, x + 0.5, y + 0.5));
          const double i = std::acos(-d.z), t = std::asin(std::sin(i) / ior);
          const glm::dvec3 along = glm::normalize(glm::dvec3(d.x, d.y, 0));
          const glm::dvec3 enters = camera.eye + (camera.eye.z - top) / -d.z * d;
          const double r = fresnel(1, ior, i);
          // Each meeting with the slab: share (1 - R) goes on; R of all comes back.
          double expected = 0;
          for (unsigned k = 0; 2 * k + 2 <= depth; ++k) {
            const glm::dvec3 leaves = enters + (2 * k + 1) * w * std::tan(t) * along - glm::dvec3(0, 0, w);
            const glm::dvec3 seen = leaves + leaves.z / -d.z * d;
            expected += std::pow(share * (1 - r), 2) * std::pow(r, 2 * k) * 0.5 * Behind::field(seen) / pi;
          }
          // At most 4 surfaces are passed before the patch.
          const double bound = 0.5 / pi * 6.5 * behind.solution.frame.metres() * bent(4) + rounding(40);
          ASSERT_NEAR(image.radiance[y * 40 + x], expected, bound)
              << "pixel " << x << ", " << y << " depth " << depth;
        }
    }
}

TEST(Reflect, ClearGlassAtNormalIncidencePassesOneMinusRSquared) {
  for (const double ior : {1.33, 1.5, 2.4}) {
    const Behind behind(box({-1, -1, 0.3}, {1, 1, 0.5}, 1), glass(1, 1, ior));
    Camera camera;
    camera.eye = {0, 0, 1.5}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = 1e-3;
    const Image image = render(test::device(), behind.solution, camera,
                               {.width = 1, .height = 1, .samples_per_pixel = 1, .depth = 2});
    const double r = std::pow((ior - 1) / (ior + 1), 2);
    EXPECT_NEAR(image.radiance[0], std::pow(1 - r, 2) * 0.5 * 20 / pi, rounding(40)) << ior;
  }
}

// One polygon is a sheet: two surfaces in one, the ray goes straight on, from either side.
TEST(Reflect, ASheetOfGlassShiftsNothing) {
  const double ior = 1.5;
  for (const bool turned : {false, true}) {
    std::vector<glm::dvec3> corners = {
        {-1.5, -1.5, 0.7}, {1.5, -1.5, 0.7}, {1.5, 1.5, 0.7}, {-1.5, 1.5, 0.7}};
    if (turned) std::reverse(corners.begin(), corners.end());
    const Behind behind({polygon(corners)}, glass(1, 1, ior));
    ASSERT_EQ(specular_kinds(behind.scene)[0], SpecularKind::sheet);
    const Camera camera = oblique();
    const Image image =
        render(test::device(), behind.solution, camera, {.width = 40, .height = 30, .samples_per_pixel = 1});
    const double bound = 0.5 / pi * 6.5 * behind.solution.frame.metres() * once_bent + rounding(40);
    for (unsigned y = 0; y < 30; ++y)
      for (unsigned x = 0; x < 40; ++x) {
        const glm::dvec3 d = glm::normalize(ray(camera, 40, 30, x + 0.5, y + 0.5));
        const double r = fresnel(1, ior, std::acos(-d.z));
        const glm::dvec3 seen = camera.eye + camera.eye.z / -d.z * d;
        // T^2 (1 + R^2 + R^4 + ...) of two surfaces is (1 - R) / (1 + R).
        ASSERT_NEAR(image.radiance[y * 40 + x], (1 - r) / (1 + r) * 0.5 * Behind::field(seen) / pi, bound)
            << "pixel " << x << ", " << y;
      }
  }
}

// A right-angled prism turns the view by 90 degrees: straight in through one leg, reflected at the long side under 45
// degrees, straight out through the other. Index 1.5: totally (critical angle 41.8). Index 1.3: by Fresnel.
TEST(Reflect, APrismReflectsTotallyAboveTheCriticalAngle) {
  for (const double ior : {1.5, 1.3}) {
    // Legs x = 0 (facing -x) and y = 0 (facing -y) of length 1; the long side from (0, 1) to (1, 0).
    const auto p = [](double x, double y, double z) { return glm::dvec3(x, y, z); };
    Scene scene = test::scene({polygon({p(0, 0, -1), p(0, 0, 1), p(0, 1, 1), p(0, 1, -1)}, 1),
                               polygon({p(0, 0, -1), p(1, 0, -1), p(1, 0, 1), p(0, 0, 1)}, 1),
                               polygon({p(1, 0, -1), p(0, 1, -1), p(0, 1, 1), p(1, 0, 1)}, 1),
                               polygon({p(0, 0, 1), p(1, 0, 1), p(0, 1, 1)}, 1),
                               polygon({p(0, 0, -1), p(0, 1, -1), p(1, 0, -1)}, 1),
                               polygon({p(-1, -0.5, -1), p(-1, -0.5, 1), p(1, -0.5, 1), p(1, -0.5, -1)})});
    scene.materials = {test::material(1, 0, pi), glass(1, 1, ior)};
    ASSERT_EQ(specular_kinds(scene)[2], SpecularKind::solid);
    Camera camera;
    camera.eye = {-0.8, 0.4, 0}, camera.target = {0, 0.4, 0}, camera.vertical_field_of_view_rad = 1e-3;
    const Image image =
        render(test::device(), test::solution(scene, 1, [](auto, auto, auto&) { return 0.0; }), camera,
               {.width = 1, .height = 1, .samples_per_pixel = 1, .depth = 3});
    const double leg = fresnel(1, ior, 0), turn = fresnel(ior, 1, pi / 4);
    EXPECT_EQ(turn == 1, ior == 1.5);
    EXPECT_NEAR(image.radiance[0], std::pow(1 - leg, 2) * turn, 32 * std::ldexp(1, -24)) << ior;
  }
}

// What glass reflects has no tint, what it passes has; together no more than arrives.
TEST(Reflect, SharesOfTintedGlassStayBelowWhatArrives) {
  Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, 1),
                             polygon({{-2, -2, 1}, {-2, 2, 1}, {2, 2, 1}, {2, -2, 1}}),
                             polygon({{-2, -2, -1}, {2, -2, -1}, {2, 2, -1}, {-2, 2, -1}})},
                            3);
  scene.materials = {test::material(3, 0, pi), glass(3, 1, 1.7)};
  Material& m = scene.materials[1];
  m.transmission = {0.9, 0.3, 0.05}, m.specular = {0.05, 0.3, 0}, m.reflectance = {0.05, 0.2, 0.5};
  Camera camera;
  camera.eye = {0.3, 0.1, 0.9}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = 1e-3;
  const Image image = render(test::device(), test::solution(scene, 1, [](auto, auto, auto&) { return 0.0; }),
                             camera, {.width = 1, .height = 1, .samples_per_pixel = 1});
  const double angle = std::acos(0.9 / std::sqrt(0.91));
  const double one = fresnel(1, 1.7, angle), r = 2 * one / (1 + one);
  for (int b = 0; b < 3; ++b) {
    const double reflected = m.specular[b] + (1 - m.reflectance[b] - m.specular[b]) * r;
    const double passed = m.transmission[b] * (1 - r);
    EXPECT_NEAR(image.radiance[b], reflected + passed, 32 * std::ldexp(1, -24));
    EXPECT_LE(reflected + passed + m.reflectance[b], 1 + 1e-12);
  }
}

}  // namespace
}  // namespace clrad
