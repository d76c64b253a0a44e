// clrad's turns in `./run bench peers` (bench/peers/peers.py asks for them): solves that another program chooses, timed in a
// process that is warm.
// bench_peers: one JSON request a line on stdin, one JSON answer a line on stdout.
//   request {case, cores, seed, limit [s], settings {...}, sensors: [[x y z nx ny nz]] or places: [[polygon u v]], values: file}
//   answer  {seconds, stopped (by the limit), solve_s, patches, elements, rays}, or {trouble}
// values: doubles, [point][band], irradiance [W/m^2]: of a gather at sensors, of what is displayed at places.
#include <chrono>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "../tests/oracle/reference.hpp"
#include "clrad/clrad.hpp"
#include "tradeoff/places.hpp"

namespace {

using namespace clrad;
using nlohmann::json;

// The defaults of everything else, and the estimate without which there is no target.
void set_target(SolveOptions& o, double relative) {
  o.target_error = relative;
  o.error = true;
}

SolveOptions options_of(const json& settings, double extent) {
  SolveOptions o;
  o.error = settings.value("error", false);  // peers do not say what they are off by either
  for (const auto& [name, value] : settings.items()) {
    if (name == "patches")
      o.mesh.patch_edge_m = extent / value.get<double>();
    else if (name == "elements")
      o.mesh.element_edge_m = extent / value.get<double>();
    else if (name == "samples")
      o.samples = value;
    else if (name == "light samples")
      o.light_samples = value;
    else if (name == "sensor rays")
      o.sensor_rays = value;
    else if (name == "converge")
      o.converge = value;
    else if (name == "adaptive")
      o.adaptive.tolerance = value;
    else if (name == "levels")
      o.adaptive.max_level = value;
    else if (name == "target")
      set_target(o, value);
    else if (name != "error")
      throw UsageError("no setting " + name);
  }
  return o;
}

class Bench {
 public:
  json answer(const json& request) {
    const Scene& scene = scene_of(request.at("case"));
    SolveOptions options = options_of(request.at("settings"), oracle::extent_of(scene));
    options.seed = request.at("seed");
    std::vector<Place> places;
    for (const auto& p : request.value("places", json::array()))
      places.push_back({.polygon = p.at(0), .u = p.at(1), .v = p.at(2)});
    for (const auto& p : request.value("sensors", json::array()))
      options.sensors.push_back({{p.at(0), p.at(1), p.at(2)}, {p.at(3), p.at(4), p.at(5)}});
    Device& device = device_of(request.at("cores"));

    const auto start = std::chrono::steady_clock::now();
    const auto elapsed = [start] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    options.progress = [elapsed, limit = request.value("limit", 1e9)](const Progress&) {
      return elapsed() < limit;
    };
    const Solution s = solve(device, scene, options);
    std::vector<double> values = places.empty() ? std::vector<double>() : irradiance_at(s, places);
    for (const SensorResult& r : s.sensors)
      values.insert(values.end(), r.irradiance.begin(), r.irradiance.end());
    const double seconds = elapsed();

    std::ofstream out(request.at("values").get<std::string>(), std::ios::binary);
    out.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(double)));
    if (!out) throw Error("cannot write " + request.at("values").get<std::string>());
    return {{"seconds", seconds},
            {"stopped", s.stopped},
            {"solve_s", s.report.seconds.solve},
            {"patches", s.mesh.patches.size()},
            {"elements", s.mesh.elements.size()},
            {"rays", s.report.rays},
            {"device", device.info().name}};
  }

 private:
  json cases_ = oracle::reference("c_scenes_with_occlusion.json");
  std::map<std::string, Scene> scenes_;
  std::map<unsigned, Device> devices_;

  const Scene& scene_of(const std::string& id) {
    const auto found = scenes_.find(id);
    if (found != scenes_.end()) return found->second;
    return scenes_[id] = oracle::scene_of(oracle::reference_case(cases_, id).at("scene"));
  }
  Device& device_of(unsigned cores) {
    return devices_.try_emplace(cores, DeviceOptions{.cores = cores}).first->second;
  }
};

}  // namespace

int main() {
  Bench bench;
  for (std::string line; std::getline(std::cin, line);) {
    json answer;
    try {
      answer = bench.answer(json::parse(line));
    } catch (const std::exception& e) {
      answer = {{"trouble", e.what()}};
    }
    std::cout << answer.dump() << std::endl;
  }
  return 0;
}
