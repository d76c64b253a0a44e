#include "render/reflect.hpp"

#include <gtest/gtest.h>

#include "render/specular.hpp"

namespace clrad {
namespace {

using namespace test;

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
  Device tiny({.memory_bytes = 144 << 10});
  const auto c = make_engine("serial", tiny, triangles);
  try {
    render_through(tiny, *c, triangles, behind.solution, oblique(), options);
    FAIL() << "a pixel's rays fit into 144 KiB";
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
