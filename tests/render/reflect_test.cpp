#include "render/reflect.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "render/support.hpp"

namespace clrad {
namespace {

using test::meet;
using test::polygon;
using test::ray;

constexpr double pi = std::numbers::pi;

Material mirror(unsigned bands, double specular) {
  Material m = test::material(bands, 0);
  m.specular.assign(bands, specular);
  return m;
}

Material glass(unsigned bands, double transmission, double ior) {
  Material m = test::material(bands, 0);
  m.transmission.assign(bands, transmission);
  m.ior = ior;
  return m;
}

// Six sides facing outward, corners shared to the last bit.
std::vector<Polygon> box(const glm::dvec3& a, const glm::dvec3& b, std::uint32_t material) {
  const auto c = [&](int i, int j, int k) { return glm::dvec3(i ? b.x : a.x, j ? b.y : a.y, k ? b.z : a.z); };
  return {polygon({c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(1, 0, 0)}, material),
          polygon({c(0, 0, 1), c(1, 0, 1), c(1, 1, 1), c(0, 1, 1)}, material),
          polygon({c(0, 0, 0), c(1, 0, 0), c(1, 0, 1), c(0, 0, 1)}, material),
          polygon({c(0, 1, 0), c(0, 1, 1), c(1, 1, 1), c(1, 1, 0)}, material),
          polygon({c(0, 0, 0), c(0, 0, 1), c(0, 1, 1), c(0, 1, 0)}, material),
          polygon({c(1, 0, 0), c(1, 1, 0), c(1, 1, 1), c(1, 0, 1)}, material)};
}

// Fresnel's reflected share of unpolarised light from index n1 to n2, from the angles (Born & Wolf 1.5).
double fresnel(double n1, double n2, double angle) {
  const double sine = n1 / n2 * std::sin(angle);
  if (sine >= 1) return 1;
  const double t = std::asin(sine);
  if (angle == 0) return std::pow((n1 - n2) / (n1 + n2), 2);
  const double s = std::sin(angle - t) / std::sin(angle + t), p = std::tan(angle - t) / std::tan(angle + t);
  return 0.5 * (s * s + p * p);
}

// How far off the point may be where a ray ends that met one surface before, in frame units. Where a camera ray meets a
// plane: 2^-17 (shade_test.cpp). It starts again from there; its new direction, unit vectors after some 32 roundings
// of numbers up to 1, is off by 2^-19, which over a path of at most 4 units is 2^-17; where it meets the last
// plane, at a cosine above 0.5, that doubles, and another meeting costs 2^-17 again.
const double once_bent = 5 * std::ldexp(1, -17);
// Each surface more doubles nothing where it is met at such angles again, but adds the same direction error and a meeting.
double bent(int surfaces) {
  return once_bent + (surfaces - 1) * 4 * std::ldexp(1, -17);
}

// Radiance of the field rho B / pi with values up to `largest`, through some 16 more roundings of throughputs.
double rounding(double largest) {
  return 0.5 * largest / pi * 24 * std::ldexp(1, -24);
}

// ---- mirrors ----------------------------------------------------------------------------------------------------------

struct MirrorCase {
  const char* name;
  glm::dvec3 normal;
  Precision precision;
};
class PlaneMirror : public testing::TestWithParam<MirrorCase> {};

glm::dvec3 mirrored(const glm::dvec3& p, const glm::dvec3& on, const glm::dvec3& normal) {
  return p - 2 * glm::dot(p - on, normal) * normal;
}

// The picture of a patch in a plane mirror is the picture of the patch alone from the mirrored camera, left and right
// exchanged: a reflection keeps up and forward but turns a right hand into a left one.
TEST_P(PlaneMirror, ShowsTheViewFromTheMirroredCamera) {
  const glm::dvec3 n = glm::normalize(GetParam().normal), middle(0, 0, 0);
  const glm::dvec3 e1 = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), n)), e2 = glm::cross(n, e1);
  const Polygon in_mirror = polygon({middle - 0.6 * e1 - 0.5 * e2, middle + 0.6 * e1 - 0.5 * e2,
                                     middle + 0.5 * e1 + 0.6 * e2, middle - 0.6 * e1 + 0.5 * e2},
                                    1);
  // A patch on one side of the camera, facing the mirror; the camera looks at the mirror from the other.
  const glm::dvec3 at = middle + 1.2 * n + 0.7 * e1;
  const glm::dvec3 f = glm::normalize(middle - at), f1 = glm::normalize(glm::cross(e2, f)),
                   f2 = glm::cross(f, f1);
  const Polygon patch = polygon({at - 0.35 * f1 - 0.4 * f2, at + 0.4 * f1 - 0.3 * f2,
                                 at + 0.3 * f1 + 0.45 * f2, at - 0.4 * f1 + 0.4 * f2});
  Scene with = test::scene({patch, in_mirror}, 3), without = test::scene({patch}, 3);
  for (Scene* s : {&with, &without}) s->materials = {test::material(3, 0.5, 0.3 * pi), mirror(3, 0.8)};
  with.materials[1].specular = {0.8, 0.6, 0.7};
  const auto field = [](std::uint32_t p, std::uint32_t band, const glm::dvec3& x) {
    return p == 1 ? 0 : 20 + band + (3 + band) * x.x - 4 * x.y + 2 * x.z;
  };
  const Solution in = test::solution(with, 0.2, field), alone = test::solution(without, 0.2, field);
  Camera camera;
  camera.eye = middle + 1.3 * n - 0.75 * e1 + 0.1 * e2;
  camera.target = middle, camera.up = e2 + 0.2 * e1, camera.vertical_field_of_view_rad = 0.6;
  Camera other = camera;
  other.eye = mirrored(camera.eye, middle, n), other.target = mirrored(camera.target, middle, n);
  other.up = mirrored(camera.up, {0, 0, 0}, n);

  const ImageOptions options{.width = 90, .height = 64, .samples_per_pixel = 1};
  Device& device = test::device(GetParam().precision);
  const Image seen = render(device, in, camera, options), direct = render(device, alone, other, options);
  // Gradient of the field at most sqrt(25 + 16 + 4) a metre; the direct picture is off by 2^-17 units, too.
  const double metres = std::max(in.frame.metres(), alone.frame.metres());
  const double bound = 0.5 / pi * 7 * metres * (once_bent + std::ldexp(1, -17)) + rounding(60);
  unsigned lit = 0, dark = 0;
  for (unsigned y = 0; y < 64; ++y)
    for (unsigned x = 0; x < 90; ++x) {
      const glm::dvec3 d = ray(camera, 90, 64, x + 0.5, y + 0.5);
      const auto in_glass = meet(in_mirror, camera.eye, d);
      const glm::dvec3 on = glm::dvec3(0), to = mirrored(d, on, n);
      const auto behind = meet(patch, in_glass.point, to);
      // Within 1e-4 m of an outline a pixel may be either: some three times what the point may be off.
      if (in_glass.inside < 1e-4 || std::abs(behind.inside) < 1e-4) continue;
      for (unsigned band = 0; band < 3; ++band) {
        const float* exact = &direct.radiance[3 * (y * 90 + (89 - x))];
        const double expected = with.materials[1].specular[band] * exact[band];
        const double got = seen.radiance[3 * (y * 90 + x) + band];
        ASSERT_NEAR(got, expected, bound) << "pixel " << x << ", " << y << " band " << band;
        // And by projection alone, with no picture to compare with.
        const double field_there = behind.inside > 0 ? 0.3 + 0.5 * field(0, band, behind.point) / pi : 0;
        ASSERT_NEAR(got, with.materials[1].specular[band] * field_there, bound);
      }
      (behind.inside > 0 ? lit : dark) += 1;
    }
  EXPECT_GT(lit, 400u);
  EXPECT_GT(dark, 100u);
}
INSTANTIATE_TEST_SUITE_P(Reflect, PlaneMirror,
                         testing::Values(MirrorCase{"Upright", {0, 0, 1}, Precision::float32},
                                         MirrorCase{"Tilted", {0.3, -0.5, 1}, Precision::float32},
                                         MirrorCase{"TiltedTheOtherWay", {-1, 0.4, -0.2}, Precision::float32},
                                         MirrorCase{"TiltedDouble", {0.3, -0.5, 1}, Precision::float64}),
                         [](const auto& p) { return p.param.name; });

// Two mirrors face each other and glow by themselves: what is seen is 1 + s + s^2 + ..., to the depth limit.
Solution between_mirrors(double specular) {
  Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}),
                             polygon({{-1, -1, 0.1}, {-1, 1, 0.1}, {1, 1, 0.1}, {1, -1, 0.1}})});
  scene.materials[0] = mirror(1, specular);
  scene.materials[0].emitted_exitance = {pi};
  return test::solution(scene, 0.5, [](auto, auto, auto&) { return 0.0; });
}
Camera between() {
  Camera camera;
  camera.eye = {0, 0, 0.06}, camera.target = {0.01, 0.005, 0}, camera.vertical_field_of_view_rad = 0.1;
  return camera;
}

TEST(Reflect, ParallelMirrorsMultiplyToTheDepthLimit) {
  const Solution solution = between_mirrors(0.75);
  Device& device = test::device();
  double expected = 1, power = 1;
  for (unsigned depth = 0; depth <= 9; ++depth) {
    const Image image = render(device, solution, between(),
                               {.width = 5, .height = 4, .samples_per_pixel = 1, .depth = depth});
    for (const float radiance : image.radiance)
      EXPECT_NEAR(radiance, expected, expected * (depth + 4) * std::ldexp(1, -23)) << "depth " << depth;
    power *= 0.75, expected += power;
  }
}

// 2^-12 is still followed, 2^-13 no longer: 13 terms whatever the depth.
TEST(Reflect, FaintRaysEndAtTheStatedThreshold) {
  Device& device = test::device();
  const Image image = render(device, between_mirrors(0.5), between(),
                             {.width = 3, .height = 3, .samples_per_pixel = 2, .depth = 64});
  for (const float radiance : image.radiance)
    EXPECT_NEAR(radiance, 2 - std::ldexp(1, -12), std::ldexp(1, -20));
}

TEST(Reflect, AMirrorsBackIsBlackAndOpaque) {
  Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}),
                             polygon({{-1, -1, 0.5}, {-1, 1, 0.5}, {1, 1, 0.5}, {1, -1, 0.5}}, 1)});
  scene.materials[0] = test::material(1, 0, pi);
  scene.materials.push_back(mirror(1, 0.9));
  Camera camera;
  camera.eye = {0, 0, 1.5}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = 0.4;
  Device& device = test::device();
  for (const float radiance : render(device, test::solution(scene, 1, [](auto, auto, auto&) { return 1.0; }),
                                     camera, {.width = 3, .height = 3, .samples_per_pixel = 1})
                                  .radiance)
    EXPECT_EQ(radiance, 0);
}

// ---- glass ------------------------------------------------------------------------------------------------------------

// A patch in z = 0, larger than is seen, with a field of its own; before it what `more` holds.
struct Behind {
  Scene scene;
  Solution solution;
  static double field(const glm::dvec3& x) { return 20 + 5 * x.x - 4 * x.y; }
  Behind(const std::vector<Polygon>& more, const Material& material, unsigned bands = 1) {
    std::vector<Polygon> polygons = more;
    for (Polygon& p : polygons) p.material = 1;
    polygons.push_back(polygon({{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}));
    scene = test::scene(polygons, bands);
    scene.materials.push_back(material);
    const auto patch = std::uint32_t(polygons.size() - 1);
    solution = test::solution(scene, 0.5, [patch](std::uint32_t p, std::uint32_t, const glm::dvec3& x) {
      return p == patch ? field(x) : 0;
    });
  }
};

Camera oblique() {
  Camera camera;
  camera.eye = {0.2, 0.9, 1.9}, camera.target = {0, 0, 0.5}, camera.vertical_field_of_view_rad = 0.25;
  return camera;
}

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

// ---- which polygons, and what they cost ---------------------------------------------------------------------------------

TEST(SpecularKinds, OnlyAClosedSurfaceAllOfGlassIsASolid) {
  std::vector<Polygon> polygons = box({0, 0, 0}, {1, 1, 1}, 1);
  for (Polygon& p : box({2, 0, 0}, {3, 1, 1}, 1)) polygons.push_back(p);
  polygons[6 + 2].material = 0;  // the second has one diffuse side
  for (Polygon& p : box({4, 0, 0}, {5, 1, 1}, 1)) polygons.push_back(p);
  polygons.pop_back();  // the third is open
  for (Polygon& p : box({6, 0, 0}, {7, 1, 1}, 2)) polygons.push_back(p);
  Scene scene = test::scene(polygons);
  scene.materials = {test::material(1, 0.5), glass(1, 1, 1.5), mirror(1, 0.5)};
  const auto kinds = specular_kinds(scene);
  for (std::size_t p = 0; p < polygons.size(); ++p) {
    const auto expected = p < 6        ? SpecularKind::solid
                          : p == 6 + 2 ? SpecularKind::none
                          : p < 12 + 5 ? SpecularKind::sheet
                                       : SpecularKind::mirror;
    EXPECT_EQ(kinds[p], expected) << p;
  }
}

// A floor, a tilted mirror, a block and a sheet of glass.
Solution hall_of_mirrors() {
  std::vector<Polygon> polygons = box({0.9, 0.05, 0.7}, {1.4, 0.8, 1.2}, 2);
  polygons.push_back(polygon({{0, 0, 2}, {2, 0, 2}, {2, 0, 0}, {0, 0, 0}}));
  polygons.push_back(polygon({{0, 0, 0}, {2, 0, 0}, {2, 1.8, 0.2}, {0, 1.8, 0.2}}, 1));
  polygons.push_back(polygon({{0.2, 0, 1.4}, {0.7, 0, 1.3}, {0.7, 0.9, 1.3}, {0.2, 0.9, 1.4}}, 3));
  polygons.push_back(polygon({{0, 0, 2}, {0, 0, 0}, {0, 1.8, 0.2}, {0, 1.8, 2}}));
  Scene scene = test::scene(polygons, 3);
  scene.materials = {test::material(3, 0.5), mirror(3, 0.8), glass(3, 0.9, 1.5), glass(3, 0.7, 1.4)};
  return test::solution(scene, 0.25, [](std::uint32_t p, std::uint32_t band, const glm::dvec3& x) {
    return 2.0 + p + std::sin(5 * x.x + band) + std::cos(4 * x.y + 3 * x.z);
  });
}
Camera hall_camera() {
  Camera camera;
  camera.eye = {1.6, 1.2, 3.4}, camera.target = {0.9, 0.5, 0.5};
  return camera;
}
constexpr ImageOptions small{.width = 61, .height = 47, .samples_per_pixel = 3};

std::uint64_t launches(Device& device, const std::string& stage) {
  for (const auto& s : device.profile())
    if (s.name == stage) return s.launches;
  return 0;
}

TEST(Reflect, SameBitsWhateverWorkGroupMemoryOrEngine) {
  const Solution solution = hall_of_mirrors();
  Device& device = test::device();
  const Image first = render(device, solution, hall_camera(), small);
  ImageOptions none = small;
  none.depth = 0;
  EXPECT_NE(render(device, solution, hall_camera(), none).radiance, first.radiance);
  for (const unsigned group : {16u, 128u}) {
    Device other({.work_group_size = group});
    EXPECT_EQ(render(other, solution, hall_camera(), small).radiance, first.radiance)
        << "work-groups of " << group;
  }
  const auto triangles = occluder_triangles(solution.scene, solution.frame, plane_ids(solution.scene));
  for (const auto& name : engine_names()) {
    const auto engine = make_engine(name, device, triangles);
    EXPECT_EQ(render_through(device, *engine, triangles, solution, hall_camera(), small).radiance,
              first.radiance)
        << name;
  }
  Device tight({.memory_bytes = 2 << 20});
  const auto engine = make_engine("serial", tight, triangles);
  EXPECT_EQ(render_through(tight, *engine, triangles, solution, hall_camera(), small).radiance,
            first.radiance)
      << "batches";
  EXPECT_LE(tight.ledger()->peak, 2u << 20);
  EXPECT_GT(launches(tight, "make camera rays"), 4u);
}

// Twenty sheets of high index make far more rays than the queues hold: pixels are then drawn fewer at a time.
TEST(Reflect, MoreRaysThanRoomAreDrawnInSmallerBatches) {
  std::vector<Polygon> sheets;
  for (int k = 0; k < 20; ++k) {
    const double z = 0.2 + 0.06 * k;
    sheets.push_back(polygon({{-1.5, -1.5, z}, {1.5, -1.5, z}, {1.5, 1.5, z}, {-1.5, 1.5, z}}));
  }
  const Behind behind(sheets, glass(1, 1, 2.4));
  const ImageOptions options{.width = 16, .height = 12, .samples_per_pixel = 4, .depth = 20};
  Device wide, tight({.memory_bytes = 4 << 20});
  const auto triangles = occluder_triangles(behind.scene, behind.solution.frame, plane_ids(behind.scene));
  const auto a = make_engine("serial", wide, triangles), b = make_engine("serial", tight, triangles);
  const Image first = render_through(wide, *a, triangles, behind.solution, oblique(), options);
  const Image second = render_through(tight, *b, triangles, behind.solution, oblique(), options);
  EXPECT_EQ(first.radiance, second.radiance);
  EXPECT_GT(launches(tight, "make camera rays"), launches(wide, "make camera rays"));
  EXPECT_GT(*std::min_element(first.radiance.begin(), first.radiance.end()), 0);
  Device tiny({.memory_bytes = 100 << 10});
  const auto c = make_engine("serial", tiny, triangles);
  try {
    render_through(tiny, *c, triangles, behind.solution, oblique(), options);
    FAIL() << "a pixel's rays fit into 100 KiB";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("--depth"), std::string::npos) << error.what();
  }
}

TEST(Reflect, WithoutSpecularPolygonsNothingIsLaunchedOrHeld) {
  Solution solution = hall_of_mirrors();
  for (Polygon& p : solution.scene.polygons) p.material = 0;
  std::uint64_t all[2], peak[2];
  std::vector<float> pictures[2];
  for (const unsigned depth : {0u, 8u}) {
    Device device;
    ImageOptions options = small;
    options.depth = depth;
    pictures[depth / 8] = render(device, solution, hall_camera(), options).radiance;
    all[depth / 8] = 0;
    for (const auto& stage : device.profile()) {
      all[depth / 8] += stage.launches;
      EXPECT_EQ(stage.name.find("mirrors and glass"), std::string::npos) << stage.name;
    }
    peak[depth / 8] = device.ledger()->peak;
  }
  EXPECT_EQ(all[0], all[1]);
  EXPECT_EQ(peak[0], peak[1]);
  EXPECT_EQ(pictures[0], pictures[1]);
}

TEST(Reflect, DepthHasALimit) {
  EXPECT_THROW(render(test::device(), between_mirrors(0.5), between(), {.depth = 65}), UsageError);
}

}  // namespace
}  // namespace clrad
