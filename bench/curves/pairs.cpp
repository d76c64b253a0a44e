#include <cstdio>

#include "curves.hpp"

namespace clrad::bench {
namespace {

/// Small triangles all over the frame. A ray meets as many of few big ones as of many small ones.
std::vector<OccluderTriangle> objects(std::uint32_t count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double size = 0.5 / std::sqrt(double(count));
  std::vector<OccluderTriangle> all(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 middle(0.9 * unit(random), 0.8 * unit(random), 0.9 * unit(random));
    for (auto& c : all[i].corner) c = middle + glm::dvec3(unit(random), unit(random), unit(random)) * size;
    all[i].plane = all[i].polygon = i;
  }
  return all;
}

/// Receivers on the floor, row by row; samples on a patch of the ceiling.
Step rays_between(std::uint64_t rays) {
  Step s;
  const auto count = std::max<std::uint64_t>(1, rays / n),
             side = std::uint64_t(std::ceil(std::sqrt(double(count))));
  for (std::uint64_t i = 0; i < count; ++i)
    s.receivers.push_back({{-0.95 + 1.9 * double(i % side) / double(side), -0.95,
                            -0.95 + 1.9 * double(i / side) / double(side)},
                           {0, 1, 0}});
  for (std::uint32_t k = 0; k < n; ++k)
    s.samples.push_back({{-0.12 + 0.08 * (k % 4), 0.95, -0.12 + 0.08 * (k / 4)}, {0, -1, 0}});
  return s;
}

struct PairRow {
  std::string engine;
  std::uint64_t rays, objects;
  double seconds, pairs;
};

}  // namespace

nlohmann::json pairs_curve(const CurveOptions& options) {
  const double most_pairs = options.quick ? 1e7 : 1e9;
  constexpr std::uint64_t most_rays = 10'000'000;
  std::vector<PairRow> rows;
  nlohmann::json report;
  Device device;
  std::printf(
      "\na visibility step, %u samples; chop in one voxel tests every pair\n%-7s %9s %9s %3s %9s %9s %11s "
      "%10s\n",
      n, "engine", "occluders", "receivers", "n", "rays", "pairs", "ms", "ns/pair");
  for (std::uint32_t count = 100; count <= 1'000'000; count *= 10) {
    const auto triangles = objects(count);
    auto chop = make_chop(device, triangles, {.cells = {1, 1, 1}});
    auto serial = make_engine("serial", device, triangles);
    for (double pairs = 1e4; pairs <= most_pairs * 1.01; pairs *= 10) {
      const double wanted = pairs / count;
      if (wanted < n || wanted > double(most_rays)) continue;
      const Step step = rays_between(std::uint64_t(wanted));
      StepsOnDevice steps(device, {step});
      std::vector<std::uint32_t> bits;
      check_bits(steps, *chop, bits);
      check_bits(steps, *serial, bits);
      // Short ones in bigger bundles of runs: a median of many.
      const int rounds = pairs < 1e7 ? 41 : 9;
      const auto seconds = alternate({[&] { steps.run(*chop); }, [&] { steps.run(*serial); }}, rounds);
      for (int e = 0; e < 2; ++e) {
        const auto& mine = seconds[std::size_t(e)];
        const PairRow row{e ? "serial" : "chop", steps.rays, count, median(mine), double(steps.rays) * count};
        rows.push_back(row);
        report["rows"].push_back({{"engine", row.engine},
                                  {"occluder_polygons", count},
                                  {"occluder_triangles", count},
                                  {"patches", 1},
                                  {"vertices", step.receivers.size()},
                                  {"samples", n},
                                  {"rays", row.rays},
                                  {"pairs", row.pairs},
                                  {"s", spread(mine)},
                                  {"ns_per_pair", 1e9 * row.seconds / row.pairs},
                                  {"same_bits", true}});
        std::printf("%-7s %9u %9zu %3u %9llu %9.2g %11.4f %10.4f\n", row.engine.c_str(), count,
                    step.receivers.size(), n, static_cast<unsigned long long>(row.rays), row.pairs,
                    1e3 * row.seconds, 1e9 * row.seconds / row.pairs);
      }
    }
  }
  Plot cost{
      "pairs_cost", "Time per ray/object pair, 16 samples", "ray/object pairs", "time per pair [ns]", {}};
  cost.extra = "set yrange [0.1:20]\nset format y '%g'\n";
  Plot plot{
      "pairs", "A visibility step costs what its ray/object pairs cost", "ray/object pairs", "time [ms]", {}};
  for (const char* engine : {"chop", "serial"}) {
    // c: the middle of t / pairs above 1e6 pairs. t0: the most that a step of the fewest pairs takes beyond that.
    std::vector<double> each;
    double t0 = 0;
    for (const PairRow& r : rows)
      if (r.engine == engine && r.pairs > 0.99e6) each.push_back(r.seconds / r.pairs);
    const double c = median(each);
    for (const PairRow& r : rows)
      if (r.engine == engine && r.pairs < 2e4) t0 = std::max(t0, r.seconds - c * r.pairs);
    std::vector<double> beyond, at_1e6;
    for (const PairRow& r : rows)
      if (r.engine == engine && r.pairs > 0.9e6)
        (r.pairs > 1.1e6 ? beyond : at_1e6).push_back(std::max(r.seconds - t0, 0.0) / r.pairs);
    if (beyond.empty() || at_1e6.empty()) continue;
    const double least = quantile(beyond, 0), most = quantile(beyond, 1);
    report["fit"][engine] = {{"t0_s", t0},
                             {"c_s_per_pair", c},
                             {"c_least", least},
                             {"c_most", most},
                             {"most_over_least", most / least},
                             {"most_at_1e6", quantile(at_1e6, 1)}};
    std::printf(
        "%-7s t0 %.3f ms, c %.3f ns a pair; above 1e6 pairs, less t0, from %.3f to %.3f (%.2fx), at 1e6 at "
        "most %.3f\n",
        engine, 1e3 * t0, 1e9 * c, 1e9 * least, 1e9 * most, most / least, 1e9 * quantile(at_1e6, 1));
    const bool serial = std::string(engine) == "serial";
    int shape = 0;
    constexpr int shapes[] = {7, 5, 9, 13, 11};
    for (std::uint64_t count = 100; count <= 1'000'000; count *= 10, ++shape) {
      Curve curve{fmt::format("{}, {} objects", engine, count),
                  points_style(serial ? 1 : 0, shapes[shape] - (serial ? 1 : 0)),
                  {}};
      for (const PairRow& r : rows)
        if (r.engine == engine && r.objects == count) curve.points.emplace_back(r.pairs, 1e3 * r.seconds);
      if (curve.points.empty()) continue;
      plot.curves.push_back(curve);
      for (auto& [pairs, ms] : curve.points) ms *= 1e6 / pairs;
      cost.curves.push_back(curve);
    }
    Curve line{
        fmt::format("{:.2f} ms + {:.2f} ns a pair", 1e3 * t0, 1e9 * c), line_style(serial ? 1 : 0), {}};
    for (double p = 1e4; p <= most_pairs; p *= 2) line.points.emplace_back(p, 1e3 * (t0 + c * p));
    plot.curves.push_back(line);
  }
  plot.extra = "set xrange [5e3:2e9]\n";
  plot.write(options.folder);
  cost.extra += plot.extra;
  cost.write(options.folder);
  return report;
}

}  // namespace clrad::bench
