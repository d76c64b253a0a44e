// What effects cost: predicted and actual seconds and memory of a solve as the scene calls for it, and what it takes with
// every effect forced on.
// bench_effects [-o FILE.json] [SCENE ...]
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "clrad/clrad.hpp"
#include "effects/predict.hpp"
#include "timing.hpp"

namespace {

using namespace clrad;

struct Case {
  std::string name;
  Scene scene;
  SolveOptions options;
};

// Three equal bands, as a file with colours in it would have: 96 patches, 25,350 vertices.
Case white_furnace() {
  Case c{"white furnace", load_scene(CLRAD_SCENES "/furnace.obj"), {}};
  c.scene.bands = {"red", "green", "blue"};
  for (Material& m : c.scene.materials)
    m.reflectance.assign(3, m.reflectance[0]), m.emitted_exitance.assign(3, m.emitted_exitance[0]);
  c.options.mesh = {0.25, 0.03};
  return c;
}

// Best of three, after one that compiles: a solve's own seconds, so that others on the machine count little.
struct Times {
  double solve = INFINITY, all = INFINITY;
  std::uint64_t bytes = 0, shoots = 0;
};
void take(Times& times, Device& device, const Scene& scene, const SolveOptions& options) {
  device.ledger()->peak = 0;
  const Solution s = solve(device, scene, options);
  times.solve = std::min(times.solve, s.report.seconds.solve);
  times.all = std::min(times.all, s.report.seconds.build + s.report.seconds.solve);
  times.bytes = s.report.device_peak_bytes, times.shoots = s.report.shoots;
}

nlohmann::json measure(Device& device, const Case& c) {
  SolveOptions forced = c.options;
  forced.force_effects = {"all"};
  solve(device, c.scene, c.options), solve(device, c.scene, forced);
  Times planned, all;
  for (int round = 0; round < 3; ++round) {
    take(planned, device, c.scene, c.options);
    take(all, device, c.scene, forced);
  }
  const Prediction p = predict(device, c.scene, c.options, plan_effects(c.scene, c.options));
  fmt::print("{:<16} {:>8} {:>8} {:>9.2f} {:>9.2f} {:>6.2f} {:>7.0f} {:>7.0f} {:>9.2f} {:>9.2f} {:>6.2f}\n",
             c.name, p.shoots, planned.shoots, p.seconds, planned.all, p.seconds / planned.all,
             p.device_bytes / 1e6, double(planned.bytes) / 1e6, planned.solve, all.solve,
             all.solve / planned.solve);
  return {{"scene", c.name},
          {"shoots", planned.shoots},
          {"predicted_shoots", p.shoots},
          {"seconds", planned.all},
          {"predicted_seconds", p.seconds},
          {"device_peak_bytes", planned.bytes},
          {"predicted_device_bytes", p.device_bytes},
          {"solve_s", planned.solve},
          {"solve_forced_s", all.solve},
          {"ratio", all.solve / planned.solve}};
}

}  // namespace

int main(int argc, char** argv) {
  std::string out = "out/bench/effects.json";
  std::vector<Case> cases{white_furnace()};
  for (const char* name : {"cornell.gltf", "block_room.obj", "keldysh.gltf", "window.obj"})
    cases.push_back({name, load_scene(std::string(CLRAD_SCENES "/") + name), {}});
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "-o" && i + 1 < argc)
      out = argv[++i];
    else
      cases.push_back({argv[i], load_scene(argv[i]), {}});
  }
  Device device;
  fmt::print("{} with {} compute units\n", device.info().name, device.options().cores);
  fmt::print("{:<16} {:>17} {:>26} {:>15} {:>26}\n", "", "shoots", "seconds", "memory [MB]",
             "solve [s], warm");
  fmt::print("{:<16} {:>8} {:>8} {:>9} {:>9} {:>6} {:>7} {:>7} {:>9} {:>9} {:>6}\n", "scene", "plan",
             "actual", "plan", "actual", "ratio", "plan", "actual", "planned", "forced", "ratio");
  nlohmann::json rows = nlohmann::json::array();
  const bench::Others others;
  for (const Case& c : cases) rows.push_back(measure(device, c));
  fmt::print("other processes kept {:.2f} cores busy\n", others.cores());
  nlohmann::json report{{"device", device.info().name},
                        {"driver", device.info().driver},
                        {"cores", device.options().cores},
                        {"rows", rows}};
  write_file(out, report.dump(1) + "\n");
  return 0;
}
