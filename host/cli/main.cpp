#include <fmt/format.h>

#include "cli/cli.hpp"
#include "version.hpp"

int main(int argc, char** argv) {
  using namespace clrad;
  cli::seconds_since_start();  // from here on
  CLI::App app(
      "clrad: data-parallel radiosity. Finds how the diffuse surfaces of a scene light each other and gives "
      "pictures, numbers "
      "and files that other tools open.\n");
  app.set_version_flag("--version", std::string("clrad ") + version);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  clrad solve scenes/cornell.gltf -o out     picture, glTF, VTK grid, solution and report into out/\n"
      "  clrad render out/solution.clrad --camera 0.05,0.5,0.05,0.4,0.2,0.4,70 --image view.png\n"
      "  clrad solve room.glb --sensors desk.pts --json report.json\n"
      "  clrad solve room.glb --target-error 1% -o out   as fine as it takes for an error of 1 %\n"
      "  clrad viewfactors room.obj -o room.npz     the matrix of view factors, for SciPy\n"
      "  clrad plan room.glb                        what a solve would do and leave out, and why\n"
      "  clrad tradeoff room.glb -o out             error against seconds of many settings: plot and table\n"
      "  clrad check room.glb                       what is wrong with the file\n"
      "Exit codes: 0 done, 1 a failure of the program or device, 2 bad usage, 3 bad input, 4 stopped, "
      "partial result written.");
  cli::Action action;
  cli::add_solve(app, action);
  cli::add_plan(app, action);
  cli::add_tradeoff(app, action);
  cli::add_render(app, action);
  cli::add_viewfactors(app, action);
  cli::add_check(app, action);
  cli::add_devices(app, action);
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? cli::done : cli::bad_usage;
  } catch (const UsageError& e) {
    fmt::print(stderr, "clrad: {}\n", e.what());
    return cli::bad_usage;
  } catch (const InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return cli::bad_input;
  } catch (const std::exception& e) {
    fmt::print(stderr, "clrad: {}\n", e.what());
    return cli::failure;
  }
}
