/// The scene `boxes`: a closed room with a lamp, full of boxes; any number of polygons. And lamps for other scenes.
#pragma once
#include <cstdint>
#include <string>

#include "model.hpp"

namespace make_scene {

struct Lamp {
  std::uint32_t case_material, light;
};
Lamp lamp_materials(Model& model, double exitance_W_m2);

/// A flat box whose bottom emits; `at` is the middle of that.
void hang_lamp(Model& model, const Lamp& lamp, const std::string& name, const Point& at, double width,
               double depth);

/// A room of 6 polygons and 10 m edge, one lamp of 6, boxes of 6, each in a cell of its own; the remainder comes from
/// floor and walls cut into triangles. polygons: of all, at least 12.
Model boxes(int polygons, std::uint64_t seed);

}  // namespace make_scene
