// How good the estimate of its own error is that each solve gives: estimated against true RMS error of irradiance, over the
// reference rooms and settings from coarse to fine; of the displayed irradiance all over the surfaces, and at the reference's
// points. Truth all over is a careful gather of a finer solution, at the points the reference.
// bench_budget [-o FILE.json] [--quick] [--seed N] [part of a room's name]: N is that of the solves and of their estimates
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "../tests/oracle/reference.hpp"
#include "clrad/clrad.hpp"
#include "tradeoff/places.hpp"

namespace {

using namespace clrad;

std::vector<double> at_sensors(const Solution& s) {
  std::vector<double> h;
  for (const SensorResult& r : s.sensors) h.insert(h.end(), r.irradiance.begin(), r.irradiance.end());
  return h;
}

struct Setting {
  std::string name;
  SolveOptions options;
};

std::vector<Setting> settings_for(double extent) {
  std::vector<Setting> all;
  const auto add = [&](const std::string& name, double patches, double elements, auto change) {
    SolveOptions o;
    o.mesh.patch_edge_m = extent / patches, o.mesh.element_edge_m = extent / elements;
    o.sensor_rays = 2048;
    change(o);
    all.push_back({name, o});
  };
  const auto plain = [](SolveOptions&) {};
  for (const auto& [p, e] :
       {std::pair{2, 4}, {2, 16}, {4, 8}, {4, 16}, {4, 32}, {8, 16}, {8, 32}, {8, 64}, {16, 16}, {16, 32}})
    add(fmt::format("{}/{}", p, e), p, e, plain);
  add("1 sample", 4, 32, [](SolveOptions& o) { o.samples = 1, o.light_samples = 16; });
  add("16 samples", 4, 32, [](SolveOptions& o) { o.samples = 16, o.light_samples = 1024; });
  add("converge 1e-1", 4, 32, [](SolveOptions& o) { o.converge = 0.1; });
  add("converge 1e-2", 4, 32, [](SolveOptions& o) { o.converge = 0.01; });
  add("disk", 4, 32, [](SolveOptions& o) { o.estimator = Estimator::disk; });
  add("subdisk", 4, 32, [](SolveOptions& o) { o.estimator = Estimator::subdisk; });
  add("adaptive 0.05", 4, 8, [](SolveOptions& o) { o.adaptive.tolerance = 0.05; });
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  std::string out = "out/bench/budget.json", only;
  bool quick = false;
  std::uint64_t seed = SolveOptions().seed;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--quick") == 0)
      quick = true;
    else if (std::strcmp(argv[i], "--seed") == 0 && i + 1 < argc)
      seed = std::stoull(argv[++i]);
    else if (std::strcmp(argv[i], "-o") == 0 && i + 1 < argc)
      out = argv[++i];
    else
      only = argv[i];
  }
  Device device;
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{:<15} {:<14} {:>8} {:>8} {:>6}   {:>8} {:>8} {:>6}   {:>8} {:>6}\n", "scene", "setting",
             "RMS est.", "true", "ratio", "sensors", "true", "ratio", "solve s", "share");
  double estimated = 0;  // seconds of all solves so far: a device's profile goes on
  std::size_t within[2] = {0, 0}, below[2] = {0, 0}, count[2] = {0, 0};
  for (const char* file : {"c_boxes.json", "c_scenes_with_occlusion.json"}) {
    const auto data = oracle::reference(file);
    for (const auto& reference : data.at("cases")) {
      const std::string id = reference.at("id");
      if (!only.empty() && id.find(only) == std::string::npos) continue;
      if (quick && id != "C-block-room-1" && id != "C-daylit-1") continue;
      const Scene scene = oracle::scene_of(reference.at("scene"));
      const double extent = oracle::extent_of(scene);
      SolveOptions fine;
      fine.mesh.patch_edge_m = extent / 16, fine.mesh.element_edge_m = extent / 64;
      fine.converge = 1e-5, fine.samples = 16, fine.light_samples = 1024, fine.error = false;
      SolveOptions unchecked;  // its estimate would count as the first setting's
      unchecked.error = false;
      const std::vector<Place> places = varying_places(solve(device, scene, unchecked), 3000, 7);
      for (const Place& p : places) fine.sensors.push_back(p.sensor);
      fine.sensor_rays = 2048;
      const std::vector<double> truth = at_sensors(solve(device, scene, fine));
      const std::size_t bands = scene.bands.size();
      std::vector<double> weight;
      for (std::size_t k = 0; k < places.size(); ++k)  // no light at all: something stands there
        weight.push_back(truth[k * bands] > 0 ? places[k].weight_m2 : 0);
      std::vector<double> at_points;
      std::vector<Sensor> sensors;
      for (const auto& p : reference.at("points")) {
        sensors.push_back({oracle::vec(p.at("point")), oracle::vec(p.at("normal"))});
        const auto h = p.at("H").get<std::vector<double>>();
        at_points.insert(at_points.end(), h.begin(), h.end());
      }
      for (Setting setting : settings_for(extent)) {
        setting.options.sensors = sensors, setting.options.seed = seed;
        const Solution s = solve(device, scene, setting.options);
        double estimating = -estimated;
        for (const StageProfile& stage : s.report.stages)
          if (stage.name == "estimate the error") estimating += stage.seconds;
        estimated += estimating;
        const double estimate[2] = {s.report.error.total_relative, s.report.error.sensors_relative};
        const double error[2] = {rms_relative(irradiance_at(s, places), truth, weight, s.bands),
                                 rms_relative(at_sensors(s), at_points, {}, s.bands)};
        double ratio[2];
        for (int k = 0; k < 2; ++k) {
          ratio[k] = estimate[k] / error[k];
          ++count[k], within[k] += ratio[k] >= 0.5 && ratio[k] <= 3, below[k] += ratio[k] < 1.0 / 3;
        }
        fmt::print(
            "{:<15} {:<14} {:>6.2f} % {:>6.2f} % {:>6.2f}   {:>6.2f} % {:>6.2f} % {:>6.2f}   {:>8.2f} "
            "{:>4.0f} %\n",
            id, setting.name, 100 * estimate[0], 100 * error[0], ratio[0], 100 * estimate[1], 100 * error[1],
            ratio[1], s.report.seconds.solve, 100 * estimating / s.report.seconds.solve);
        nlohmann::json parts;
        for (const ErrorPart& part : s.report.error.parts) parts[part.name] = part.relative;
        rows.push_back({{"scene", id},
                        {"setting", setting.name},
                        {"estimate", estimate[0]},
                        {"rms_relative", error[0]},
                        {"sensors_estimate", estimate[1]},
                        {"sensors_rms_relative", error[1]},
                        {"solve_s", s.report.seconds.solve},
                        {"estimating_s", estimating},
                        {"parts", parts}});
      }
    }
  }
  for (int k = 0; k < 2; ++k)
    fmt::print("{}: {} of {} between 1/2 and 3 times the true RMS error, {} below a third\n",
               k == 0 ? "all over" : "at points", within[k], count[k], below[k]);
  write_file(out,
             nlohmann::json{{"device", device.info().name}, {"seed", seed}, {"rows", rows}}.dump(1) + "\n");
  return 0;
}
