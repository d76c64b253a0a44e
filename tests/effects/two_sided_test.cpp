// Light on both sides of two-sided polygons: each side as if the other were not there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::polygon;

const Effect& two_sided_of(const Report& report) {
  for (const Effect& e : report.effects)
    if (e.name == "two_sided") return e;
  throw std::logic_error("no such effect");
}

std::vector<glm::dvec3> square(double z, bool up) {
  std::vector<glm::dvec3> c = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
  if (!up) std::reverse(c.begin() + 1, c.end());
  return c;
}

// A plate of reflectance 0.5 (material 0) at z = 0 between black lamps: one of E = 1 at z = 1 and one of E = 3 at z = -1/2.
Scene plate_between_lamps(bool facing_up, bool two_sided) {
  Scene scene = test::scene(
      {polygon(square(0, facing_up), 0), polygon(square(1, false), 1), polygon(square(-0.5, true), 2)});
  scene.materials = {test::material(1, 0.5), test::material(1, 0, 1), test::material(1, 0, 3)};
  scene.materials[0].two_sided = two_sided;
  return scene;
}

SolveOptions plate_options() {
  SolveOptions options;
  options.mesh = {1, 1.0 / 32};
  options.samples = 1, options.light_samples = 0;
  return options;
}

// Opposite unit squares at distance h: Howell's catalogue, C-11.
double opposite_squares(double h) {
  const double x = 1 / h, s = 1 + x * x;
  return 2 / (M_PI * x * x) *
         (0.5 * std::log(s * s / (1 + 2 * x * x)) + 2 * x * std::sqrt(s) * std::atan(x / std::sqrt(s)) -
          2 * x * std::atan(x));
}

TEST(TwoSided, EachSideOfAPlateIsThatOfAOneSidedOne) {
  Device& device = test::device();
  const Solution both = solve(device, plate_between_lamps(true, true), plate_options());
  ASSERT_EQ(both.scene.polygons.size(), 4u);
  const auto means = polygon_means(both);
  const std::size_t n = both.mesh.polygons[0].vertices;
  for (const bool up : {true, false}) {
    const Solution one = solve(device, plate_between_lamps(up, false), plate_options());
    ASSERT_EQ(one.scene.polygons.size(), 3u);
    const std::uint32_t first = both.mesh.polygons[up ? 0 : 1].first_vertex;
    ASSERT_EQ(one.mesh.polygons[0].vertices, n);
    for (std::size_t v = 0; v < n; ++v)
      // The same factors of the same lamps, with all rays free: only the order of the shots may differ.
      ASSERT_NEAR(both.vertex_irradiance[first + v], one.vertex_irradiance[v], 1e-6) << up << v;
    // Trapezoidal means of 32 elements a side: h^2 / 12 of second derivatives that at half an edge are about 4: 4e-4.
    EXPECT_NEAR(means[up ? 0 : 1].irradiance[0], up ? opposite_squares(1) : 3 * opposite_squares(0.5), 2e-3);
  }
}

TEST(TwoSided, AnEmitterEmitsOnBothSides) {
  Scene scene = plate_between_lamps(true, true);
  scene.materials[0].emitted_exitance = {2};
  scene.materials[1].emitted_exitance = scene.materials[2].emitted_exitance = {0};
  const Solution s = solve(test::device(), scene, plate_options());
  EXPECT_NEAR(s.report.energy.emitted[0], 2 * 2, 1e-6);
  const auto means = polygon_means(s);
  EXPECT_NEAR(means[2].irradiance[0], 2 * opposite_squares(1), 2e-3);
  EXPECT_NEAR(means[3].irradiance[0], 2 * opposite_squares(0.5), 4e-3);
}

// A pair of scenes: in one without two-sided polygons there is no polygon more, all stages launch and allocate what they did, and
// forcing it changes no bit.
TEST(TwoSided, NothingHappensWhereNothingIsTwoSided) {
  Device without, forced;
  const Solution two = solve(test::device(), plate_between_lamps(true, true), plate_options());
  EXPECT_TRUE(two_sided_of(two.report).needed);
  EXPECT_NE(two_sided_of(two.report).reason.find("1 of 3 polygons"), std::string::npos)
      << two_sided_of(two.report).reason;
  EXPECT_LT(two_sided_of(two.report).skip_error_relative, 0);

  const Solution one = solve(without, plate_between_lamps(true, false), plate_options());
  EXPECT_FALSE(two_sided_of(one.report).needed);
  EXPECT_FALSE(two_sided_of(one.report).runs);
  EXPECT_EQ(two_sided_of(one.report).skip_error_relative, 0);

  SolveOptions options = plate_options();
  options.force_effects = {"two_sided"};
  const Solution all = solve(forced, plate_between_lamps(true, false), options);
  EXPECT_TRUE(two_sided_of(all.report).runs);
  EXPECT_EQ(all.scene.polygons.size(), 3u);
  EXPECT_EQ(all.vertex_irradiance, one.vertex_irradiance);
  EXPECT_EQ(all.patch_irradiance, one.patch_irradiance);
  ASSERT_EQ(all.report.stages.size(), one.report.stages.size());
  for (std::size_t s = 0; s < one.report.stages.size(); ++s) {
    EXPECT_EQ(all.report.stages[s].name, one.report.stages[s].name);
    EXPECT_EQ(all.report.stages[s].launches, one.report.stages[s].launches) << one.report.stages[s].name;
    EXPECT_EQ(all.report.stages[s].bytes, one.report.stages[s].bytes) << one.report.stages[s].name;
  }

  options = plate_options();
  options.without = {"two_sided"};
  const Solution left_out = solve(test::device(), plate_between_lamps(true, true), options);
  EXPECT_EQ(left_out.vertex_irradiance, one.vertex_irradiance);
}

// Everything emits 1 and reflects 1/2: B = 2 all over, on both sides of a sheet in the middle, too. The room is proven
// closed, so rows of patches are closed and their radiosity errs by rounding and 1e-4 of light that is not shot.
TEST(TwoSided, FurnaceWithASheetInIt) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  Material paper = scene.materials[scene.polygons[0].material];
  paper.two_sided = true;
  scene.materials.push_back(paper);
  scene.polygons.push_back(polygon({{0.2, 0.3, 0.4}, {0.8, 0.3, 0.4}, {0.8, 0.7, 0.6}, {0.2, 0.7, 0.6}},
                                   std::uint32_t(scene.materials.size() - 1)));
  SolveOptions options;
  options.mesh = {0.25, 0.0625};
  options.converge = 1e-4;
  const Solution s = solve(test::device(), scene, options);
  EXPECT_TRUE(s.report.closure.proven) << s.report.closure.reason;
  EXPECT_TRUE(s.report.closure.applied);
  ASSERT_EQ(s.scene.polygons.size(), 8u);
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p)
    EXPECT_NEAR(1 + 0.5 * s.patch_irradiance[p], 2, 1e-3)
        << "patch " << p << " of polygon " << s.mesh.patches[p].polygon;
  EXPECT_LT(std::abs(s.report.energy.unaccounted_relative), 1e-3);
  for (const Invariant& i : s.report.invariants) EXPECT_TRUE(i.holds) << i.name << ' ' << i.worst;
}

// A two-sided box on the floor covers it as a one-sided one does, and takes no patch more.
TEST(TwoSided, ASolidOnAFloorIsAsBefore) {
  const auto scene_of = [](bool two_sided) {
    Scene scene = oracle::box_scene({2, 2, 2}, {0.5}, {1});
    Material box = scene.materials[scene.polygons[0].material];
    box.emitted_exitance = {0};
    box.two_sided = two_sided;
    scene.materials.push_back(box);
    const Scene inward = oracle::box_scene({0.8, 0.7, 0.5}, {0.5}, {1});
    for (const Polygon& p : inward.polygons) {
      std::vector<glm::dvec3> c;
      for (int k = 3; k >= 0; --k) c.push_back(p.corner[std::size_t(k)] + glm::dvec3(0.6, 0.5, 0));
      scene.polygons.push_back(polygon(c, std::uint32_t(scene.materials.size() - 1)));
    }
    return scene;
  };
  SolveOptions options;
  options.mesh = {1, 0.125};
  const Solution one = solve(test::device(), scene_of(false), options),
                 two = solve(test::device(), scene_of(true), options);
  EXPECT_EQ(one.vertex_covered, two.vertex_covered);
  EXPECT_EQ(one.vertex_irradiance, two.vertex_irradiance);
  EXPECT_GT(std::count(one.vertex_covered.begin(), one.vertex_covered.end(), 1), 0);
}

// Four two-sided squares side by side, seen from either side: the middle of each shows the light of the side that is seen,
// and no ray falls through the seams onto a black back.
TEST(TwoSided, PicturesShowTheSideThatIsSeen) {
  std::vector<Polygon> tiles;
  for (const double x : {0.0, 1.0})
    for (const double y : {0.0, 1.0})
      tiles.push_back(polygon({{x, y, 0}, {x + 1, y, 0}, {x + 1, y + 1, 0}, {x, y + 1, 0}}));
  Scene scene = test::scene(tiles);
  scene.materials[0].two_sided = true;
  scene = with_backs(scene);
  ASSERT_EQ(scene.polygons.size(), 8u);
  const Solution s = test::solution(scene, 0.5, [&](std::uint32_t p, std::uint32_t, const glm::dvec3&) {
    return scene.polygons[p].back ? 6.0 : 2.0;
  });
  for (const bool front : {true, false}) {
    Camera camera;
    camera.eye = {1.03, 1.02, front ? 4 : -4}, camera.target = {1, 1, 0};
    camera.vertical_field_of_view_rad = 0.4;  // the squares fill the picture: 2 m at 4 m are 0.49
    const Image image =
        render(test::device(), s, camera, {.width = 64, .height = 64, .samples_per_pixel = 1});
    // rho H / pi with rho = 1/2; single precision.
    for (const float l : image.radiance) ASSERT_NEAR(l, (front ? 1 : 3) / M_PI, 1e-6) << front;
  }
}

TEST(TwoSided, ViewFactorsHaveRowsOfTheirOwn) {
  Device& device = test::device(Precision::float64);
  ViewFactorOptions options;
  options.reciprocity_sample = 0;
  const ViewFactors f = view_factors(device, plate_between_lamps(true, true), options);
  ASSERT_EQ(f.rows(), 4u);
  EXPECT_EQ(f.name[1], "polygon (back)");
  EXPECT_NEAR(f.at(0, 2), opposite_squares(1), 1e-5);
  EXPECT_NEAR(f.at(1, 3), opposite_squares(0.5), 1e-5);
  EXPECT_EQ(f.at(0, 1), 0);
  EXPECT_EQ(f.at(0, 3), 0);
  EXPECT_EQ(f.at(2, 3), 0) << "the plate is between";
}

TEST(TwoSided, ASolutionFileKeepsThem) {
  const Solution s = solve(test::device(), plate_between_lamps(true, true), plate_options());
  const auto path = (std::filesystem::temp_directory_path() / "clrad-two-sided.clrad").string();
  write_solution(path, s);
  const Solution back = load_solution(path);
  std::filesystem::remove(path);
  ASSERT_EQ(back.scene.polygons.size(), 4u);
  EXPECT_TRUE(back.scene.polygons[1].back);
  EXPECT_FALSE(back.scene.polygons[0].back);
  EXPECT_TRUE(back.scene.materials[0].two_sided);
  EXPECT_EQ(back.vertex_irradiance, s.vertex_irradiance);
}

}  // namespace
}  // namespace clrad
