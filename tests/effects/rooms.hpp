// Rooms whose features are known because they were put there.
#pragma once
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "clrad/scene.hpp"
#include "oracle/reference.hpp"

namespace clrad::test {

struct Room {
  bool coloured_wall = false;   ///< one wall reflects differently in the bands
  bool coloured_light = false;  ///< the lamp does not shine white
  bool second_lamp = false;     ///< of another colour than the first
  bool block = false;           ///< a box floats in the room
  bool black = false;           ///< nothing reflects
  bool mirror = false;          ///< one wall
  bool uniform = false;         ///< all surfaces emit and reflect alike; wins over colours and black
  bool turned = false;          ///< turned, and moved a hundred metres
  bool light = false;           ///< a white point light in the room
  bool texture = false;         ///< grey, on one wall
  bool pane = false;            ///< a sheet of glass across the room
  bool sheet = false;           ///< a two-sided polygon in the room
};

inline std::vector<double> white(double value) {
  return {value, value, value};
}

/// A box of 3 x 4 x 2.5 m, its ceiling the lamp.
inline Scene make_room(const Room& room) {
  Scene scene = oracle::box_scene({3, 4, 2.5}, white(0.5), white(0));
  scene.bands = {"red", "green", "blue"};
  scene.file = "room";
  scene.materials.clear();
  for (std::uint32_t p = 0; p < 6; ++p) {
    Material m;
    m.name = "side " + std::to_string(p);
    m.reflectance = white(room.black ? 0 : 0.3 + 0.1 * p);
    m.emitted_exitance = white(0);
    scene.polygons[p].material = p;
    scene.materials.push_back(m);
  }
  constexpr std::uint32_t wall = 0, floor = 4, ceiling = 5;
  scene.materials[ceiling].emitted_exitance = room.coloured_light ? std::vector<double>{3, 2, 1} : white(2);
  if (room.second_lamp) scene.materials[1].emitted_exitance = {0.5, 0.5, 1};
  if (room.coloured_wall) scene.materials[wall].reflectance = {0.6, 0.1, 0.2};
  if (room.mirror) scene.materials[floor].specular = white(0.2);
  if (room.block) {
    const Scene box = oracle::box_scene({0.5, 0.5, 0.5}, white(0.4), white(0));
    const auto material = std::uint32_t(scene.materials.size());
    scene.materials.push_back(scene.materials[wall]);
    for (Polygon p : box.polygons) {
      std::swap(p.corner[1], p.corner[3]);  // faces outward
      for (auto& c : p.corner) c += glm::dvec3(1.2, 1.3, 0.9);
      p.material = material;
      scene.polygons.push_back(p);
    }
  }
  const auto stand = [&](double x, const Material& m) {  // upright, across the room, clear of its walls
    Polygon p;
    p.corners = 4;
    p.corner = {{{x, 0.5, 0.5}, {x, 3.5, 0.5}, {x, 3.5, 2}, {x, 0.5, 2}}};
    p.material = std::uint32_t(scene.materials.size());
    scene.materials.push_back(m);
    scene.polygons.push_back(p);
  };
  Material thing = scene.materials[1];
  thing.emitted_exitance = white(0);
  if (room.sheet) thing.two_sided = true, stand(2, thing);
  thing.two_sided = false;
  if (room.uniform)
    for (Material& m : scene.materials) m.reflectance = white(0.5), m.emitted_exitance = white(1);
  if (room.pane) thing.reflectance = white(0), thing.transmission = white(0.9), stand(2.5, thing);
  if (room.light) {
    PunctualLight light;
    light.name = "lamp", light.position_m = {1, 1, 2}, light.intensity = white(3);
    scene.lights.push_back(light);
  }
  if (room.texture) {
    scene.textures.push_back({"grey.png", 2, 1, {}, {0.5f, 0.5f, 0.5f, 0.75f, 0.75f, 0.75f}});
    scene.materials[3].texture = 0;
    for (Polygon& p : scene.polygons)
      if (p.material == 3) p.uv = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  }
  if (room.turned) {
    const glm::dmat4 turn =
        glm::rotate(glm::rotate(glm::dmat4(1), 0.7, glm::dvec3(1, 2, 3)), 0.3, glm::dvec3(0, 1, 0));
    for (Polygon& p : scene.polygons)
      for (auto& c : p.corner) c = glm::dvec3(turn * glm::dvec4(c, 1)) + glm::dvec3(100, -30, 20);
    for (PunctualLight& l : scene.lights)
      l.position_m = glm::dvec3(turn * glm::dvec4(l.position_m, 1)) + glm::dvec3(100, -30, 20);
  }
  return scene;
}

}  // namespace clrad::test
