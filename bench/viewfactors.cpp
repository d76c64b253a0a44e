// View factors of a generated closed room full of boxes: seconds, point factors a second, and how honest the error estimates
// are (row sums against 1, and pairs integrated the other way round).
// bench_viewfactors [-o FILE.json] [--polygons N]... [--target E]...
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "boxes_scene.hpp"
#include "clrad/output.hpp"
#include "clrad/view_factors.hpp"

int main(int argc, char** argv) {
  using namespace clrad;
  std::string out = "out/bench/viewfactors.json";
  std::vector<int> sizes;
  std::vector<double> targets;
  for (int i = 1; i < argc; ++i) {
    const auto is = [&](const char* name) { return std::strcmp(argv[i], name) == 0 && i + 1 < argc; };
    if (is("-o"))
      out = argv[++i];
    else if (is("--polygons"))
      sizes.push_back(std::atoi(argv[++i]));
    else if (is("--target"))
      targets.push_back(std::atof(argv[++i]));
    else
      return fmt::print(stderr, "unknown option {}\n", argv[i]), 2;
  }
  if (sizes.empty()) sizes = {60, 126, 252};
  if (targets.empty()) targets = {1e-2, 1e-4};
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  Device device({.precision = Precision::float64});
  view_factors(device, bench::boxes_scene(24), {.target_error = 1e-2});  // kernels
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{:>8} {:>8} {:>8} {:>8} {:>8} {:>10} {:>10} {:>12} {:>18}\n", "polygons", "target", "pairs",
             "hidden", "seconds", "points/s", "worst row", "rows beyond", "pairs beyond 1x 3x");
  for (const int size : sizes)
    for (const double target : targets) {
      const Scene scene = bench::boxes_scene(size);
      // Timed without the pairs that are integrated a second time.
      const ViewFactors timed =
          view_factors(device, scene, {.target_error = target, .reciprocity_sample = 0});
      const ViewFactors f = view_factors(device, scene, {.target_error = target, .reciprocity_sample = 500});
      std::size_t beyond = 0;
      for (std::uint32_t i = 0; i < f.rows(); ++i) beyond += std::abs(f.row_sum[i] - 1) > f.row_error[i];
      const double rate = double(timed.points) / timed.seconds;
      fmt::print("{:>8} {:>8.0e} {:>8} {:>8} {:>8.2f} {:>10.2e} {:>10.1e} {:>12} {:>10} {:>3} {:>3}\n",
                 scene.polygons.size(), target, timed.pairs, timed.hidden_pairs, timed.seconds, rate,
                 f.worst_row_defect, beyond, f.reciprocity.pairs, f.reciprocity.beyond,
                 f.reciprocity.far_beyond);
      rows.push_back({{"polygons", scene.polygons.size()},
                      {"target", target},
                      {"pairs", timed.pairs},
                      {"hidden_pairs", timed.hidden_pairs},
                      {"seconds", timed.seconds},
                      {"points_per_s", rate},
                      {"worst_row_defect", f.worst_row_defect},
                      {"rows_beyond_estimate", beyond},
                      {"reciprocity_pairs", f.reciprocity.pairs},
                      {"pairs_beyond_estimate", f.reciprocity.beyond},
                      {"pairs_beyond_3_estimates", f.reciprocity.far_beyond}});
    }
  write_file(out, nlohmann::json{{"device", device.info().name}, {"rows", rows}}.dump(1) + "\n");
  return 0;
}
