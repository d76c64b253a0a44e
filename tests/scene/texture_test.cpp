// Textures from files: values, coordinates, wrap modes, and files that are wrong.
#include "scene/texture.hpp"

#include <gtest/gtest.h>

#include "clrad/error.hpp"
#include "scene/files.hpp"
#include "scene/gltf_text.hpp"
#include "scene/images.hpp"

namespace clrad {
namespace {

using clrad_test::Folder;
using clrad_test::Gltf;
using clrad_test::load_error;
using clrad_test::of_rule;
using clrad_test::srgb;
using clrad_test::write_image_file;
using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

// A unit square that emits, whose material has texture 0 of image `image`; `primitive` may be changed before text().
struct TexturedSquare {
  Gltf g;
  explicit TexturedSquare(const std::vector<std::pair<std::string, Json>>& image,
                          const std::vector<std::array<float, 2>>& uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
    const int positions = g.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    const int indices = g.indices(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
    Json attributes = {{"POSITION", positions}};
    if (!uv.empty()) attributes["TEXCOORD_0"] = add_uv(uv);
    g.material({{"name", "wall"},
                {"emissiveFactor", {1, 1, 1}},
                {"pbrMetallicRoughness",
                 {{"baseColorFactor", {0.5, 0.5, 0.5, 1}},
                  {"metallicFactor", 0},
                  {"baseColorTexture", {{"index", 0}}}}}});
    g.json["textures"] = {{{"source", 0}}};
    Json object = Json::object();
    for (const auto& [key, value] : image) object[key] = value;
    g.json["images"] = Json::array({object});
    g.node({{"name", "square"},
            {"mesh", g.mesh({{{"attributes", attributes}, {"indices", indices}, {"material", 0}}})}});
  }
  int add_uv(const std::vector<std::array<float, 2>>& uv) {
    // Three floats a vertex, the third of which the stride passes over.
    std::vector<std::array<float, 3>> padded;
    for (const auto& c : uv) padded.push_back({c[0], c[1], 0});
    const int accessor = g.positions(padded);
    Json& a = g.json["accessors"][std::size_t(accessor)];
    a["type"] = "VEC2";
    g.json["bufferViews"][a["bufferView"].get<std::size_t>()]["byteStride"] = 12;
    return accessor;
  }
  Json& material() { return g.json["materials"][0]; }
};

std::string data_uri(const std::string& png) {
  return "data:image/png;base64," + clrad_test::base64(png);
}

std::string png_of(const Folder& folder, int width, int height, int channels, const Bytes& values) {
  return clrad_test::bytes_of(write_image_file(folder.at("embedded.png"), width, height, channels, values));
}

TEST(SceneTexture, IntegersAreSrgbAndFloatsLinear) {
  const Folder folder;
  const Texture t =
      read_texture(write_image_file(folder.at("a.png"), 2, 1, 3, Bytes{0, 10, 188, 255, 1, 128}));
  ASSERT_EQ(t.width, 2u);
  ASSERT_EQ(t.height, 1u);
  const double expected[] = {0, 10, 188, 255, 1, 128};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(t.texels[i], float(srgb(expected[i]))) << i;
  const Texture deep =
      read_texture(write_image_file(folder.at("b.png"), 1, 1, 1, std::vector<std::uint16_t>{32768}));
  for (std::size_t b = 0; b < 3; ++b)
    EXPECT_NEAR(deep.texels[b], srgb(255 * 32768.0 / 65535), 1e-6) << "one channel is all";
  const Texture linear = read_texture(
      write_image_file(folder.at("c.exr"), 1, 2, 3, std::vector<float>{0.1f, 0.2f, 0.3f, 0, 1, 0.5f}));
  EXPECT_EQ(linear.texels, (std::vector<float>{0.1f, 0.2f, 0.3f, 0, 1, 0.5f}));
  const Texture alpha = read_texture(write_image_file(folder.at("d.png"), 1, 1, 4, Bytes{255, 0, 255, 0}));
  EXPECT_EQ(alpha.texels, (std::vector<float>{1, 0, 1})) << "alpha is not used";
}

TEST(SceneTexture, GltfImagesBesideInAndBehindTheFile) {
  const Folder folder;
  const std::string png = png_of(folder, 2, 1, 3, {255, 0, 0, 0, 128, 255});
  folder.write("my wall.png", png);
  TexturedSquare beside({{"uri", Json("my%20wall.png")}}), in({{"uri", data_uri(png)}});
  // In the binary part: an accessor's bytes and no accessor.
  Gltf& g = in.g;
  TexturedSquare behind({{"bufferView", 0}, {"mimeType", "image/png"}});
  std::vector<std::uint8_t> padded(png.begin(), png.end());
  const int accessor = behind.g.indices(padded);
  behind.g.json["images"][0]["bufferView"] = behind.g.json["accessors"][std::size_t(accessor)]["bufferView"];
  const std::string paths[] = {folder.write("a.gltf", beside.g.text()), folder.write("b.gltf", g.text()),
                               folder.write("c.glb", behind.g.binary())};
  for (const std::string& path : paths) {
    const Scene scene = load_scene(path);
    ASSERT_EQ(scene.textures.size(), 1u) << path;
    ASSERT_EQ(scene.bands.size(), 3u);
    EXPECT_TRUE(has_textures(scene));
    const Texture& t = scene.textures[0];
    EXPECT_EQ(t.texels, (std::vector<float>{1, 0, 0, 0, float(srgb(128)), 1}));
    EXPECT_EQ(scene.materials[0].texture, 0u);
    EXPECT_EQ(scene.materials[0].reflectance, std::vector<double>(3, 0.5));
    ASSERT_EQ(scene.polygons.size(), 1u) << "still one quad";
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_EQ(scene.polygons[0].uv[k], glm::dvec2(scene.polygons[0].corner[k])) << k;
    EXPECT_TRUE(of_rule(scene.diagnostics, "texture-ignored").empty());
  }
}

TEST(SceneTexture, GreyImagesKeepASceneGrey) {
  const Folder folder;
  TexturedSquare s({{"uri", data_uri(png_of(folder, 2, 1, 3, {255, 255, 255, 77, 77, 77}))}});
  const Scene scene = load_scene(folder.write("a.gltf", s.g.text()));
  EXPECT_EQ(scene.bands, (std::vector<std::string>{"grey"}));
  EXPECT_EQ(scene.textures[0].texels, (std::vector<float>{1, float(srgb(77))}));
}

TEST(SceneTexture, WrapTransformAndOtherSets) {
  const Folder folder;
  TexturedSquare s({{"uri", data_uri(png_of(folder, 2, 1, 3, {255, 255, 255, 77, 77, 77}))}});
  s.g.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
  s.g.json["textures"][0]["sampler"] = 0;
  const Scene wrapped = load_scene(folder.write("a.gltf", s.g.text()));
  EXPECT_EQ(wrapped.textures[0].wrap[0], Wrap::clamp);
  EXPECT_EQ(wrapped.textures[0].wrap[1], Wrap::mirror);

  // The extension's own example: the lower left quadrant, where v points down, turned: (1, 0) goes to (0, 1/2) and
  // (0, 1) to (1/2, 1).
  Json& info = s.material()["pbrMetallicRoughness"]["baseColorTexture"];
  info["extensions"]["KHR_texture_transform"] = {
      {"offset", {0, 1}}, {"rotation", 1.57079632679489662}, {"scale", {0.5, 0.5}}};
  s.g.json["extensionsRequired"] = {"KHR_texture_transform"};
  const Scene turned = load_scene(folder.write("b.gltf", s.g.text()));
  const glm::dvec2 expected[] = {{0, 1}, {0, 0.5}, {0.5, 0.5}, {0.5, 1}};
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(glm::length(turned.polygons[0].uv[k] - expected[k]), 1e-12) << k;

  info.erase("extensions");
  info["texCoord"] = 1;
  const int second = s.add_uv({{5, 0}, {6, 0}, {6, 1}, {5, 1}});
  s.g.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = second;
  EXPECT_EQ(load_scene(folder.write("c.gltf", s.g.text())).polygons[0].uv[0], glm::dvec2(5, 0));
}

TEST(SceneTexture, TrianglesWithDifferentMapsStayApart) {
  const Folder folder;
  TexturedSquare s({{"uri", data_uri(png_of(folder, 1, 1, 3, {128, 128, 128}))}},
                   {{0, 0}, {1, 0}, {1, 1}, {0.2f, 1}});
  const Scene scene = load_scene(folder.write("a.gltf", s.g.text()));
  ASSERT_EQ(scene.polygons.size(), 2u);
  EXPECT_EQ(scene.polygons[1].uv[2], glm::dvec2(0.2f, 1));
}

TEST(SceneTexture, WhatReflectsAllLightIsRepaired) {
  const Folder folder;
  TexturedSquare s({{"uri", data_uri(png_of(folder, 2, 1, 3, {255, 255, 255, 200, 255, 77}))}});
  s.material()["pbrMetallicRoughness"].erase("baseColorFactor");  // 1
  const Scene scene = load_scene(folder.write("a.gltf", s.g.text()));
  ASSERT_EQ(scene.textures.size(), 1u) << "the original is not kept";
  const float most = 0.99f;
  EXPECT_EQ(scene.textures[0].texels,
            (std::vector<float>{most, most, most, float(srgb(200)), most, float(srgb(77))}));
  const auto found = of_rule(scene.diagnostics, "texture-reflectance");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Diagnostic::Severity::repair);
  EXPECT_NE(found[0].message.find("2 of 2"), std::string::npos) << found[0].message;
}

TEST(SceneTexture, WrongImagesAreErrorsThatNameThem) {
  const Folder folder;
  const std::string png = png_of(folder, 8, 8, 3, Bytes(192, 77));
  const auto error_of = [&](const std::vector<std::pair<std::string, Json>>& image) {
    return load_error(folder.write("a.gltf", TexturedSquare(image).g.text()));
  };
  EXPECT_NE(error_of({{"uri", std::string("missing.png")}}).find("missing.png"), std::string::npos);
  EXPECT_NE(error_of({{"uri", std::string("missing.png")}}).find("material \"wall\""), std::string::npos);
  EXPECT_NE(error_of({{"uri", std::string("../outside/wall.png")}}).find("wall.png"), std::string::npos);
  EXPECT_NE(error_of({{"uri", data_uri(png.substr(0, png.size() / 2))}, {"name", "torn"}}).find("torn"),
            std::string::npos);
  EXPECT_NE(error_of({{"uri", data_uri("no image at all")}}).find("image 0"), std::string::npos);
  TexturedSquare none({{"uri", data_uri(png)}});
  none.g.json["textures"][0]["source"] = 7;
  EXPECT_NE(load_error(folder.write("b.gltf", none.g.text())), "");
  none.material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 9;
  EXPECT_NE(load_error(folder.write("b.gltf", none.g.text())).find("texture 9 does not exist"),
            std::string::npos);
  const std::string nan =
      write_image_file(folder.at("nan.exr"), 1, 1, 3, std::vector<float>{0.5f, NAN, 0.5f});
  EXPECT_THROW(read_texture(nan), InputError);
  const std::string negative =
      write_image_file(folder.at("negative.exr"), 1, 1, 3, std::vector<float>{0.5f, -1, 0.5f});
  EXPECT_THROW(read_texture(negative), InputError);
}

// Before its 1.1 GiB are asked for: of black lines a PNG of 10,000 x 10,000 has 100 kB, and only the header is read.
TEST(SceneTexture, TooManyTexelsAreRefused) {
  const Folder folder;
  const std::string path = write_image_file(folder.at("large.png"), 10000, 10000, 1, Bytes(100'000'000, 0));
  try {
    read_texture(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("10000 x 10000"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("GiB"), std::string::npos) << error.what();
  }
}

TEST(SceneTexture, FacesWithoutCoordinatesGetTheMean) {
  const Folder folder;
  TexturedSquare s({{"uri", data_uri(png_of(folder, 2, 1, 3, {0, 0, 0, 255, 255, 255}))}}, {});
  const Scene scene = load_scene(folder.write("a.gltf", s.g.text()));
  EXPECT_FALSE(has_textures(scene));
  EXPECT_TRUE(scene.textures.empty());
  EXPECT_EQ(scene.materials[scene.polygons[0].material].reflectance, (std::vector<double>{0.25}));
  EXPECT_EQ(of_rule(scene.diagnostics, "no-texture-coordinates").size(), 1u);
}

// A square of two materials' files; returns its path.
std::string obj_with(const Folder& folder, const std::string& material,
                     const std::string& face = "f 1/1 2/2 3/3 4/4") {
  folder.write("t.mtl", "newmtl m\nKe 1 1 1\n" + material);
  return folder.write("t.obj",
                      "mtllib t.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                      "vt 0 0\nvt 1 0\nvt 1 1 # a corner\nvt 0 1\n" +
                          face + "\n");
}

TEST(SceneTexture, ObjMapKd) {
  const Folder folder;
  write_image_file(folder.at("my wall.png"), 1, 2, 3, Bytes{255, 255, 255, 77, 77, 77});
  const Scene scene = load_scene(obj_with(folder, "Kd 0.5 0.5 0.5\nmap_Kd my wall.png\n"));
  ASSERT_EQ(scene.textures.size(), 1u);
  EXPECT_EQ(scene.textures[0].texels, (std::vector<float>{1, float(srgb(77))})) << "rows from the top";
  EXPECT_EQ(scene.materials[0].reflectance, (std::vector<double>{0.5})) << "Kd multiplies";
  const glm::dvec2 expected[] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(scene.polygons[0].uv[k], expected[k]) << "v upwards " << k;
  EXPECT_EQ(scene.textures[0].wrap[0], Wrap::repeat);

  write_image_file(folder.at("w.png"), 1, 2, 3, Bytes{200, 200, 200, 77, 77, 77});
  const Scene moved = load_scene(
      obj_with(folder, "map_Kd -clamp on -s 2 4 1 -o 0.25 0.5 0 w.png\n", "f -4/-4 -3/-3 -2/-2 -1/-1"));
  EXPECT_EQ(moved.materials[0].reflectance, (std::vector<double>{1})) << "no Kd: the texels alone";
  EXPECT_TRUE(of_rule(moved.diagnostics, "no-reflectance").empty());
  EXPECT_EQ(moved.polygons[0].uv[2], glm::dvec2(2.25, 1 - 4.5));
  EXPECT_EQ(moved.textures[0].wrap[1], Wrap::clamp);
}

TEST(SceneTexture, ObjFindings) {
  const Folder folder;
  write_image_file(folder.at("w.png"), 1, 1, 3, Bytes{128, 128, 128});
  std::string error = load_error(obj_with(folder, "Kd 1 1 1\nmap_Kd none.png\n"));
  EXPECT_NE(error.find("t.mtl:4"), std::string::npos) << error;
  EXPECT_NE(error.find("none.png"), std::string::npos) << error;
  folder.write("torn.png", clrad_test::bytes_of(folder.at("w.png")).substr(0, 40));
  error = load_error(obj_with(folder, "map_Kd torn.png\n"));
  EXPECT_NE(error.find("t.mtl:3"), std::string::npos) << error;
  error = load_error(obj_with(folder, "map_Kd w.png\n", "f 1/1 2/2 3/9"));
  EXPECT_NE(error.find("t.obj:11"), std::string::npos) << error;
  EXPECT_EQ(load_error(obj_with(folder, "Kd 0.5 0.5 0.5\n", "f 1/1 2/2 3/9")), "") << "no texture, no matter";

  const Scene plain = load_scene(obj_with(folder, "map_Kd w.png\n", "f 1 2 3 4"));
  EXPECT_EQ(of_rule(plain.diagnostics, "no-texture-coordinates").size(), 1u);
  EXPECT_NEAR(plain.materials[plain.polygons[0].material].reflectance[0], srgb(128), 1e-7);
  folder.write("t.mtl", "newmtl m\nKe 1 1 1\nKd 0.5 0.5 0.5\nnewmtl unused\nmap_Kd none.png\n");
  EXPECT_EQ(load_error(folder.at("t.obj")), "") << "what no face uses is not read";
  const Scene black = load_scene(obj_with(folder, "Kd 0 0 0\nmap_Kd w.png\n"));
  EXPECT_EQ(of_rule(black.diagnostics, "texture-ignored").size(), 1u);
  EXPECT_FALSE(has_textures(black));
  EXPECT_EQ(
      of_rule(load_scene(obj_with(folder, "map_Kd -mm 0.1 2 w.png\n")).diagnostics, "texture-option-ignored")
          .size(),
      1u);
}

}  // namespace
}  // namespace clrad
