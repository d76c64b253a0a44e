#include <cstdio>

#include "curves.hpp"

namespace clrad::bench {
namespace {

constexpr int polygons = 903;

/// Seconds of each of `shoots` shoots, the first one left out, and what was shot.
Solution shoot(Device& device, const Scene& scene, double edge_m, std::uint64_t shoots,
               std::vector<double>& seconds) {
  SolveOptions options;
  options.mesh = {edge_m, edge_m};
  options.engine = "chop";
  options.samples = n;
  options.light_samples = 0;
  options.near_field = false;
  options.converge = 1e-9;
  auto start = Clock::now();
  std::uint64_t before = 0;
  options.progress = [&](const Progress& p) {
    if (p.shoots > before && before > 0) seconds.push_back(since(start));
    before = p.shoots;
    start = Clock::now();
    return p.shoots <= shoots;
  };
  return solve(device, scene, options);
}

}  // namespace

nlohmann::json patches_curve(const CurveOptions& options) {
  nlohmann::json report;
  const Scene scene = boxes_scene(polygons);
  Device device;
  std::vector<std::pair<double, double>> points;
  std::printf("\nseconds a shoot against patches, chop\n%10s %9s %9s %3s %11s %11s %15s %12s\n", "occluders",
              "patches", "vertices", "n", "rays/shoot", "s/shoot", "quarters", "patches/s");
  // Edges that give about 1e3, 3e3, ... patches; an element a patch.
  const std::vector<double> edges =
      options.quick ? std::vector{2.0, 0.5} : std::vector{2.5, 0.75, 0.4, 0.2, 0.115, 0.062, 0.036};
  for (const double edge : edges) {
    std::vector<double> seconds;
    const Solution s = shoot(device, scene, edge, options.quick ? 5 : 9, seconds);
    const double middle = median(seconds);
    const auto patches = s.mesh.patches.size();
    report["rows"].push_back({{"scene", scene.file},
                              {"occluder_polygons", scene.polygons.size()},
                              {"patches", patches},
                              {"vertices", s.vertex_count()},
                              {"samples", n},
                              {"engine", "chop"},
                              {"cores", device.options().cores},
                              {"rays_per_shoot", double(s.report.rays) / double(s.report.shoots)},
                              {"seconds_per_shoot", middle},
                              {"patches_per_s_per_shoot", double(patches) / middle},
                              {"spread_s", spread(seconds)}});
    points.emplace_back(double(patches), middle);
    std::printf("%10zu %9zu %9u %3u %11.0f %11.4f %7.4f %7.4f %12.0f\n", scene.polygons.size(), patches,
                s.vertex_count(), n, double(s.report.rays) / double(s.report.shoots), middle,
                quantile(seconds, 0.25), quantile(seconds, 0.75), double(patches) / middle);
  }
  Plot plot{"patches",
            "A shoot against patches, 903 occluder polygons, 16 samples",
            "patches",
            "time per shoot [s]",
            {}};
  plot.curves.push_back({"chop", points_style(0, 7), points});
  Curve line{"proportional", line_style(5), {}};
  const auto& last = points.back();
  for (const auto& p : points) line.points.emplace_back(p.first, last.second * p.first / last.first);
  plot.curves.push_back(line);
  plot.curves.push_back(
      {"the paper, 8K to 32K CM2", points_style(1, 9, false), {{5761, 3.4}, {5761, 1.7}, {5761, 0.9}}});
  plot.write(options.folder);
  return report;
}

}  // namespace clrad::bench
