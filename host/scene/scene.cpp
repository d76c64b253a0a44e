#include <fmt/format.h>

#include <algorithm>
#include <clrad/error.hpp>
#include <clrad/scene.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "scene/backs.hpp"
#include "scene/gltf.hpp"
#include "scene/obj.hpp"
#include "scene/overlap.hpp"
#include "scene/range.hpp"
#include "scene/topology.hpp"
#include "scene/validate.hpp"

namespace clrad {
namespace {

// Twice the area vector, from the diagonals of a quad: exact for planar ones wherever the first corner is.
glm::dvec3 twice_area_vector(const Polygon& polygon) {
  const auto& c = polygon.corner;
  return polygon.corners == 4 ? glm::cross(c[2] - c[0], c[3] - c[1]) : glm::cross(c[1] - c[0], c[2] - c[0]);
}

bool any_positive(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return v > 0; });
}

std::string ending_of(const std::string& path) {
  const auto dot = path.find_last_of('.');
  std::string ending = dot == std::string::npos ? "" : path.substr(dot);
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return ending;
}

RawScene read(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".obj") return read_obj(path);
  if (ending == ".gltf" || ending == ".glb") return read_gltf(path, ending == ".glb");
  throw InputError(fmt::format("{}: not a scene by its name; clrad reads .obj, .gltf and .glb", path));
}

Scene read_and_validate(const std::string& path, const LoadOptions& options) {
  RawScene raw = read(path);
  if (options.sides != Sides::as_file)
    for (Material& material : raw.materials) material.two_sided = options.sides == Sides::two;
  return validate(std::move(raw), options.unit_m);
}

}  // namespace

std::string SourceLocation::text() const {
  if (line > 0) return fmt::format("{}:{}", file, line);
  return item.empty() ? file : fmt::format("{}: {}", file, item);
}

bool Material::is_glass() const {
  return any_positive(transmission);
}

bool Material::is_mirror() const {
  return any_positive(specular) && !is_glass();
}

double PunctualLight::solid_angle_sr() const {
  constexpr double pi = std::numbers::pi;
  if (kind == Kind::directional) return 0;
  if (kind == Kind::point) return 4 * pi;
  // 2 pi of the integral over c = cos a of 1 from cos inner to 1 and of the squared ramp below it.
  const double inner = std::cos(inner_cone_rad), outer = std::cos(outer_cone_rad);
  return 2 * pi * ((1 - inner) + (inner - outer) / 3);
}

bool has_specular(const Scene& scene) {
  return std::any_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    return m.is_glass() || m.is_mirror();
  });
}

bool has_textures(const Scene& scene) {
  return !scene.textures.empty() &&
         std::any_of(scene.polygons.begin(), scene.polygons.end(),
                     [&](const Polygon& p) { return scene.materials[p.material].texture != no_texture; });
}

double Polygon::area_m2() const {
  return 0.5 * glm::length(twice_area_vector(*this));
}

glm::dvec3 Polygon::normal() const {
  // Scaled by the longest component first: squares of a nanometre's area would leave double's range.
  const glm::dvec3 v = twice_area_vector(*this);
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return largest > 0 ? glm::normalize(v / largest) : glm::dvec3(0);
}

Scene load_scene(const std::string& path, const LoadOptions& options) {
  Scene scene = read_and_validate(path, options);
  for (const Diagnostic& d : scene.diagnostics) {
    if (d.severity == Diagnostic::Severity::error) throw InputError(d.where.text() + ": " + d.message);
  }
  return scene;
}

std::vector<Diagnostic> check_scene(const std::string& path, const LoadOptions& options) {
  try {
    Scene scene = read_and_validate(path, options);
    check_range(scene, scene.diagnostics);
    check_overlaps(scene, scene.diagnostics);
    check_open_edges(scene, scene.diagnostics);
    check_two_sided(scene, scene.diagnostics);
    sort_findings(scene);
    return std::move(scene.diagnostics);
  } catch (const InputError& error) {
    std::string message = error.what();
    if (message.starts_with(path + ": ")) message.erase(0, path.size() + 2);
    return {{Diagnostic::Severity::error, "unreadable", {path, 0, ""}, message}};
  }
}

}  // namespace clrad
