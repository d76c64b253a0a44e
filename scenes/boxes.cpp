#include "boxes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace make_scene {
namespace {
constexpr Color kNone = {0, 0, 0};
}

Lamp lamp_materials(Model& model, double exitance_W_m2) {
  const std::uint32_t case_material = model.material({"lamp_case", {0.7, 0.7, 0.7}, kNone});
  return {case_material,
          model.material(
              {"lamp_light", {0.5, 0.5, 0.5}, {exitance_W_m2, 0.94 * exitance_W_m2, 0.8 * exitance_W_m2}})};
}

void hang_lamp(Model& model, const Lamp& lamp, const std::string& name, const Point& at, double width,
               double depth) {
  model.box(name, at, {width, depth, 0.06}, lamp.case_material, lamp.light);
}

Model boxes(int polygons, std::uint64_t seed) {
  Model model;
  const std::uint32_t white = model.material({"white", {0.7, 0.7, 0.7}, kNone});
  const std::uint32_t red = model.material({"red", {0.6, 0.1, 0.1}, kNone});
  const std::uint32_t blue = model.material({"blue", {0.15, 0.2, 0.6}, kNone});
  const Lamp lamp = lamp_materials(model, 100);
  const int count = (polygons - 12) / 6;
  const double size = 10, top = 9;
  model.room({size, size, size}, white, white, white, (polygons - 12) % 6);
  hang_lamp(model, lamp, "lamp", {0.5 * size, 0.5 * size, 9.5}, 2, 2);
  // One box a cell, small enough to stay inside it however it is turned.
  const int cells = std::max(1, static_cast<int>(std::ceil(std::cbrt(double(count)))));
  const double width = size / cells, depth = top / cells;
  Random random(seed);
  for (int b = 0; b < count; ++b) {
    // Spread over all cells, not the first ones only.
    const long long total = 1ll * cells * cells * cells;
    const int cell = static_cast<int>(b * total / count);
    const double x = width * (cell % cells + 0.5), y = width * (cell / cells % cells + 0.5);
    const double z = depth * (cell / cells / cells);
    const Point extent = {width * random.between(0.2, 0.6), width * random.between(0.2, 0.6),
                          depth * random.between(0.2, 0.8)};
    model.box(fmt::format("box{}", b), {x, y, z + 0.1 * depth}, extent,
              b % 3 == 0   ? red
              : b % 3 == 1 ? blue
                           : white,
              turned(random.between(0.0, 1.0)));
  }
  return model;
}

}  // namespace make_scene
