// Pictures of textures: the texels' own values, whatever the mesh, wherever the texture repeats.
#include "render/texture.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "render/support.hpp"
#include "scene/images.hpp"

namespace clrad {
namespace {

using test::polygon;

// A square of 2 m with a texture, lit by H(p, x), and its picture from straight above; factor 1/2, E 0.25.
struct Pictured {
  Solution s;
  Image image;
  std::vector<glm::dvec2> uv;  // at each pixel's middle
  Camera camera;
};
constexpr unsigned picture_size = 48;

Pictured picture_of(Texture texture, const std::vector<glm::dvec2>& uv, const test::Field& field) {
  Scene scene = test::scene({polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}})});
  std::copy(uv.begin(), uv.end(), scene.polygons[0].uv.begin());
  scene.textures = {std::move(texture)};
  scene.materials = {test::material(1, 0.5, 0.25)};
  scene.materials[0].texture = 0;
  Pictured p;
  p.s = test::solution(scene, 0.5, field);
  p.s.textured = average_textures(test::device(), scene, p.s.mesh, p.s.vertex_covered);
  p.camera.eye = {1, 1, 5}, p.camera.target = {1, 1, 0}, p.camera.vertical_field_of_view_rad = 0.38;
  p.image = render(test::device(), p.s, p.camera,
                   {.width = picture_size, .height = picture_size, .samples_per_pixel = 1});
  for (unsigned y = 0; y < picture_size; ++y)
    for (unsigned x = 0; x < picture_size; ++x) {
      const auto m = test::meet(scene.polygons[0], p.camera.eye,
                                test::ray(p.camera, picture_size, picture_size, x + 0.5, y + 0.5));
      EXPECT_GT(m.inside, 0);
      const double u = m.point.x / 2, v = m.point.y / 2;
      p.uv.push_back((1 - u) * (1 - v) * uv[0] + u * (1 - v) * uv[1] + u * v * uv[2] + (1 - u) * v * uv[3]);
    }
  return p;
}

// Single precision: coordinates to 1e-6 of the texture's repeats, here 4, times 5 texels of slope up to 1: 1e-5 with room.
TEST(RenderTexture, ShowsTheInterpolatedTexels) {
  for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
    const Texture texture = clrad_test::grey_texture(
        5, 3, {0.1f, 0.9f, 0.3f, 0.7f, 0.5f, 0.2f, 0.8f, 0.4f, 0.6f, 0.0f, 0.9f, 0.1f, 0.5f, 0.3f, 0.7f},
        wrap);
    const auto p = picture_of(texture, {{-1.3, -0.7}, {2.4, -1}, {2, 1.9}, {-1.6, 2.2}},
                              [](std::uint32_t, std::uint32_t, const glm::dvec3&) { return 3.0; });
    for (std::size_t i = 0; i < p.uv.size(); ++i)
      ASSERT_NEAR(p.image.radiance[i],
                  (0.25 + 0.5 * clrad_test::texture_value(texture, p.uv[i].x, p.uv[i].y) * 3) / M_PI, 5e-5)
          << int(wrap) << " pixel " << i;
  }
}

// Light that varies is interpolated apart from the texture: at a vertex between white and black the product is not.
TEST(RenderTexture, LightIsInterpolatedAndTexturesAreSampled) {
  const Texture texture = clrad_test::grey_texture(64, 1, [] {
    std::vector<float> stripes(64);
    for (std::size_t i = 0; i < 64; ++i) stripes[i] = i / 8 % 2 ? 0.9f : 0.1f;
    return stripes;
  }());
  const auto field = [](std::uint32_t, std::uint32_t, const glm::dvec3& x) { return 1 + x.x + 2 * x.y; };
  const auto p = picture_of(texture, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, field);
  for (std::size_t i = 0; i < p.uv.size(); ++i) {
    const double h = 1 + 2 * p.uv[i].x + 4 * p.uv[i].y;
    ASSERT_NEAR(p.image.radiance[i],
                (0.25 + 0.5 * clrad_test::texture_value(texture, p.uv[i].x, p.uv[i].y) * h) / M_PI, 1e-4)
        << i;
  }
}

TEST(RenderTexture, ASolutionFileDrawsTheSamePicture) {
  auto p = picture_of(clrad_test::grey_texture(2, 2, {0.1f, 0.9f, 0.5f, 0.3f}, Wrap::mirror),
                      {{0, 0}, {3, 0}, {3, 3}, {0, 3}},
                      [](std::uint32_t, std::uint32_t, const glm::dvec3& x) { return 1 + x.x; });
  const auto path = (std::filesystem::temp_directory_path() / "clrad-texture.clrad").string();
  write_solution(path, p.s);
  const Solution back = load_solution(path);
  std::filesystem::remove(path);
  EXPECT_EQ(back.scene.textures[0].texels, p.s.scene.textures[0].texels);
  EXPECT_EQ(back.scene.textures[0].wrap, p.s.scene.textures[0].wrap);
  EXPECT_EQ(back.textured.element, p.s.textured.element);
  const Image again = render(test::device(), back, p.camera,
                             {.width = picture_size, .height = picture_size, .samples_per_pixel = 1});
  EXPECT_EQ(again.radiance, p.image.radiance);
}

// Without radiosity, too: a lamp of E = 1 far above a textured floor lights it evenly within the tolerance.
TEST(RenderTexture, WhittedShowsThemToo) {
  const Texture texture = clrad_test::grey_texture(2, 1, {0.2f, 0.8f}, Wrap::clamp);
  Scene scene = test::scene({polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}, 0),
                             polygon({{0.9, 0.9, 20}, {0.9, 1.1, 20}, {1.1, 1.1, 20}, {1.1, 0.9, 20}}, 1)});
  scene.polygons[0].uv = {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(1, 1), glm::dvec2(0, 1)};
  scene.textures = {texture};
  scene.materials = {test::material(1, 0.5), test::material(1, 0, 1000)};
  scene.materials[0].texture = 0;
  Camera camera;
  camera.eye = {1, 1, 5}, camera.target = {1, 1, 0}, camera.vertical_field_of_view_rad = 0.38;
  const Image image =
      render_whitted(test::device(), scene, camera, {.width = 16, .height = 16, .samples_per_pixel = 1});
  const double h = 1000 * 0.04 / (M_PI * 400);  // the lamp seen straight above
  for (unsigned y = 0; y < 16; ++y)
    for (unsigned x = 0; x < 16; ++x) {
      const auto m = test::meet(scene.polygons[0], camera.eye, test::ray(camera, 16, 16, x + 0.5, y + 0.5));
      const double expected =
          0.5 * clrad_test::texture_value(texture, m.point.x / 2, m.point.y / 2) * h / M_PI;
      // cos^4 off the middle: at 1.4 m of 20 m, 1 %.
      EXPECT_NEAR(image.radiance[y * 16 + x], expected, 0.011 * expected) << x << ' ' << y;
    }
}

}  // namespace
}  // namespace clrad
