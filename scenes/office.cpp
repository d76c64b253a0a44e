#include "office.hpp"

#include <fmt/format.h>

#include <cmath>

#include "boxes.hpp"

namespace make_scene {
namespace {
constexpr Color kNone = {0, 0, 0};

void desk(Model& model, const std::string& name, double x, double y, std::uint32_t wood, std::uint32_t metal,
          std::uint32_t plastic, std::uint32_t cloth, std::uint32_t paper, Random& random) {
  const auto part = [&](const char* what) { return name + "_" + what; };
  for (const double dx : {-0.75, 0.75}) {
    for (const double dy : {-0.35, 0.35})
      model.box(part("leg"), {x + dx, y + dy, 0}, {0.05, 0.05, 0.72}, metal);
  }
  model.box(part("top"), {x, y, 0.72}, {1.6, 0.8, 0.03}, wood);
  model.box(part("cabinet"), {x + 0.45, y + 0.02, 0.1}, {0.4, 0.6, 0.55}, wood);
  for (int k = 0; k < 3; ++k) {
    model.box(part("handle"), {x + 0.45, y - 0.3, 0.2 + 0.16 * k}, {0.12, 0.04, 0.015}, metal);
  }
  const double on = 0.75;
  model.box(part("stand"), {x, y + 0.2, on}, {0.24, 0.18, 0.015}, plastic);
  model.box(part("neck"), {x, y + 0.2, on + 0.015}, {0.05, 0.03, 0.12}, plastic);
  model.box(part("screen"), {x, y + 0.2, on + 0.135}, {0.55, 0.03, 0.34}, plastic);
  model.box(part("keyboard"), {x, y - 0.15, on}, {0.42, 0.14, 0.02}, plastic);
  model.box(part("paper"), {x - 0.5, y - 0.1, on}, {0.21, 0.297, 0.04}, paper,
            turned(random.between(0.0, 0.3)));
  for (int k = 0; k < 5; ++k) {
    model.box(part("book"), {x + 0.4 + 0.06 * k, y + 0.25, on}, {0.035, 0.17, random.between(0.18, 0.27)},
              cloth);
  }
  model.lathe(part("mug"), {x + 0.35, y - 0.15, on}, {{0.04, 0}, {0.04, 0.095}}, 12, paper);
  model.lathe(part("lamp_foot"), {x - 0.6, y + 0.25, on}, {{0.08, 0}, {0.08, 0.02}}, 12, metal);
  model.lathe(part("lamp_stem"), {x - 0.6, y + 0.25, on + 0.02}, {{0.012, 0}, {0.012, 0.4}}, 6, metal);
  model.lathe(part("lamp_shade"), {x - 0.6, y + 0.25, on + 0.42}, {{0.11, 0}, {0.05, 0.12}}, 12, metal);

  const double back = y - 0.8;  // the chair
  for (int k = 0; k < 5; ++k) {
    const double angle = 2 * 3.141592653589793 * k / 5;
    model.box(part("foot"), {x + 0.2 * std::cos(angle), back + 0.2 * std::sin(angle), 0}, {0.22, 0.05, 0.06},
              metal, {std::cos(angle), std::sin(angle)});
  }
  model.lathe(part("pole"), {x, back, 0}, {{0.03, 0}, {0.03, 0.42}}, 8, metal);
  model.box(part("seat"), {x, back, 0.42}, {0.48, 0.46, 0.07}, cloth);
  model.box(part("rest"), {x, back - 0.21, 0.49}, {0.44, 0.04, 0.5}, cloth);
}

}  // namespace

Model office(int desks) {
  Model model;
  const std::uint32_t carpet = model.material({"carpet", {0.25, 0.27, 0.32}, kNone});
  const std::uint32_t paint = model.material({"paint", {0.75, 0.74, 0.7}, kNone});
  const std::uint32_t wood = model.material({"wood", {0.5, 0.36, 0.22}, kNone});
  const std::uint32_t metal = model.material({"metal", {0.4, 0.4, 0.42}, kNone});
  const std::uint32_t plastic = model.material({"plastic", {0.08, 0.08, 0.08}, kNone});
  const std::uint32_t cloth = model.material({"cloth", {0.2, 0.3, 0.5}, kNone});
  const std::uint32_t paper = model.material({"paper", {0.8, 0.8, 0.78}, kNone});
  const Lamp lamp = lamp_materials(model, 60);
  const int columns = static_cast<int>(std::ceil(std::sqrt(double(desks))));
  const int rows = (desks + columns - 1) / columns;
  const double wide = 2.2, deep = 2.4;
  model.room({wide * columns + 1, deep * rows + 1, 3.0}, carpet, paint, paint);
  Random random(1);
  for (int d = 0; d < desks; ++d) {
    const double x = 0.5 + wide * (d % columns + 0.5), y = 0.5 + deep * (d / columns + 0.6);
    const std::string name = fmt::format("desk{}", d);
    desk(model, name, x, y, wood, metal, plastic, cloth, paper, random);
    hang_lamp(model, lamp, name + "_ceiling_lamp", {x, y, 2.6}, 1.2, 0.3);
  }
  return model;
}

}  // namespace make_scene
