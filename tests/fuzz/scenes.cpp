// OBJ with MTL, and glTF.
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "clrad/error.hpp"
#include "clrad/frame.hpp"
#include "clrad/scene.hpp"
#include "fuzz/targets.hpp"
#include "scene/planes.hpp"

namespace clrad::fuzz {
namespace {

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void require_usable(const Scene& scene) {
  require(!scene.polygons.empty(), "a scene without polygons");
  for (const Polygon& p : scene.polygons) {
    require(p.corners == 3 || p.corners == 4, "a polygon of another number of corners");
    require(p.material < scene.materials.size(), "a material that is not there");
    for (std::uint32_t k = 0; k < p.corners; ++k) require(is_finite(p.corner[k]), "a corner nowhere");
    require(std::isfinite(p.area_m2()), "an area that is not finite");
    require(is_finite(p.normal()), "a normal that is not finite");
  }
  for (const Material& m : scene.materials)
    for (std::size_t b = 0; b < scene.bands.size(); ++b) {
      require(m.reflectance.at(b) >= 0 && m.reflectance.at(b) < 1, "a reflectance outside [0, 1)");
      require(m.emitted_exitance.at(b) >= 0 && std::isfinite(m.emitted_exitance.at(b)), "a bad emission");
    }
  for (const PunctualLight& l : scene.lights) {
    require(is_finite(l.position_m), "a light nowhere");
    require(std::abs(glm::length(l.direction) - 1) < 1e-9, "a light without a direction");
    require(l.inner_cone_rad >= 0 && l.inner_cone_rad <= l.outer_cone_rad && l.outer_cone_rad < 1.6,
            "a bad cone");
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      require(l.intensity.at(b) >= 0 && std::isfinite(l.intensity.at(b)), "a bad intensity");
  }
  for (const Camera& c : scene.cameras)
    require(is_finite(c.eye) && is_finite(c.target) && is_finite(c.up), "a camera nowhere");
  const Frame frame = frame_of(scene);
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k) {
      const glm::dvec3 at = frame.to_frame(p.corner[k]);
      require(std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) <= 1, "a corner outside the frame");
    }
  require(plane_ids(scene).size() == scene.polygons.size(), "a polygon without a plane");
}

void load_and_check(const std::string& path) {
  for (const Diagnostic& d : check_scene(path)) {
    require(d.message.find('\n') == std::string::npos, "a finding of several lines: " + d.message);
    require(!d.where.file.empty(), "a finding without a file: " + d.message);
  }
  Scene scene;
  try {
    scene = load_scene(path);
  } catch (const InputError& e) {
    return require_message(e.what(), path);
  }
  require_usable(scene);
}

}  // namespace

void obj(Bytes bytes) {
  constexpr std::string_view marker = "#### a.mtl\n";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t at = std::min(text.find(marker), text.size());
  const std::size_t from = std::min(at + marker.size(), text.size());
  write_case("a.mtl", bytes.subspan(from));
  load_and_check(write_case("a.obj", bytes.first(at)));
}

void gltf(Bytes bytes) {
  const bool binary = bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
  load_and_check(write_case(binary ? "a.glb" : "a.gltf", bytes));
}

}  // namespace clrad::fuzz
