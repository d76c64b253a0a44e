#include <gtest/gtest.h>

#include <glm/vec2.hpp>
#include <numbers>

#include "mesh/locate.hpp"
#include "output/adaptive.hpp"
#include "output/displayed.hpp"
#include "render/render.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::meet;
using test::polygon;
using test::ray;

// General convex quad in a tilted plane, spanned by e1 and e2.
std::vector<glm::dvec3> tilted(const std::vector<glm::dvec2>& flat) {
  const glm::dvec3 e1 = glm::normalize(glm::dvec3(1, 0.2, 0.1)),
                   e2 = glm::normalize(glm::cross(glm::dvec3(-0.1, -0.2, 1), e1));
  std::vector<glm::dvec3> corners;
  for (const auto& f : flat) corners.push_back(f.x * e1 + f.y * e2);
  return corners;
}

Camera front_camera() {
  Camera camera;
  camera.eye = {0.4, 0.9, 2.5};
  camera.target = {0.5, 0.4, 0};
  camera.vertical_field_of_view_rad = 0.9;
  return camera;
}

// The picture of a field that is linear in space is that field, because the lattice interpolates linear
// functions exactly, on quads of any shape: a cell of a bilinear lattice is itself bilinear in its own
// parameters.
//
// Bound. Everything happens within 4 units of the frame's origin, so each of the fewer than 16 operations
// that make the ray's two ends and their difference is off by at most 4 x 2^-24; the plane is met at an angle
// of cosine > 0.5, which at most doubles that on the plane: 2 x 16 x 4 x 2^-24 = 2^-17 units. Parameters and
// weights add less than 2^-20 of the polygon. Values themselves are rounded some 8 times.
void expect_linear_field(const std::vector<glm::dvec3>& corners, const glm::dvec3& shift,
                         Precision precision) {
  std::vector<glm::dvec3> moved;
  for (const auto& c : corners) moved.push_back(c + shift);
  Scene scene = test::scene({polygon(moved)}, 3);
  const auto field = [&](std::uint32_t, std::uint32_t band, const glm::dvec3& at) {
    const glm::dvec3 x = at - shift;
    return 20 + band + (3 + band) * x.x - 4 * x.y + 2 * x.z;
  };
  const Solution solution = test::solution(scene, 0.13, field);
  Camera camera = front_camera();
  camera.eye += shift, camera.target += shift;
  const ImageOptions options{.width = 90, .height = 70, .samples_per_pixel = 1};
  Device& device = test::device(precision);
  const Image image = render(device, solution, camera, options);

  const double gradient = 7 * solution.frame.metres();  // at most sqrt(25 + 16 + 4) a metre
  const double bound = 0.5 / std::numbers::pi * (gradient * std::ldexp(1, -17) + 40 * 8 * std::ldexp(1, -24));
  unsigned lit = 0;
  for (unsigned y = 0; y < options.height; ++y)
    for (unsigned x = 0; x < options.width; ++x) {
      const auto m =
          meet(scene.polygons[0], camera.eye, ray(camera, options.width, options.height, x + 0.5, y + 0.5));
      const float* seen = &image.radiance[3 * (y * options.width + x)];
      if (std::abs(m.inside) < 1e-5) continue;  // on the outline, to rounding
      for (std::uint32_t band = 0; band < 3; ++band) {
        const double expected = m.inside > 0 ? 0.5 * field(0, band, m.point) / std::numbers::pi : 0;
        ASSERT_NEAR(seen[band], expected, bound) << "pixel " << x << ", " << y << " band " << band;
      }
      lit += m.inside > 0;
    }
  EXPECT_GT(lit, 300u);
}

class LinearField : public testing::TestWithParam<Precision> {};

TEST_P(LinearField, OnARectangle) {
  expect_linear_field(tilted({{0, 0}, {1, 0}, {1, 0.8}, {0, 0.8}}), {0, 0, 0}, GetParam());
}
TEST_P(LinearField, OnAGeneralQuad) {
  expect_linear_field(tilted({{0, 0}, {1.1, 0.1}, {0.7, 0.5}, {0.1, 0.9}}), {0, 0, 0}, GetParam());
}
TEST_P(LinearField, OnAQuadThatIsNearlyATriangle) {
  expect_linear_field(tilted({{0, 0}, {1, 0}, {0.501, 0.5}, {0, 1}}), {0, 0, 0}, GetParam());
}
TEST_P(LinearField, OnATriangle) {
  expect_linear_field(tilted({{0, 0}, {1, 0.1}, {0.2, 0.9}}), {0, 0, 0}, GetParam());
}
// 1e6 m is exact in binary and rounding of the moved corners is 2^-34 m: below the bound.
TEST_P(LinearField, FarFromTheOrigin) {
  expect_linear_field(tilted({{0, 0}, {1.1, 0.1}, {0.7, 0.5}, {0.1, 0.9}}), {1e6, -1e6, 1e6}, GetParam());
}
INSTANTIATE_TEST_SUITE_P(Shade, LinearField, testing::Values(Precision::float32, Precision::float64),
                         [](const auto& p) { return p.param == Precision::float32 ? "Float" : "Double"; });

// A coarse lattice with a value of its own at each vertex: only the right cell, half and weights reproduce it. Values
// alternate along the sides of cells and go evenly along their diagonals, so that no edge has a bend.
TEST(Shade, EveryCellInterpolatesItsOwnCorners) {
  for (const bool quad : {true, false}) {
    const Scene scene = quad ? test::scene({polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})})
                             : test::scene({polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})});
    const auto value = [](double x, double y) {
      const double i = std::round(4 * x), j = std::round(4 * y);
      return 6 + (std::fmod(i + j, 2) == 0 ? 1 : -1) * (3 + 0.5 * i + 0.3 * j);
    };
    const Solution solution = test::solution(
        scene, quad ? 0.25 : 0.36, [&](auto, auto, const glm::dvec3& p) { return value(p.x, p.y); });
    ASSERT_EQ(solution.mesh.polygons[0].cells_u, 4u);
    Camera camera;
    camera.eye = {0.5, 0.5, 2}, camera.target = {0.5, 0.5, 0},
    camera.vertical_field_of_view_rad = 2 * std::atan(0.27);
    const ImageOptions options{.width = 64, .height = 64, .samples_per_pixel = 1};
    Device& device = test::device();
    const Image image = render(device, solution, camera, options);
    unsigned compared = 0;
    for (unsigned y = 0; y < 64; ++y)
      for (unsigned x = 0; x < 64; ++x) {
        const auto m = meet(scene.polygons[0], camera.eye, ray(camera, 64, 64, x + 0.5, y + 0.5));
        if (m.inside < 1e-5) continue;
        const double u = 4 * m.point.x, v = 4 * m.point.y, i = std::floor(u), j = std::floor(v), a = u - i,
                     b = v - j;
        const auto at = [&](double di, double dj) { return value((i + di) / 4, (j + dj) / 4); };
        double expected;
        if (quad)
          expected = (1 - a) * (1 - b) * at(0, 0) + a * (1 - b) * at(1, 0) + a * b * at(1, 1) +
                     (1 - a) * b * at(0, 1);
        else if (a + b <= 1)
          expected = (1 - a - b) * at(0, 0) + a * at(1, 0) + b * at(0, 1);
        else
          expected = (a + b - 1) * at(1, 1) + (1 - b) * at(1, 0) + (1 - a) * at(0, 1);
        // Neighbouring values differ by up to 12 over a quarter: slope 48 a unit, times the 2^-17 units of
        // the bound above.
        ASSERT_NEAR(image.radiance[y * 64 + x], 0.5 * expected / std::numbers::pi, 48 * std::ldexp(1, -17))
            << x << ", " << y;
        ++compared;
      }
    EXPECT_GT(compared, quad ? 3500u : 1500u);
  }
}

// The same from the host's interpolation as from the device's, on quads and triangles of three levels: once a smooth field,
// whose edges bend, and once a field that is anything but smooth.
class AdaptiveShading : public testing::TestWithParam<Precision> {};

TEST_P(AdaptiveShading, IsWhatTheHostInterpolates) {
  for (const bool smooth : {true, false}) {
    Solution solution = test::adaptive_solution(3);
    if (!smooth)
      test::set_field(solution, [](std::uint32_t, std::uint32_t band, const glm::dvec3& x) {
        return 5 + 4 * std::sin(1000 * (x.x + 3 * x.y + 7 * x.z) + band);
      });
    const Displayed displayed(solution);
    std::size_t bends = 0, seen = 0;
    for (const double b : displayed.bend) bends += b != 0;
    EXPECT_GT(bends, displayed.bend.size() / (smooth ? 2 : 10));
    for (std::uint32_t p = 0; p < 3; ++p) {
      const Polygon& polygon = solution.scene.polygons[p];
      Camera camera;
      camera.target = 0.5 * (polygon.corner[1] + polygon.corner[polygon.corners - 1]);
      camera.eye = camera.target + 1.5 * polygon.normal() + glm::dvec3(0.02, 0.03, 0.05);
      camera.up = glm::normalize(polygon.corner[1] - polygon.corner[0]);
      camera.vertical_field_of_view_rad = 1.2;
      const Image image = render(test::device(GetParam()), solution, camera,
                                 {.width = 48, .height = 48, .samples_per_pixel = 1});
      for (unsigned y = 0; y < 48; ++y)
        for (unsigned x = 0; x < 48; ++x) {
          const auto m = meet(polygon, camera.eye, ray(camera, 48, 48, x + 0.5, y + 0.5));
          // Another polygon stands on this one's border.
          if (m.inside < 1e-3) continue;
          const auto [u, v] = test::parameters(polygon, m.point);
          const Interpolant at = locate(solution.mesh, p, polygon.corners, u, v);
          ++seen;
          // Values up to 12 differ over an edge of 2 / 32 at the least, on each of the two sides of it: slope 400, bends
          // three times that (below), x what a place is off: 2^-17 of a unit as above, and frame units are up to 2 m long.
          const double bound =
              (3 * 400 * 2 * std::ldexp(1, -17) + 40 * std::ldexp(1, -20)) / std::numbers::pi;
          for (std::uint32_t band = 0; band < 3; ++band)
            ASSERT_NEAR(image.radiance[3 * (y * 48 + x) + band], displayed.at(band, at) / std::numbers::pi,
                        bound)
                << p << " at " << x << ", " << y << " band " << band;
        }
    }
    EXPECT_GT(seen, 2000u);
  }
}
INSTANTIATE_TEST_SUITE_P(Shade, AdaptiveShading, testing::Values(Precision::float32, Precision::float64),
                         [](const auto& p) { return p.param == Precision::float32 ? "Float" : "Double"; });

TEST(Shade, EmissionIsSeenAndBacksAreBlackAndOpaque) {
  // From the front: a lamp of exitance pi, behind it nothing; a black back hides one half of it.
  Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}),
                             polygon({{0, -1, 0.5}, {0, 1, 0.5}, {1, 1, 0.5}, {1, -1, 0.5}})});
  scene.materials[0] = test::material(1, 0, std::numbers::pi);
  Camera camera;
  camera.eye = {0, 0, 3}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = 0.3;
  Device& device = test::device();
  const Image image = render(device, test::solution(scene, 0.5, [](auto, auto, auto&) { return 7.0; }),
                             camera, {.width = 2, .height = 1, .samples_per_pixel = 4});
  EXPECT_NEAR(image.radiance[0], 1, 4 * std::ldexp(1, -24));
  EXPECT_EQ(image.radiance[1], 0);
}

// What an engine says of polygons in one plane depends on rounding; the picture must not.
class Overlap : public testing::TestWithParam<bool> {
 protected:
  Image draw(const Scene& scene, const Camera& camera) {
    const Solution solution =
        test::solution(scene, 0.5, [](std::uint32_t p, auto, auto&) { return 1.0 + p; });
    const auto triangles = occluder_triangles(scene, solution.frame, plane_ids(scene));
    test::PlainEngine engine(triangles, GetParam());
    return render_through(device_, engine, triangles, solution, camera,
                          {.width = 9, .height = 9, .samples_per_pixel = 1});
  }
  static float shown(std::uint32_t p) { return float(0.5 * (1.0 + p) / std::numbers::pi); }
  Device& device_ = test::device();
};

TEST_P(Overlap, TheLaterPolygonOfAPlaneLiesOnTop) {
  const Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}),
                                   polygon({{-0.4, -0.4, 0}, {0.4, -0.4, 0}, {0.4, 0.4, 0}, {-0.4, 0.4, 0}}),
                                   polygon({{0, 0, 0}, {0.4, 0, 0}, {0, 0.4, 0}})});
  Camera camera;
  camera.eye = {0.01, 0.01, 2}, camera.target = {0.01, 0.01, 0}, camera.vertical_field_of_view_rad = 0.8;
  const Image image = draw(scene, camera);
  for (unsigned y = 0; y < 9; ++y)
    for (unsigned x = 0; x < 9; ++x) {
      const glm::dvec3 d = ray(camera, 9, 9, x + 0.5, y + 0.5);
      std::uint32_t expected = 0;
      for (std::uint32_t p = 1; p < 3; ++p)
        if (meet(scene.polygons[p], camera.eye, d).inside > 0) expected = p;
      EXPECT_NEAR(image.radiance[9 * y + x], shown(expected), 1e-6) << x << ", " << y;
    }
}

TEST_P(Overlap, OfTwoSheetsBackToBackTheFrontIsSeenFromBothSides) {
  const Scene scene = test::scene({polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}),
                                   polygon({{-1, -1, 0}, {-1, 1, 0}, {1, 1, 0}, {1, -1, 0}})});
  for (const double z : {2.0, -2.0}) {
    Camera camera;
    camera.eye = {0.1, 0.2, z}, camera.target = {0, 0, 0}, camera.vertical_field_of_view_rad = 0.5;
    for (const float radiance : draw(scene, camera).radiance)
      EXPECT_NEAR(radiance, shown(z > 0 ? 0 : 1), 1e-6);
  }
}
INSTANTIATE_TEST_SUITE_P(Shade, Overlap, testing::Bool());

TEST(Layers, TilesThatOnlyTouchDoNotOverlap) {
  const Scene scene = test::scene({polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}),
                                   polygon({{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}),
                                   polygon({{0.5, 0.5, 0}, {1.5, 0.5, 0}, {1.5, 0.9, 0}}),
                                   polygon({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}})});
  const Frame frame = test::frame(scene);
  const Layers layers = overlapping_layers(occluder_triangles(scene, frame, plane_ids(scene)), 4);
  EXPECT_EQ(layers.start, (std::vector<std::uint32_t>{0, 1, 1, 2, 2, 4, 4, 4, 4}));
  EXPECT_EQ(layers.polygon, (std::vector<std::uint32_t>{2, 2, 0, 1}));
}

TEST(Layers, ThoseThatFaceTheOtherWayAreListedApart) {
  const Scene scene = test::scene({polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                                   polygon({{0.2, 0.2, 0}, {0.2, 0.8, 0}, {0.8, 0.8, 0}, {0.8, 0.2, 0}}),
                                   polygon({{0.5, 0.5, 0}, {1.5, 0.5, 0}, {1.5, 0.9, 0}})});
  const Frame frame = test::frame(scene);
  const Layers layers = overlapping_layers(occluder_triangles(scene, frame, plane_ids(scene)), 3);
  EXPECT_EQ(layers.start, (std::vector<std::uint32_t>{0, 1, 2, 2, 4, 5, 6}));
  EXPECT_EQ(layers.polygon, (std::vector<std::uint32_t>{2, 1, 0, 2, 0, 1}));
}

}  // namespace
}  // namespace clrad
