/// Table 1.1 of Drucker & Schroeder, measured again: seconds a shoot and patches/s/shoot in generated closed scenes of the
/// paper's sizes, `serial` and `chop`, on 1 and 2 compute units, beside the paper's rows. One polygon is one patch, so
/// patches and occluder polygons are the same number. The four solves of a scene run side by side and take turns
/// of nine shoots, all shooting the same patches; the bits of the engines are compared first, those of the solves at the end.
/// Usage: bench_table [-o FILE] [--quick] [--samples N] [--turns N]
#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include "boxes_scene.hpp"
#include "clrad/clrad.hpp"
#include "timing.hpp"
#include "turns.hpp"

namespace {

using namespace clrad;
using namespace clrad::bench;

struct PaperRow {
  const char* machine;
  int patches;
  double seconds, patches_per_s;
};
constexpr PaperRow paper[] = {{"Wallace (HP835)", 903, 34, 26},
                              {"Recker (6-10 HP835/325s)", 1386, 5.4, 282},
                              {"SIMD (8K CM2)", 5761, 3.4, 1694},
                              {"SIMD (16K CM2)", 5761, 1.7, 3388},
                              {"SIMD (32K CM2)", 5761, 0.9, 6401}};

struct Config {
  std::string engine;
  unsigned cores;
  std::unique_ptr<Device> device;
  std::vector<double> seconds;  ///< a shoot takes, of each turn
  Solution solution;
};

/// The engines' masks of a few visibility steps, on all compute units of any config; throws when two differ.
void compare_bits(const Setting& s, std::vector<Config>& configs, std::uint32_t n) {
  for (const std::uint32_t patch : shooters(s, 3)) {
    const Step step = step_of(s, patch, n, 512);
    std::vector<std::uint32_t> expected;
    for (auto& c : configs) {
      const PointArray origins(*c.device, step.receivers, "receivers"),
          targets(*c.device, step.samples, "samples");
      const Segments segments{&origins, nullptr, std::uint32_t(step.receivers.size()), &targets, n};
      Array<std::uint32_t> masks(*c.device,
                                 std::uint64_t(segments.origin_count) * segments.words_per_origin(), "masks");
      make_engine(c.engine, *c.device, s.triangles)->occluded(segments, masks);
      const auto bits = masks.download();
      if (expected.empty()) expected = bits;
      if (bits != expected)
        throw DeviceError(fmt::format("{} on {} units gives other bits", c.engine, c.cores));
    }
  }
}

/// Shoots of a turn: they differ, and what a wait for the other solves costs the first of them is shared.
constexpr std::uint64_t in_turn = 9;

/// `turns` turns of each config.
void shoot_in_turns(const Scene& scene, std::vector<Config>& configs, std::uint32_t n, std::uint64_t turns) {
  std::vector<std::function<void(const std::function<void()>&)>> tasks;
  for (auto& c : configs)
    tasks.emplace_back([&, n, turns](const std::function<void()>& end_turn) {
      SolveOptions options;
      options.mesh = {whole_polygons_m, whole_polygons_m};
      options.engine = c.engine;
      options.samples = n;
      options.light_samples = 0;
      options.near_field = false;
      options.converge = 1e-9;
      auto start = Clock::now();
      std::uint64_t before = 0;
      options.progress = [&](const Progress& p) {
        // The first shoot makes what the others keep.
        if (p.shoots % in_turn != 1 || p.shoots == before) return true;
        if (std::exchange(before, p.shoots) > 0) c.seconds.push_back(since(start) / double(in_turn));
        if (c.seconds.size() == turns) return false;
        end_turn();
        start = Clock::now();
        return true;
      };
      c.solution = solve(*c.device, scene, options);
    });
  Turns::run(tasks);
  for (const auto& c : configs) {
    if (c.seconds.size() != turns) throw DeviceError("a solve converged before all turns were timed");
    if (c.solution.vertex_irradiance != configs[0].solution.vertex_irradiance)
      throw DeviceError(fmt::format("the solve with {} on {} units gives other bits", c.engine, c.cores));
  }
}

}  // namespace

int main(int argc, char** argv) try {
  std::string out = "out/bench/table.json";
  std::uint32_t n = 16;
  std::uint64_t turns = 9;
  std::vector<int> sizes = {903, 1386, 5761};
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--quick")
      sizes = {903}, turns = 3;
    else if (a == "-o" && i + 1 < argc)
      out = argv[++i];
    else if (a == "--samples" && i + 1 < argc)
      n = std::uint32_t(std::atoi(argv[++i]));
    else if (a == "--turns" && i + 1 < argc)
      turns = std::uint64_t(std::atoi(argv[++i]));
    else
      return std::fprintf(stderr, "unknown option %s\n", a.c_str()), 2;
  }

  nlohmann::json report;
  report["benchmark"] = "table";
  report["load_before"] = load();
  const Others others;
  std::printf("%-12s %-26s %5s %9s %8s %9s %3s %11s %15s %12s %8s\n", "scene", "engine or machine", "units",
              "occluders", "patches", "vertices", "n", "s/shoot", "quarters", "patches/s", "1 -> k");
  for (const int size : sizes) {
    const Setting setting(size);
    std::vector<Config> configs;
    const unsigned most = std::min(2u, Device().info().compute_units);
    for (unsigned cores = 1; cores <= most; ++cores)
      for (const char* engine : {"serial", "chop"})
        configs.push_back({engine, cores, std::make_unique<Device>(DeviceOptions{.cores = cores}), {}, {}});
    report["device"] = configs[0].device->info().name;
    report["driver"] = configs[0].device->info().driver;
    compare_bits(setting, configs, n);
    shoot_in_turns(setting.scene, configs, n, turns);

    for (const auto& row : paper)
      if (row.patches == size)
        std::printf("%-12s %-26s %5s %9s %8d %9s %3s %11.3f %15s %12.0f\n", "the paper's", row.machine, "",
                    "", row.patches, "", "", row.seconds, "", row.patches_per_s);
    const auto of = [&](const std::string& engine, unsigned cores) -> const Config& {
      return *std::find_if(configs.begin(), configs.end(),
                           [&](const Config& c) { return c.engine == engine && c.cores == cores; });
    };
    for (const char* engine : {"serial", "chop"})
      for (unsigned cores = 1; cores <= most; ++cores) {
        const Config& c = of(engine, cores);
        const double seconds = median(c.seconds), speedup = ratio(of(engine, 1).seconds, c.seconds);
        report["rows"].push_back(
            {{"scene", setting.scene.file},
             {"patches", size},
             {"occluder_polygons", setting.scene.polygons.size()},
             {"occluder_triangles", setting.triangles.size()},
             {"vertices", c.solution.vertex_count()},
             {"engine", engine},
             {"cores", cores},
             {"samples", n},
             {"rays_per_shoot", double(c.solution.report.rays) / double(c.solution.report.shoots)},
             {"shoots_in_a_turn", in_turn},
             {"seconds_per_shoot", seconds},
             {"patches_per_s_per_shoot", size / seconds},
             {"spread_s", spread(c.seconds)},
             {"speedup_over_one_unit", speedup},
             {"speedup_over_serial", ratio(of("serial", cores).seconds, c.seconds)},
             {"same_bits", true}});
        std::printf("%-12s %-26s %5u %9zu %8d %9u %3u %11.5f %7.4f %7.4f %12.0f %8.2f\n",
                    setting.scene.file.c_str(), engine, cores, setting.scene.polygons.size(), size,
                    c.solution.vertex_count(), n, seconds, quantile(c.seconds, 0.25),
                    quantile(c.seconds, 0.75), size / seconds, speedup);
      }
    std::printf("%-12s chop against serial: %.2fx on 1 unit, %.2fx on %u\n", setting.scene.file.c_str(),
                ratio(of("serial", 1).seconds, of("chop", 1).seconds),
                ratio(of("serial", most).seconds, of("chop", most).seconds), most);
  }
  for (const auto& row : paper)
    report["paper"].push_back({{"machine", row.machine},
                               {"patches", row.patches},
                               {"seconds_per_shoot", row.seconds},
                               {"patches_per_s_per_shoot", row.patches_per_s}});
  report["load_after"] = load();
  report["others_busy_cores"] = others.cores();
  std::ofstream(out) << report.dump(2) << '\n';
  std::printf("load average of the machine %.1f before, %.1f after; wrote %s\n",
              double(report["load_before"]), double(report["load_after"]), out.c_str());
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "bench_table: %s\n", e.what());
  return 1;
}
