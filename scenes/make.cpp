/// make_scene: scenes of any size for tests and benchmarks. A closed room facing inward, closed objects
/// facing outward that do not pass through each other, and lamps that hang below the ceiling. The same
/// arguments give the same file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>

#include "boxes.hpp"
#include "model.hpp"

namespace {

using make_scene::hang_lamp;
using make_scene::Lamp;
using make_scene::lamp_materials;
using make_scene::Model;
using make_scene::Point;

constexpr make_scene::Color kNone = {0, 0, 0};

void desk(Model& model, const std::string& name, double x, double y, std::uint32_t wood, std::uint32_t metal,
          std::uint32_t plastic, std::uint32_t cloth, std::uint32_t paper, make_scene::Random& random) {
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
            make_scene::turned(random.between(0.0, 0.3)));
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
  make_scene::Random random(1);
  for (int d = 0; d < desks; ++d) {
    const double x = 0.5 + wide * (d % columns + 0.5), y = 0.5 + deep * (d / columns + 0.6);
    const std::string name = fmt::format("desk{}", d);
    desk(model, name, x, y, wood, metal, plastic, cloth, paper, random);
    hang_lamp(model, lamp, name + "_ceiling_lamp", {x, y, 2.6}, 1.2, 0.3);
  }
  return model;
}

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

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Makes scenes of any size as OBJ and MTL, in metres. The same arguments give the same file.\n"
      "  make_scene office --desks 60 -o office.obj                  about 30 k triangles\n"
      "  make_scene hall --columns 212 --sides 64 -o hall.obj        about 250 k triangles\n"
      "  make_scene boxes --polygons 1000 --seed 7 -o boxes.obj      exactly 1000 polygons",
      "make_scene"};
  app.require_subcommand(1);
  std::string output;
  int desks = 60, columns = 212, sides = 64, polygons = 1000;
  std::uint64_t seed = 1;
  const auto verb = [&](const char* name, const char* what) {
    CLI::App* sub = app.add_subcommand(name, what);
    sub->add_option("-o,--output", output, "the OBJ file to write; its MTL file goes beside it")->required();
    return sub;
  };
  CLI::App* office_verb = verb("office", "desks with chairs, screens, books and lamps");
  office_verb->add_option("--desks", desks, "how many, about 500 triangles each")
      ->check(CLI::Range(1, 100000));
  CLI::App* hall_verb = verb("hall", "a hall of columns with plinth, swelling shaft and capital");
  hall_verb->add_option("--columns", columns, "how many")->check(CLI::Range(1, 100000));
  hall_verb->add_option("--sides", sides, "of a shaft; a column has 18 triangles a side and 24")
      ->check(CLI::Range(3, 1000));
  CLI::App* boxes_verb = verb("boxes", "boxes at random, each in a cell of its own");
  boxes_verb->add_option("--polygons", polygons, "of the whole scene, at least 12")
      ->check(CLI::Range(12, 100000000));
  boxes_verb->add_option("--seed", seed, "of the random sizes and turns");
  CLI11_PARSE(app, argc, argv);

  try {
    std::string made_by;
    Model model;
    if (office_verb->parsed()) {
      made_by = fmt::format("make_scene office --desks {}", desks);
      model = office(desks);
    } else if (hall_verb->parsed()) {
      made_by = fmt::format("make_scene hall --columns {} --sides {}", columns, sides);
      model = hall(columns, sides);
    } else {
      made_by = fmt::format("make_scene boxes --polygons {} --seed {}", polygons, seed);
      model = make_scene::boxes(polygons, seed);
    }
    model.write(output, made_by);
    fmt::print("{}: {} polygons, {} triangles\n", output, model.polygons(), model.triangles());
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    fmt::print(stderr, "make_scene: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
