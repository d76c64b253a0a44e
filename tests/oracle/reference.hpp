// Scenes and answers of tests/data/reference, as clrad's types.
#pragma once
#include <algorithm>
#include <cmath>
#include <fstream>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "clrad/scene.hpp"

namespace clrad::oracle {

using json = nlohmann::json;

inline json reference(const std::string& file) {
  std::ifstream in(std::string(CLRAD_TEST_DATA "/reference/") + file);
  if (!in) throw std::runtime_error("no reference data " + file);
  return json::parse(in);
}

inline const json& reference_case(const json& data, const std::string& id) {
  for (const auto& c : data.at("cases"))
    if (c.at("id") == id) return c;
  throw std::runtime_error("no reference case " + id);
}

inline glm::dvec3 vec(const json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

inline Polygon polygon(const json& vertices, std::uint32_t material, const std::string& name) {
  Polygon p;
  p.corners = std::uint32_t(vertices.size());
  for (std::uint32_t k = 0; k < p.corners; ++k) p.corner[k] = vec(vertices.at(k));
  p.material = material;
  p.name = name;
  return p;
}

/// "scene" of a case: a list of {name, vertices, emission, reflectance}; emission is radiant exitance.
inline Scene scene_of(const json& polygons) {
  Scene scene;
  scene.file = "reference";
  scene.bands = {"red", "green", "blue"};
  for (const auto& p : polygons) {
    Material m;
    m.name = p.at("name");
    m.reflectance = p.at("reflectance").get<std::vector<double>>();
    m.emitted_exitance = p.at("emission").get<std::vector<double>>();
    scene.polygons.push_back(polygon(p.at("vertices"), std::uint32_t(scene.materials.size()), m.name));
    scene.materials.push_back(m);
  }
  return scene;
}

/// A closed box [0, size] facing inward, order x_min x_max y_min y_max z_min z_max, all alike.
inline Scene box_scene(const glm::dvec3& size, const std::vector<double>& rho,
                       const std::vector<double>& emitted) {
  const double x = size.x, y = size.y, z = size.z;
  const glm::dvec3 faces[6][4] = {
      {{0, 0, 0}, {0, y, 0}, {0, y, z}, {0, 0, z}}, {{x, 0, 0}, {x, 0, z}, {x, y, z}, {x, y, 0}},
      {{0, 0, 0}, {0, 0, z}, {x, 0, z}, {x, 0, 0}}, {{0, y, 0}, {x, y, 0}, {x, y, z}, {0, y, z}},
      {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}}, {{0, 0, z}, {0, y, z}, {x, y, z}, {x, 0, z}}};
  Scene scene;
  scene.file = "box";
  for (std::size_t b = 0; b < rho.size(); ++b) scene.bands.push_back(std::to_string(b));
  scene.materials.push_back({"all", rho, emitted, {}});
  for (const auto& face : faces) {
    Polygon p;
    p.corners = 4;
    for (int k = 0; k < 4; ++k) p.corner[k] = face[k];
    scene.polygons.push_back(p);
  }
  return scene;
}

/// A room of 4 m with a block in it; its vertices' irradiance is known to six digits or better.
inline Scene block_room() {
  return scene_of(reference_case(reference("c_scenes_with_occlusion.json"), "C-block-room-1").at("scene"));
}

/// Longest side of the box around a scene, in metres.
inline double extent_of(const Scene& scene) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

}  // namespace clrad::oracle
