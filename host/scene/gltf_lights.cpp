#include "scene/gltf_lights.hpp"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "scene/gltf_geometry.hpp"
#include "scene/read_file.hpp"

namespace clrad {
namespace {

constexpr const char* lights_extension = "KHR_lights_punctual";

[[noreturn]] void bad_light(const std::string& message) {
  throw GltfFault("light", message);
}

// A property that is there has the type that it should have; the library would take its default in silence.
void expect_numbers(const tinygltf::Value& object, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (object.Has(key) && !object.Get(key).IsNumber())
      bad_light(fmt::format("\"{}\" of its light is not a number", key));
}

void expect_colour(const tinygltf::Value& object) {
  if (!object.Has("color")) return;
  const tinygltf::Value& colour = object.Get("color");
  bool numbers = colour.IsArray() && colour.ArrayLen() == 3;
  for (int k = 0; numbers && k < 3; ++k) numbers = colour.Get(k).IsNumber();
  if (!numbers) bad_light("\"color\" of its light is not three numbers");
}

// The light's own object: index into the file's lights is checked, and then the types of what it says.
int light_index(const tinygltf::Model& model, const tinygltf::Value& reference) {
  if (!reference.Has("light") || !reference.Get("light").IsInt())
    throw GltfFault("reference", fmt::format("its {} names no light", lights_extension));
  const int index = reference.Get("light").GetNumberAsInt();
  if (index < 0 || std::size_t(index) >= model.lights.size())
    throw GltfFault("reference", fmt::format("light {} does not exist", index));
  const tinygltf::Value& object = model.extensions.at(lights_extension).Get("lights").Get(index);
  expect_numbers(object, {"intensity", "range"});
  expect_colour(object);
  if (object.Has("spot") && object.Get("spot").IsObject())
    expect_numbers(object.Get("spot"), {"innerConeAngle", "outerConeAngle"});
  return index;
}

PunctualLight::Kind kind_of(const std::string& type) {
  if (type == "point") return PunctualLight::Kind::point;
  if (type == "spot") return PunctualLight::Kind::spot;
  if (type == "directional") return PunctualLight::Kind::directional;
  bad_light(
      fmt::format("its light is of type \"{}\"; there are point, spot and directional", one_line(type)));
}

void read_cone(const tinygltf::SpotLight& spot, PunctualLight& light, RawScene& scene) {
  light.inner_cone_rad = spot.innerConeAngle, light.outer_cone_rad = spot.outerConeAngle;
  // Half a turn written with a few digits may pass it by a little.
  constexpr double right_angle = std::numbers::pi / 2, few_digits = 1e-4;
  if (light.outer_cone_rad > right_angle && light.outer_cone_rad <= right_angle + few_digits)
    light.outer_cone_rad = right_angle;
  if (!(light.inner_cone_rad >= 0 && light.inner_cone_rad <= light.outer_cone_rad &&
        light.outer_cone_rad > 0 && light.outer_cone_rad <= right_angle))
    bad_light(
        fmt::format("its spot light has an inner cone of {} and an outer one of {}; 0 <= inner < outer <= "
                    "pi/2 rad",
                    spot.innerConeAngle, spot.outerConeAngle));
  if (light.inner_cone_rad == light.outer_cone_rad)
    scene.add(
        Diagnostic::Severity::warning, "light-cone", light.where,
        "inner and outer cone of its spot light are equal, which glTF does not allow; its edge is taken "
        "as sharp");
}

}  // namespace

std::optional<PunctualLight> read_light(const tinygltf::Model& model, const tinygltf::Node& node,
                                        const glm::dmat4& world, const SourceLocation& where,
                                        RawScene& scene) {
  const auto reference = node.extensions.find(lights_extension);
  if (reference == node.extensions.end()) return std::nullopt;
  const tinygltf::Light& theirs = model.lights[std::size_t(light_index(model, reference->second))];
  PunctualLight light;
  light.name = !node.name.empty() ? node.name : theirs.name.empty() ? "light" : theirs.name;
  light.where = where;
  light.kind = kind_of(theirs.type);
  light.position_m = glm::dvec3(world[3]);
  // It shines along its node's -Z; the node's scale changes nothing but where things stand.
  const glm::dvec3 back(world[2]);
  const double length = glm::length(back);
  if (light.kind != PunctualLight::Kind::point) {
    if (!(length > 0) || !std::isfinite(length))
      bad_light("its node's transform leaves its light no direction to shine in");
    light.direction = -back / length;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double colour = theirs.color.empty() ? 1.0 : theirs.color[k];
    light.intensity.push_back(colour * theirs.intensity);
    if (!(colour >= 0 && theirs.intensity >= 0 && std::isfinite(light.intensity[k])))
      bad_light(
          fmt::format("its light has intensity {} and {} of it in one band; both are finite and not "
                      "negative",
                      theirs.intensity, colour));
  }
  if (light.kind == PunctualLight::Kind::spot) read_cone(theirs.spot, light, scene);
  const tinygltf::Value& object = model.extensions.at(lights_extension)
                                      .Get("lights")
                                      .Get(reference->second.Get("light").GetNumberAsInt());
  if (object.Has("range") && light.kind != PunctualLight::Kind::directional)
    scene.add(Diagnostic::Severity::warning, "light-range", where,
              fmt::format("the range {} of its light is ignored: light is not cut off at a distance, it "
                          "fades with the square of it",
                          theirs.range));
  // Candela and lux: what else the file says is in photometric units, too.
  scene.quantity = Quantity::photometric;
  return light;
}

}  // namespace clrad
