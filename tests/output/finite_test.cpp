// No file that clrad writes holds a NaN or an infinity, whatever the scene: every number of report, glTF, VTK grid and
// pictures is looked at.
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <cstring>

#include "clrad/clrad.hpp"
#include "output/support.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using Json = nlohmann::json;

// Paths of the numbers that are not finite, which JSON writes as null. By null these say that they are unknown: the
// total of the error and that of sensors that are not there, effects, and what rows of the linear system that were not all traced, or have no defect, amplify.
void find_nulls(const Json& value, const std::string& path, std::vector<std::string>& found) {
  if (value.is_null() && !path.starts_with("/closure/") && !path.ends_with("/total_relative") &&
      !path.ends_with("/sensors_relative") && !path.ends_with("/skip_error_relative"))
    found.push_back(path);
  if (value.is_object())
    for (const auto& [key, part] : value.items()) find_nulls(part, path + "/" + key, found);
  if (value.is_array())
    for (const auto& part : value) find_nulls(part, path + "/", found);
}
std::vector<std::string> nulls(const Json& value) {
  std::vector<std::string> found;
  find_nulls(value, "", found);
  return found;
}

// How many numbers of type T there are, and how many of them are not finite.
template <class T>
std::pair<std::size_t, std::size_t> count(const char* data, std::size_t bytes) {
  std::size_t bad = 0;
  for (std::size_t at = 0; at + sizeof(T) <= bytes; at += sizeof(T)) {
    T value;
    std::memcpy(&value, data + at, sizeof value);
    bad += !std::isfinite(value);
  }
  return {bytes / sizeof(T), bad};
}

// The float accessors of a GLB: every one of them, not only those that are drawn.
void expect_finite_glb(const std::string& file) {
  std::uint32_t length = 0;
  std::memcpy(&length, file.data() + 12, 4);
  const Json root = Json::parse(file.substr(20, length));
  EXPECT_EQ(nulls(root), std::vector<std::string>());
  const char* binary = file.data() + 20 + length + 8;
  std::size_t numbers = 0;
  for (const auto& accessor : root.at("accessors")) {
    if (accessor.at("componentType") != 5126) continue;
    const Json& view = root.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
    const std::size_t offset = view.value("byteOffset", 0), bytes = view.at("byteLength");
    ASSERT_LE(20 + length + 8 + offset + bytes, file.size());
    const auto [all, bad] = count<float>(binary + offset, bytes);
    EXPECT_EQ(bad, 0u) << accessor.dump();
    numbers += all;
  }
  EXPECT_GT(numbers, 0u);
}

// The appended arrays of floating-point numbers: each is its length in bytes (64 bits), then the values.
void expect_finite_vtu(const std::string& file) {
  const std::size_t begin = file.find("<AppendedData encoding=\"raw\">");
  ASSERT_NE(begin, std::string::npos);
  const std::size_t base = file.find('_', begin) + 1;
  std::size_t numbers = 0;
  for (std::size_t at = 0; (at = file.find("<DataArray type=\"Float64\"", at)) < begin; ++at) {
    const std::size_t offset = std::stoull(file.substr(file.find("offset=\"", at) + 8));
    std::uint64_t bytes = 0;
    ASSERT_LE(base + offset + 8, file.size());
    std::memcpy(&bytes, file.data() + base + offset, 8);
    ASSERT_LE(base + offset + 8 + bytes, file.size());
    const auto [all, bad] = count<double>(file.data() + base + offset + 8, bytes);
    EXPECT_EQ(bad, 0u) << file.substr(at, 80);
    numbers += all;
  }
  EXPECT_GT(numbers, 0u);
}

class Finite : public test::FileTest {
 protected:
  std::vector<float> pixels(const std::string& path) const {
    const auto in = OIIO::ImageInput::open(path);
    if (!in) return {};
    const auto& spec = in->spec();
    std::vector<float> values(std::size_t(spec.width) * spec.height * spec.nchannels);
    EXPECT_TRUE(in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()));
    return values;
  }

  void expect_finite(const Scene& scene, SolveOptions options = {}) {
    const Frame frame = frame_of(scene);
    options.samples = 1, options.light_samples = 4, options.sensor_rays = 64;
    if (options.mesh.patch_edge_m == 0) options.mesh = {frame.metres(), frame.metres() / 2};
    options.sensors = {{frame.centre, {0, 0, 1}},
                       {scene.polygons[0].corner[0], scene.polygons[0].normal()},
                       {scene.polygons[0].corner[0], -scene.polygons[0].normal()}};
    const Solution s = solve(test::device(), scene, options);
    const ImageOptions small{.width = 16, .height = 12, .samples_per_pixel = 1};
    const Image image = render(test::device(), s, default_camera(scene), small);
    write_report(in_folder("r.json"), s);
    write_gltf(in_folder("s.glb"), s);
    write_vtu(in_folder("s.vtu"), s);
    write_image(in_folder("p.png"), image, small);
    write_image(in_folder("p.exr"), image, small);
    EXPECT_EQ(nulls(Json::parse(bytes(in_folder("r.json")))), std::vector<std::string>());
    expect_finite_glb(bytes(in_folder("s.glb")));
    expect_finite_vtu(bytes(in_folder("s.vtu")));
    for (const char* picture : {"p.png", "p.exr"}) {
      const std::vector<float> values = pixels(in_folder(picture));
      EXPECT_GE(values.size(), 16u * 12);
      for (const float v : values) ASSERT_TRUE(std::isfinite(v)) << picture;
    }
    const Solution back = (write_solution(in_folder("s.clrad"), s), load_solution(in_folder("s.clrad")));
    EXPECT_EQ(back.vertex_irradiance, s.vertex_irradiance);  // which refuses what is not finite
  }
};

// A floor and a lamp above that faces it, `size` metres wide, at `where`.
Scene two_squares(double size, const glm::dvec3& where, double exitance, double rho) {
  Scene scene;
  scene.file = "two squares";
  scene.bands = {"grey"};
  scene.materials = {{"floor", {rho}, {0}, {}}, {"lamp", {rho}, {exitance}, {}}};
  const auto square = [&](double z, bool up, std::uint32_t material) {
    Polygon p;
    p.corners = 4, p.material = material;
    p.corner = {{{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}}};
    if (!up) std::swap(p.corner[1], p.corner[3]);
    for (auto& c : p.corner) c = where + size * c;
    scene.polygons.push_back(p);
  };
  square(0, true, 0), square(1, false, 1);
  return scene;
}

TEST_F(Finite, LightOfEveryStrength) {
  for (const double exitance : {0.0, 1e-10, 1.0, 1e15})
    for (const double rho : {0.0, 0.999}) expect_finite(two_squares(1, {0, 0, 0}, exitance, rho));
}

TEST_F(Finite, ScenesOfEverySizeAndPlace) {
  for (const double size : {1e-10, 1e-3, 1e9}) expect_finite(two_squares(size, {0, 0, 0}, 1e-10, 0.5));
  expect_finite(two_squares(9e9, {0, 0, 0}, 1e15, 0.5));
  expect_finite(two_squares(1, {1e6, -1e6, 1e6}, 1, 0.5));
}

TEST_F(Finite, DegenerateGeometry) {
  Scene scene = two_squares(1, {0, 0, 0}, 1, 0.5);
  Scene lone = scene;
  lone.polygons.erase(lone.polygons.begin());
  expect_finite(lone);
  // A floor twice over, a square standing on its edge, a sliver and a square in the plane of the floor's edge.
  scene.polygons.push_back(scene.polygons[0]);
  Polygon standing = scene.polygons[0], sliver = scene.polygons[0], flat = scene.polygons[0];
  standing.corner = {{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}};
  sliver.corner = {{{0.2, 0.2, 0.5}, {0.8, 0.2, 0.5}, {0.5, 0.2 + 1e-12, 0.5}}}, sliver.corners = 3;
  flat.corner = {{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}};
  for (const Polygon& p : {standing, sliver, flat}) scene.polygons.push_back(p);
  expect_finite(scene);
  // The floor and the lamp touch, and the lamp is far smaller than the floor.
  Scene touching = two_squares(1, {0, 0, 0}, 1, 0.5);
  for (auto& c : touching.polygons[1].corner) c = {c.x * 1e-8, c.y * 1e-8, 0.0};
  expect_finite(touching);
}

TEST_F(Finite, ScenesOfTheRepository) {
  for (const char* name : {"furnace", "mirror_room", "flap"})
    expect_finite(load_scene(CLRAD_SCENES "/" + std::string(name) + ".obj"));
  SolveOptions adaptive;
  adaptive.adaptive.tolerance = 0.1;
  adaptive.adaptive.max_level = 1;
  expect_finite(load_scene(CLRAD_SCENES "/block_room.obj"), adaptive);
}

}  // namespace
}  // namespace clrad
