#include <cstdio>

#include "curves.hpp"

namespace clrad::bench {
namespace {

std::vector<Step> steps_in(const Setting& s, std::size_t count, std::size_t most) {
  std::vector<Step> all;
  for (const std::uint32_t patch : shooters(s, count)) all.push_back(step_of(s, patch, n, most));
  return all;
}

}  // namespace

nlohmann::json units_curve(const CurveOptions& options) {
  nlohmann::json report;
  const unsigned most = std::min(2u, Device().info().compute_units);
  std::printf("\na visibility step on more compute units\n%10s %9s %9s %3s %-7s %5s %9s %11s %8s\n",
              "occluders", "patches", "vertices", "n", "engine", "units", "rays", "ms", "1 -> k");
  for (const int size : options.quick ? std::vector{903} : std::vector{903, 1386, 5761}) {
    const Setting s(size);
    struct Config {
      std::string engine;
      unsigned cores;
      std::unique_ptr<Device> device;
      std::unique_ptr<VisibilityEngine> tracer;
      std::unique_ptr<StepsOnDevice> steps;
      int runs = 0;  ///< that one measurement takes
    };
    std::vector<Config> configs;
    std::vector<std::function<void()>> what;
    std::vector<std::uint32_t> bits;
    for (const char* engine : {"serial", "chop"})
      for (unsigned cores = 1; cores <= most; ++cores) {
        Config c{engine, cores, std::make_unique<Device>(DeviceOptions{.cores = cores}), nullptr, nullptr, 0};
        if (c.engine == "chop")
          c.tracer = make_chop(*c.device, s.triangles, options.chop);
        else
          c.tracer = make_engine(engine, *c.device, s.triangles);
        c.steps = std::make_unique<StepsOnDevice>(*c.device, steps_in(s, 2, 1u << 20));
        check_bits(*c.steps, *c.tracer, bits);
        configs.push_back(std::move(c));
      }
    // Long enough for the times of other processes to count: ten times the clock of /proc/stat.
    for (auto& c : configs)
      what.emplace_back([&c] {
        const auto start = Clock::now();
        int runs = 0;
        do c.steps->run(*c.tracer);
        while (++runs < c.runs || (c.runs == 0 && since(start) < 0.1));
        c.runs = runs;
      });
    const auto rounds = alternate_quietly(what, options.quick ? 3 : 9, options.quick ? 3 : 60);
    const auto& seconds = rounds.seconds;
    for (std::size_t i = 0; i < configs.size(); ++i) {
      const Config& c = configs[i];
      const std::size_t one = i - (c.cores - 1);
      const double runs = c.runs, speedup = ratio(seconds[one], seconds[i]) * runs / configs[one].runs;
      report["rows"].push_back({{"occluder_polygons", s.scene.polygons.size()},
                                {"occluder_triangles", s.triangles.size()},
                                {"patches", s.mesh.patches.size()},
                                {"vertices", s.mesh.receivers.size()},
                                {"samples", n},
                                {"engine", c.engine},
                                {"cores", c.cores},
                                {"rays", c.steps->rays},
                                {"runs_in_a_measurement", c.runs},
                                {"s", spread(seconds[i])},
                                {"s_per_run", median(seconds[i]) / runs},
                                {"others_busy_cores", rounds.others},
                                {"speedup_over_one_unit", speedup},
                                {"same_bits", true}});
      std::printf("%10zu %9zu %9zu %3u %-7s %5u %9llu %11.3f %8.2f\n", s.scene.polygons.size(),
                  s.mesh.patches.size(), s.mesh.receivers.size(), n, c.engine.c_str(), c.cores,
                  static_cast<unsigned long long>(c.steps->rays), 1e3 * median(seconds[i]) / runs, speedup);
    }
    std::printf("%10zu: median of %zu rounds, other processes had at most %.2f cores in them\n",
                s.scene.polygons.size(), seconds[0].size(), rounds.others);
  }
  return report;
}

nlohmann::json waves_curve(const CurveOptions& options) {
  nlohmann::json report;
  Plot plot{
      "waves", "What the waves of chop trace: blocked rays drop out", "wave, from the origin on", "rays", {}};
  std::printf(
      "\nwaves of chop, 8 shooters; spared: blocked by an earlier wave\n%10s %9s %9s %3s %5s %10s %10s %8s "
      "%11s\n",
      "occluders", "patches", "vertices", "n", "wave", "rays", "blocked", "spared", "pieces");
  int color = 0;
  for (const int size : options.quick ? std::vector{5761} : std::vector{5761, 100000, 1000000}) {
    const Setting s(size);
    Device device;
    StepsOnDevice steps(device, steps_in(s, 8, 4096));
    auto waves = make_chop(device, s.triangles), single = make_chop(device, s.triangles, {.slab = 0});
    std::vector<std::uint32_t> bits;
    check_bits(steps, *single, bits);
    waves->count_waves();
    check_bits(steps, *waves, bits);
    const auto seconds = alternate({[&] { steps.run(*single); }}, 0);
    const auto with = waves->counts(), without = single->counts();
    // `single` ran twice: once to compare bits, once to warm up.
    const double saved = 1 - 2 * double(with.pieces) / double(without.pieces);
    const double saved_pairs = 1 - 2 * double(with.candidates) / double(without.candidates);
    Curve all{fmt::format("{} polygons: rays that long", size), points_style(color, 6), {}};
    Curve traced{fmt::format("{} polygons: traced", size), points_style(color, 7), {}};
    ++color;
    for (std::size_t w = 0; w < waves->waves().size(); ++w) {
      const WaveWork& work = waves->waves()[w];
      report["rows"].push_back({{"occluder_polygons", s.scene.polygons.size()},
                                {"occluder_triangles", s.triangles.size()},
                                {"patches", s.mesh.patches.size()},
                                {"vertices", s.mesh.receivers.size()},
                                {"samples", n},
                                {"wave", w + 1},
                                {"rays", work.rays},
                                {"rays_spared", work.blocked},
                                {"pieces", work.pieces}});
      std::printf("%10zu %9zu %9zu %3u %5zu %10llu %10llu %7.1f%% %11llu\n", s.scene.polygons.size(),
                  s.mesh.patches.size(), s.mesh.receivers.size(), n, w + 1,
                  static_cast<unsigned long long>(work.rays), static_cast<unsigned long long>(work.blocked),
                  100 * double(work.blocked) / double(std::max<std::uint64_t>(work.rays, 1)),
                  static_cast<unsigned long long>(work.pieces));
      if (work.rays) all.points.emplace_back(double(w + 1), double(work.rays));
      if (work.rays > work.blocked)
        traced.points.emplace_back(double(w + 1), double(work.rays - work.blocked));
    }
    report["saved"].push_back({{"occluder_polygons", s.scene.polygons.size()},
                               {"pieces_saved", saved},
                               {"ray_triangle_pairs_saved", saved_pairs}});
    std::printf("%10zu: waves save %.1f %% of the pieces and %.1f %% of the ray/triangle pairs of one wave\n",
                s.scene.polygons.size(), 100 * saved, 100 * saved_pairs);
    plot.curves.push_back(all);
    plot.curves.push_back(traced);
  }
  plot.extra = "unset logscale x\nset format x '%g'\nset mxtics 1\nset xtics 1\nset xrange [0.8:*]\n";
  plot.write(options.folder);
  return report;
}

}  // namespace clrad::bench
