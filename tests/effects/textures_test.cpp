// Textures in a solve: what elements reflect, that nothing happens without a texture, and what a patch's mean leaves out.
#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "render/support.hpp"
#include "scene/images.hpp"

namespace clrad {
namespace {

const StageProfile* texture_stage(const Report& report) {
  for (const StageProfile& s : report.stages)
    if (s.name == "average textures over elements") return &s;
  return nullptr;
}
const Effect& textures_effect(const Report& report) {
  for (const Effect& e : report.effects)
    if (e.name == "textures") return e;
  throw std::logic_error("no such effect");
}

// A cube that emits 1 and reflects 1/2 all over: as a material, or as that times a texture on every face.
Scene cube(const Texture* texture, double factor) {
  Scene scene = oracle::box_scene({1, 1, 1}, {factor}, {1});
  if (!texture) return scene;
  scene.textures = {*texture};
  scene.materials[0].texture = 0;
  for (Polygon& p : scene.polygons)
    p.uv = {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(1, 1), glm::dvec2(0, 1)};
  return scene;
}

SolveOptions cube_options() {
  SolveOptions options;
  options.mesh = {0.5, 0.125};
  options.samples = 1, options.light_samples = 0;
  return options;
}

// Means of a constant in single precision are off by an ulp or two, and so are the answers: 1e-6.
TEST(Textures, AConstantOneIsAPlainMaterial) {
  const Texture grey = clrad_test::grey_texture(4, 4, std::vector<float>(16, 0.5f));
  const Solution plain = solve(test::device(), cube(nullptr, 0.5), cube_options()),
                 textured = solve(test::device(), cube(&grey, 1), cube_options());
  ASSERT_EQ(textured.vertex_irradiance.size(), plain.vertex_irradiance.size());
  for (std::size_t v = 0; v < plain.vertex_irradiance.size(); ++v)
    ASSERT_NEAR(textured.vertex_irradiance[v], plain.vertex_irradiance[v], 2e-6 * plain.vertex_irradiance[v])
        << v;
  for (const ErrorPart& part : textured.report.error.parts)
    if (part.name == "texture within patches") {
      EXPECT_LT(part.relative, 1e-6);
    }
}

// Patches of 1/2 x 1/2 under a board of 4 x 4 fields each see as much white as black: the furnace of the mean, 1/2.
TEST(Textures, AFineBoardIsItsMean) {
  std::vector<float> fields(64);
  for (std::size_t i = 0; i < 64; ++i) fields[i] = (i / 8 + i) % 2 ? 0.9f : 0.1f;
  const Texture board = clrad_test::grey_texture(8, 8, fields);
  SolveOptions options = cube_options();
  options.converge = 1e-6;
  const Solution s = solve(test::device(), cube(&board, 1), options);
  ASSERT_EQ(s.textured.patch.size(), s.mesh.patches.size());
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
    EXPECT_NEAR(s.textured.patch[p], 0.5, 1e-6);
    // The room is closed: rows sum to 1 but for rounding. H = B = 2.
    EXPECT_NEAR(s.patch_irradiance[p], 2, 1e-4);
  }
  EXPECT_NEAR(polygon_means(s)[0].radiosity[0], 2, 1e-4);
  EXPECT_LT(std::abs(s.report.energy.unaccounted_relative), 1e-4);
}

TEST(Textures, NothingHappensWhereThereIsNone) {
  const Texture grey = clrad_test::grey_texture(2, 2, std::vector<float>(4, 0.5f));
  Device& with = test::device();
  Device without, forced;
  const Solution textured = solve(with, cube(&grey, 1), cube_options());
  EXPECT_TRUE(textures_effect(textured.report).needed);
  EXPECT_NE(textures_effect(textured.report).reason.find("6 of 6 polygons"), std::string::npos);
  ASSERT_NE(texture_stage(textured.report), nullptr);
  EXPECT_GT(texture_stage(textured.report)->launches, 0u);
  EXPECT_GT(texture_stage(textured.report)->bytes, 0u);

  const Solution plain = solve(without, cube(nullptr, 0.5), cube_options());
  EXPECT_FALSE(textures_effect(plain.report).needed);
  EXPECT_EQ(textures_effect(plain.report).skip_error_relative, 0);
  EXPECT_EQ(texture_stage(plain.report), nullptr);
  EXPECT_TRUE(plain.textured.element.empty() && plain.textured.patch.empty() &&
              plain.textured.vertex.empty());

  SolveOptions options = cube_options();
  options.force_effects = {"textures"};
  const Solution all = solve(forced, cube(nullptr, 0.5), options);
  EXPECT_TRUE(textures_effect(all.report).runs);
  EXPECT_FALSE(all.textured.patch.empty());
  EXPECT_EQ(all.vertex_irradiance, plain.vertex_irradiance);
  EXPECT_EQ(all.patch_irradiance, plain.patch_irradiance);
  EXPECT_EQ(display_radiosity(all), display_radiosity(plain));
  Camera camera;
  camera.eye = {0.5, 0.1, 0.5}, camera.target = {0.5, 1, 0.4};
  const ImageOptions small{.width = 24, .height = 24, .samples_per_pixel = 2};
  EXPECT_EQ(render(forced, all, camera, small).radiance, render(without, plain, camera, small).radiance);
  for (const StageProfile& s : without.profile())
    EXPECT_EQ(s.name.find("texture"), std::string::npos) << s.name;

  // Left out, the mean colour stands in.
  options = cube_options();
  options.without = {"textures",
                     "near_field"};  // which the plain room, equally bright everywhere, has no need of
  const Solution mean = solve(with, cube(&grey, 1), options);
  EXPECT_EQ(mean.vertex_irradiance, plain.vertex_irradiance);
  EXPECT_FALSE(has_textures(mean.scene));
}

// A floor whose left half is white and right half black, lit by a lamp over the left half. As one patch it reflects its mean of
// all light; as 64 patches the white half reflects what arrives there. The estimate says of one patch, within a factor of
// two, by how much its radiosity is off, and falls with the patches. It bounds the error of the ceiling's light from below.
TEST(Textures, TheEstimateSaysWhatAPatchsMeanLeavesOut) {
  std::vector<float> halves(32);
  for (std::size_t i = 0; i < 32; ++i) halves[i] = i < 16 ? 0.9f : 0.1f;
  Scene scene =
      test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}, 0),
                   test::polygon({{0.2, 0.8, 0.5}, {0.2, 1.2, 0.5}, {0.6, 1.2, 0.5}, {0.6, 0.8, 0.5}}, 1),
                   test::polygon({{0, 0, 2}, {0, 2, 2}, {2, 2, 2}, {2, 0, 2}}, 2)});
  scene.polygons[0].uv = {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(1, 1), glm::dvec2(0, 1)};
  scene.textures = {clrad_test::grey_texture(32, 1, halves, Wrap::clamp)};
  scene.materials = {test::material(1, 1), test::material(1, 0, 1), test::material(1, 0)};
  scene.materials[0].texture = 0;
  SolveOptions options;
  options.converge = 1e-5;
  const auto solved = [&](double patch) {
    options.mesh = {patch, 0.0625};
    return solve(test::device(), scene, options);
  };
  const auto estimate = [](const Solution& s) {
    for (const ErrorPart& part : s.report.error.parts)
      if (part.name == "texture within patches") return part.relative;
    return -1.0;
  };
  const Solution coarse = solved(2), fine = solved(0.25);
  const double floor_fine = polygon_means(fine)[0].radiosity[0],
               floor_coarse = polygon_means(coarse)[0].radiosity[0];
  double irradiance = 0, area = 0;
  for (const PolygonMean& m : polygon_means(fine))
    irradiance += m.irradiance[0] * m.area_m2, area += m.area_m2;
  const double error = std::abs(floor_coarse - floor_fine) * std::sqrt(4 / area) / (irradiance / area);
  EXPECT_GT(error, 0.05) << "the case shows something";
  EXPECT_NEAR(estimate(coarse), error, 0.5 * error);
  EXPECT_LT(estimate(fine), 0.2 * estimate(coarse));
}

// Adaptive subdivision: what is added gets its own means.
TEST(Textures, SplitElementsHaveTheirOwnMeans) {
  const Texture ramp = clrad_test::grey_texture(4, 1, {0.1f, 0.3f, 0.6f, 0.9f}, Wrap::clamp);
  Scene scene = cube(&ramp, 0.8);
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].emitted_exitance = {30};
  scene.polygons[5].material = 1;
  SolveOptions options = cube_options();
  options.adaptive.tolerance = 0.02;
  options.adaptive.max_level = 2;
  const Solution s = solve(test::device(), scene, options);
  ASSERT_GT(s.report.refinement.elements_split, 0u);
  ASSERT_EQ(s.textured.element.size(), s.mesh.elements.size());
  ASSERT_EQ(s.textured.vertex.size(), s.vertex_count());
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
    double mean = 0, area = 0;
    for (std::uint32_t e = 0; e < s.mesh.patches[p].elements; ++e) {
      const std::size_t i = s.mesh.patches[p].first_element + e;
      EXPECT_GT(s.textured.element[i], 0.8 * 0.1 - 1e-6);
      EXPECT_LT(s.textured.element[i], 0.8 * 0.9 + 1e-6);
      mean += s.mesh.elements[i].area_m2 * s.textured.element[i], area += s.mesh.elements[i].area_m2;
    }
    EXPECT_NEAR(s.textured.patch[p], mean / area, 1e-9) << p;
  }
}

}  // namespace
}  // namespace clrad
