// Reflectances of elements: means of the bilinear interpolant, however the texture lies on the surface.
#include "mesh/texture.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mesh/build.hpp"
#include "render/support.hpp"
#include "scene/images.hpp"
#include "scene/planes.hpp"
#include "scene/texture.hpp"

namespace clrad {
namespace {

using clrad_test::grey_texture;
using clrad_test::texture_value;
using test::polygon;

// One polygon with a texture, cut into elements; factor 1/2.
struct Textured {
  Scene scene;
  Mesh mesh;
  Reflectances r;
  Textured(const std::vector<glm::dvec3>& corners, const std::vector<glm::dvec2>& uv, Texture texture,
           double patch, double element, Precision precision = Precision::float32) {
    scene = test::scene({polygon(corners)});
    std::copy(uv.begin(), uv.end(), scene.polygons[0].uv.begin());
    scene.textures = {std::move(texture)};
    scene.materials[0].texture = 0;
    mesh = build_mesh(scene, test::frame(scene), plane_ids(scene), {patch, element});
    r = average_textures(test::device(precision), scene, mesh,
                         std::vector<std::uint8_t>(mesh.vertex_count(), 0));
  }
};

const std::vector<glm::dvec3> unit_square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<glm::dvec2> once = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

std::vector<float> noise(std::size_t count) {
  std::mt19937 random(7);
  std::vector<float> values(count);
  for (float& v : values) v = float(random() % 1000) / 1001;
  return values;
}

TEST(MeshTexture, TwoTexelsAcrossAPatch) {
  const float left = 0.2f, right = 0.8f;
  const Textured t(unit_square, once, grey_texture(2, 1, {left, right}, Wrap::clamp), 1, 0.125);
  ASSERT_EQ(t.r.element.size(), 64u);
  for (std::size_t e = 0; e < 64; ++e) {
    double middle = 0;
    for (const std::uint32_t v : t.mesh.elements[e].vertex) middle += t.mesh.position_m[v].x / 4;
    // Level up to a quarter and from three quarters on, a slope between: elements end at these, so each mean is the middle's.
    const double expected = 0.5 * (middle < 0.25   ? left
                                   : middle > 0.75 ? right
                                                   : left + (middle - 0.25) / 0.5 * (right - left));
    EXPECT_NEAR(t.r.element[e], expected, 1e-6) << middle;
  }
  EXPECT_NEAR(t.r.patch[0], 0.5 * (left + right) / 2, 1e-6);
  for (std::uint32_t v = 0; v < t.mesh.vertex_count(); ++v)
    if (t.mesh.position_m[v].x == 0.5) {
      EXPECT_NEAR(t.r.vertex[v], 0.5 * (left + right) / 2, 1e-6);
    }
}

TEST(MeshTexture, ConstantsAndCheckerboards) {
  const Textured constant(unit_square, once, grey_texture(3, 5, std::vector<float>(15, 0.7f)), 0.5, 0.125);
  for (const double rho : constant.r.element) EXPECT_NEAR(rho, 0.5 * double(0.7f), 1e-7);
  std::vector<float> board(64 * 64);
  for (std::size_t i = 0; i < board.size(); ++i) board[i] = (i / 64 + i) % 2 ? 0.9f : 0.1f;
  // Elements of 8 x 8 fields (points) and of 64 x 64 (points of a halved texture, which is grey).
  for (const double edge : {0.125, 1.0}) {
    const Textured t(unit_square, once, grey_texture(64, 64, board), 1, edge);
    for (const double rho : t.r.element) EXPECT_NEAR(rho, 0.25, 1e-6) << edge;
  }
}

// Triangles, parallelograms and bent quads, turned in the texture, against 512 x 512 points in double. Two points a texel: the
// interpolant's kinks leave an error of 1/32 of the differences of neighbours (here up to 1) along some texels; they
// alternate, and over the 6 x 6 texels or more of an element little is left: 5e-3.
TEST(MeshTexture, ShapesAndTurnsAgainstAFineSum) {
  const std::vector<std::vector<glm::dvec3>> shapes = {{{0, 0, 0}, {1, 0, 0}, {0.3, 0.9, 0}},
                                                       {{0, 0, 0}, {1, 0, 0}, {1.4, 0.8, 0}, {0.4, 0.8, 0}},
                                                       {{0, 0, 0}, {1, 0, 0}, {0.7, 0.6, 0}, {0, 1, 0}}};
  const std::vector<glm::dvec2> turned = {{0.1, 0.2}, {0.9, 0.5}, {0.7, 1.3}, {-0.3, 0.8}};
  const Texture texture = grey_texture(16, 13, noise(16 * 13));
  for (const auto& shape : shapes) {
    const Textured t(shape, turned, texture, 2, 2);
    ASSERT_EQ(t.mesh.elements.size(), 1u);
    const std::size_t n = 512;
    double sum = 0, area = 0;
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t i = 0; i < n; ++i) {
        const double u = (double(i) + 0.5) / n, v = (double(j) + 0.5) / n;
        std::vector<double> w;
        double jacobian = 1;
        if (shape.size() == 3) {
          if (u + v > 1) continue;
          w = {1 - u - v, u, v, 0};
        } else {
          w = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
          const glm::dvec3 du = (1 - v) * (shape[1] - shape[0]) + v * (shape[2] - shape[3]),
                           dv = (1 - u) * (shape[3] - shape[0]) + u * (shape[2] - shape[1]);
          jacobian = glm::length(glm::cross(du, dv));
        }
        glm::dvec2 at(0);
        for (std::size_t k = 0; k < 4; ++k) at += w[k] * turned[k];
        sum += jacobian * texture_value(texture, at.x, at.y), area += jacobian;
      }
    EXPECT_NEAR(t.r.element[0], 0.5 * sum / area, 5e-3) << shape.size();
  }
}

// 100 repeats on one element: points of a texture of one texel. In single precision 1e-6.
TEST(MeshTexture, ManyRepeatsAreTheMean) {
  const std::vector<float> texels = noise(48 * 20);
  const Textured t(unit_square, {{0, 0}, {100, 0}, {100, 100}, {0, 100}}, grey_texture(48, 20, texels), 1, 1);
  EXPECT_NEAR(t.r.element[0], 0.5 * mean_colour(t.scene.textures[0], 1)[0], 1e-6);
}

TEST(MeshTexture, HalvingKeepsTheMean) {
  for (const auto& [width, height] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{8, 8}, {7, 5}, {1, 9}, {2, 1}, {3, 3}}) {
    Texture t = grey_texture(width, height, noise(std::size_t(width) * height));
    const double mean = mean_colour(t, 1)[0];
    while (t.width > 1 || t.height > 1) {
      t = halved(t, 1);
      EXPECT_NEAR(mean_colour(t, 1)[0], mean, 1e-6) << width << ' ' << height << " at " << t.width;
    }
  }
}

// What is covered does not count in the patch's mean: light leaves from the rest.
TEST(MeshTexture, PatchMeansAreOfWhatIsExposed) {
  const Textured t(unit_square, once, grey_texture(2, 1, {0.2f, 0.8f}, Wrap::clamp), 1, 0.25);
  std::vector<std::uint8_t> covered(t.mesh.vertex_count());
  for (std::size_t v = 0; v < covered.size(); ++v) covered[v] = t.mesh.position_m[v].x > 0.7;
  const Reflectances r = average_textures(test::device(), t.scene, t.mesh, covered);
  // Columns of elements with means 0.2, 0.35, 0.65 and 0.8; of the third the half by its right corners, and all of the last.
  EXPECT_NEAR(r.patch[0], 0.5 * (0.2 + 0.35 + 0.65 / 2) / 2.5, 1e-6);
  EXPECT_EQ(r.element, t.r.element);
}

}  // namespace
}  // namespace clrad
