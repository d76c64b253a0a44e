// What accuracy costs: error at the reference's points against seconds, for three patch sizes.
// bench_accuracy [-o FILE.json]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "../tests/oracle/reference.hpp"
#include "clrad/clrad.hpp"

namespace {

using namespace clrad;

nlohmann::json measure(Device& device, const nlohmann::json& reference, double extents_in_patch,
                       const std::string& engine) {
  const Scene scene = oracle::scene_of(reference.at("scene"));
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  SolveOptions options;
  options.engine = engine;
  options.mesh.patch_edge_m = extent / extents_in_patch;
  for (const auto& p : reference.at("points"))
    options.sensors.push_back({oracle::vec(p.at("point")), oracle::vec(p.at("normal"))});
  const Solution s = solve(device, scene, options);
  double squares = 0, mean = 0, worst = 0;
  for (std::size_t i = 0; i < s.sensors.size(); ++i)
    for (std::uint32_t b = 0; b < 3; ++b) {
      const double h = reference.at("points").at(i).at("H").at(b), error = s.sensors[i].irradiance[b] - h;
      squares += error * error;
      mean += h;
      worst = std::max(worst, std::abs(error) / h);
    }
  const double n = 3.0 * double(s.sensors.size());
  return {{"scene", reference.at("id")},
          {"engine", engine},
          {"extent_per_patch_edge", extents_in_patch},
          {"patches", s.mesh.patches.size()},
          {"vertices", s.vertex_count()},
          {"rays", s.report.rays},
          {"rms_relative", std::sqrt(squares / n) / (mean / n)},
          {"worst_relative", worst},
          {"solve_s", s.report.seconds.solve}};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string out = argc == 3 && std::strcmp(argv[1], "-o") == 0 ? argv[2] : "out/bench/accuracy.json";
  Device device;
  const auto data = oracle::reference("c_scenes_with_occlusion.json");
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{} with {} compute units\n", device.info().name, device.options().cores);
  fmt::print("{:<16} {:<7} {:>12} {:>8} {:>9} {:>11} {:>8} {:>8} {:>8}\n", "scene", "engine", "patch edge",
             "patches", "vertices", "rays", "rms", "worst", "seconds");
  for (const char* id : {"C-cornell-1", "C-block-room-1"}) {
    const auto& reference = oracle::reference_case(data, id);
    measure(device, reference, 2, "serial");  // builds the kernels
    measure(device, reference, 2, "chop");
    for (const char* engine : {"serial", "chop"})
      for (const double patches : {4.0, 8.0, 16.0}) {
        rows.push_back(measure(device, reference, patches, engine));
        const auto& r = rows.back();
        fmt::print("{:<16} {:<7} {:>12} {:>8} {:>9} {:>11} {:>6.2f} % {:>6.2f} % {:>8.2f}\n", id, engine,
                   fmt::format("extent/{:.0f}", patches), r["patches"].get<int>(), r["vertices"].get<int>(),
                   r["rays"].get<std::uint64_t>(), 100 * r["rms_relative"].get<double>(),
                   100 * r["worst_relative"].get<double>(), r["solve_s"].get<double>());
      }
  }
  nlohmann::json report{{"device", device.info().name},
                        {"driver", device.info().driver},
                        {"cores", device.options().cores},
                        {"rows", rows}};
  write_file(out, report.dump(1) + "\n");
  return 0;
}
