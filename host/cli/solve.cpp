#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>

#include "cli/cli.hpp"
#include "cli/progress.hpp"

namespace clrad::cli {
namespace {

struct Arguments {
  std::string scene, output, json, image, gltf, sensors, camera, size = "640x640", unit = "m",
                                                                 estimator = "exact", grid;
  DeviceArguments device;
  SolveOptions solve;
  ImageOptions image_options;
  bool quiet = false;
};

void add_arguments(CLI::App& verb, Arguments& a) {
  verb.add_option("scene", a.scene, "OBJ, glTF or GLB file")->required();
  verb.add_option("-o,--output", a.output,
                  "folder for picture.png, scene.glb and report.json (made when missing)");
  verb.add_option("--json", a.json, "write the report here");
  verb.add_option("--image", a.image,
                  "write the picture here: .png (exposed, sRGB) or .exr (linear radiance)");
  verb.add_option("--gltf", a.gltf,
                  "write the solution here: .glb or .gltf with vertex colours and radiosity");
  verb.add_option("--sensors", a.sensors, "irradiance at points: a file of `x y z nx ny nz` lines");
  verb.add_option("--unit", a.unit, "length of one unit of the files: mm, cm, m, in, ft or metres")
      ->capture_default_str();
  a.device.add_to(verb);
  verb.add_option("--seed", a.solve.seed, "of the samples' places")->capture_default_str();
  verb.add_flag("--quiet", a.quiet, "no progress, no summary");
  verb.add_flag("--strict", a.solve.strict, "a violated invariant is an error");

  const char* accuracy = "Accuracy";
  verb.add_option("--engine", a.solve.engine, "visibility: auto, serial or chop")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--grid", a.grid,
                  "voxels of the engine chop, such as 8x8x8 (default: by cost; one voxel in a small scene)")
      ->group(accuracy);
  verb.add_option("--batch", a.solve.rays_per_batch,
                  "rays that the engine chop handles at a time (default: its own choice)")
      ->group(accuracy);
  verb.add_option("--form-factor", a.estimator,
                  "exact (contour formula), subdisk (Wallace), disk (as the 1992 paper prints it)")
      ->check(CLI::IsMember({"exact", "subdisk", "disk"}))
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--samples", a.solve.samples, "rays from a receiver to a shooter")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--light-samples", a.solve.light_samples,
                  "shooters get more rays until one carries less than 1/N of the light")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--sensor-rays", a.solve.sensor_rays, "rays from a sensor")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--converge", a.solve.converge, "stop when unshot / emitted power is below")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--patch-edge", a.solve.mesh.patch_edge_m,
                  "longest edge of a patch, which shoots [m] (default: extent / 8)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);
  verb.add_option("--element-edge", a.solve.mesh.element_edge_m,
                  "longest edge of an element, which receives [m] (default: extent / 64)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);

  verb.add_flag("!--no-near-field", a.solve.near_field,
                "light vertices by the average of a patch however near it is")
      ->group(accuracy);

  const char* picture = "Picture";
  verb.add_option("--camera", a.camera, "a camera of the scene, or ex,ey,ez,tx,ty,tz[,degrees]")
      ->group(picture);
  verb.add_option("--size", a.size, "of the picture")->capture_default_str()->group(picture);
  verb.add_option("--depth", a.image_options.depth, "mirrors and sides of glass that a ray is followed by")
      ->capture_default_str()
      ->group(picture);
  verb.add_option("--exposure", a.image_options.exposure_stops, "stops, added to the automatic exposure")
      ->group(picture);
}

void print_summary(const Solution& s) {
  const Report& r = s.report;
  const char* unit = s.scene.quantity == Quantity::photometric ? "lm" : "W";
  double emitted = 0, absorbed = 0, unshot = 0;
  for (std::uint32_t b = 0; b < s.bands; ++b)
    emitted += r.energy.emitted[b], absorbed += r.energy.absorbed[b], unshot += r.energy.unshot[b];
  fmt::print("{}: {} polygons, {} patches, {} elements, {} vertices\n", s.scene.file, s.scene.polygons.size(),
             s.mesh.patches.size(), s.mesh.elements.size(), s.vertex_count());
  fmt::print("{} shoots and {} re-shoots, {} rays on {}\n\n", r.shoots, r.reshoots, r.rays, r.device.name);
  fmt::print("{:<52} {:>9} {:>9}\n", "where the time went", "launches", "seconds");
  for (const auto& stage : r.stages)
    fmt::print("  {:<50} {:>9} {:>9.3f}\n", stage.name, stage.launches, stage.seconds);
  fmt::print("  {:<50} {:>9} {:>9.3f}\n", "all, by the clock", "", r.seconds.total);
  fmt::print("\nwhere the light went   emitted {:.4g} {}, absorbed {:.2f} %, unshot {:.3g} %, {} {:.2f} %\n",
             emitted, unit, 100 * absorbed / emitted, 100 * unshot / emitted,
             r.energy.closed ? "unaccounted for" : "left the scene or unaccounted for",
             100 * r.energy.unaccounted_relative);
}

// What was asked for by name, and everything when there is a folder.
std::vector<std::string> write_outputs(const Arguments& a, Device& device, Solution& solution,
                                       ProgressLine& line) {
  namespace fs = std::filesystem;
  const auto in_folder = [&](const std::string& given, const char* name) {
    return given.empty() && !a.output.empty() ? (fs::path(a.output) / name).string() : given;
  };
  if (!a.output.empty()) {
    std::error_code error;
    fs::create_directories(a.output, error);
    if (error) throw DeviceError(fmt::format("cannot make the folder {}: {}", a.output, error.message()));
  }
  std::vector<std::string> written;
  if (const auto path = in_folder(a.image, "picture.png"); !path.empty()) {
    line.say("draw the picture");
    const auto start = std::chrono::steady_clock::now();
    const Camera camera = choose_camera(a.camera, solution.scene, parse_unit(a.unit));
    write_image(path, render(device, solution, camera, a.image_options), a.image_options);
    solution.report.seconds.render =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    solution.report.seconds.total += solution.report.seconds.render;
    solution.report.stages = device.profile();
    written.push_back(path);
  }
  if (const auto path = in_folder(a.gltf, "scene.glb"); !path.empty()) {
    line.say("write the glTF");
    write_gltf(path, solution);
    written.push_back(path);
  }
  if (const auto path = in_folder(a.json, "report.json"); !path.empty()) {
    write_report(path, solution);
    written.push_back(path);
  }
  return written;
}

int run(Arguments& a) {
  std::tie(a.image_options.width, a.image_options.height) = parse_size(a.size);
  a.solve.estimator = a.estimator == "exact"     ? Estimator::exact
                      : a.estimator == "subdisk" ? Estimator::subdisk
                                                 : Estimator::disk;
  if (!a.grid.empty()) a.solve.grid = parse_grid(a.grid);
  const double unit_m = parse_unit(a.unit);
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = load_scene(a.scene, {.unit_m = unit_m});
  if (!a.quiet) print_diagnostics(scene.diagnostics, stderr);
  if (!a.sensors.empty()) a.solve.sensors = load_sensors(a.sensors, unit_m);
  choose_camera(a.camera, scene, unit_m);  // a wrong name is said now, not after the solve
  const double import = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  Device device(a.device.resolved());
  watch_for_interrupt();
  ProgressLine line(a.quiet, a.solve.converge);
  a.solve.progress = [&](const Progress& p) {
    line.show(p);
    return !interrupted();
  };
  Solution solution = solve(device, scene, a.solve);
  solution.report.seconds.import = import;
  solution.report.seconds.total += import;
  const auto written = write_outputs(a, device, solution, line);
  line.clear();

  for (const auto& warning : solution.report.warnings) fmt::print(stderr, "warning: {}\n", warning);
  if (!a.quiet) {
    print_summary(solution);
    for (const auto& s : solution.sensors)
      if (a.json.empty() && a.output.empty())
        fmt::print("sensor {} {} {}: {:.6g}\n", s.position_m.x, s.position_m.y, s.position_m.z,
                   fmt::join(s.irradiance, " "));
    for (const auto& path : written) fmt::print("wrote {}\n", path);
  }
  if (!solution.stopped) return done;
  fmt::print(stderr,
             "stopped with {:.3g} % of the light unshot; what was written is valid, but darker than the full "
             "solution\n",
             100 * solution.unshot_relative);
  return stopped;
}

}  // namespace

void add_solve(CLI::App& app, Action& action) {
  CLI::App* verb =
      app.add_subcommand("solve", "mesh, solve and draw a scene; with -o, everything into a folder");
  const auto a = std::make_shared<Arguments>();
  add_arguments(*verb, *a);
  verb->callback([a, &action] { action = [a] { return run(*a); }; });
}

}  // namespace clrad::cli
