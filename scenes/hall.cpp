#include "hall.hpp"

#include <fmt/format.h>

#include <cmath>

#include "boxes.hpp"

namespace make_scene {
namespace {
constexpr Color kNone = {0, 0, 0};
}  // namespace

Model hall(int columns, int sides) {
  Model model;
  const std::uint32_t stone = model.material({"stone", {0.55, 0.5, 0.42}, kNone});
  const std::uint32_t marble = model.material({"marble", {0.75, 0.73, 0.7}, kNone});
  const std::uint32_t plaster = model.material({"plaster", {0.7, 0.68, 0.62}, kNone});
  const Lamp lamp = lamp_materials(model, 300);
  const int across = static_cast<int>(std::ceil(std::sqrt(0.5 * columns)));
  const int along = (columns + across - 1) / across;
  const double step = 4.0, height = 8.0;
  model.room({step * (along + 1), step * (across + 1), height}, stone, plaster, plaster);
  // Entasis: the shaft swells a little and then tapers, in eight drums.
  constexpr int kDrums = 8;
  std::vector<Model::Ring> shaft;
  for (int k = 0; k <= kDrums; ++k) {
    const double t = double(k) / kDrums;
    shaft.push_back({0.5 * (1 - 0.18 * t * t), 6.2 * t});
  }
  for (int c = 0; c < columns; ++c) {
    const double x = step * (c % along + 1), y = step * (c / along + 1);
    const std::string name = fmt::format("column{}", c);
    model.box(name + "_plinth", {x, y, 0}, {1.3, 1.3, 0.3}, stone);
    model.lathe(name + "_shaft", {x, y, 0.3}, shaft, sides, marble);
    model.box(name + "_capital", {x, y, 6.5}, {1.2, 1.2, 0.4}, marble);
    if (c % 2 == 0) hang_lamp(model, lamp, name + "_lamp", {x - 0.5 * step, y - 0.5 * step, 6.8}, 0.8, 0.8);
  }
  return model;
}

}  // namespace make_scene
