#include <fmt/format.h>

#include <memory>

#include "cli/cli.hpp"

namespace clrad::cli {

void add_check(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("check",
                                      "say what is wrong with a scene: degenerate, non-planar and duplicate "
                                      "faces, open edges, orientation, materials");
  struct Arguments {
    std::string scene, unit = "m";
    bool strict = false;
    SidesArguments sides;
  };
  const auto a = std::make_shared<Arguments>();
  verb->add_option("scene", a->scene, "OBJ, glTF or GLB file")->required();
  verb->add_option("--unit", a->unit, "length of one unit of the file: mm, cm, m, in, ft or metres")
      ->capture_default_str();
  a->sides.add_to(*verb);
  verb->add_flag("--strict", a->strict, "warnings count as errors");
  verb->callback([a, &action] {
    action = [a] {
      const auto findings =
          check_scene(a->scene, {.unit_m = parse_unit(a->unit), .sides = a->sides.resolved()});
      print_diagnostics(findings, stdout);
      int count[3] = {0, 0, 0};
      for (const auto& d : findings) ++count[int(d.severity)];
      fmt::print("{}: {} errors, {} repairs, {} warnings\n", a->scene, count[2], count[1], count[0]);
      return count[2] > 0 || (a->strict && !findings.empty()) ? int(bad_input) : int(done);
    };
  });
}

}  // namespace clrad::cli
