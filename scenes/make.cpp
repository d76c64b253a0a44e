/// make_scene: scenes of any size for tests and benchmarks. A closed room facing inward, closed objects
/// facing outward that do not pass through each other, and lamps that hang below the ceiling. The same
/// arguments give the same file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "boxes.hpp"
#include "hall.hpp"
#include "model.hpp"
#include "office.hpp"

using make_scene::Model;

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
      model = make_scene::office(desks);
    } else if (hall_verb->parsed()) {
      made_by = fmt::format("make_scene hall --columns {} --sides {}", columns, sides);
      model = make_scene::hall(columns, sides);
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
