// What exact visibility costs and buys: the Cornell box, the room with a block and an office, solved with 4, 16, 64 and 256 rays to
// each shooter and with shooters clipped, in turns, on the same mesh. Seconds of the stages that differ (rays, weights, clipping), per
// pair of receiver and shooter, and how far irradiance at the vertices is from that of clipping in double precision.
// bench_clip [-o FILE.json] [--quick]
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "boxes_scene.hpp"
#include "clrad/clrad.hpp"
#include "office.hpp"
#include "timing.hpp"

namespace {

using namespace clrad;

struct Case {
  std::string name;
  Scene scene;
  SolveOptions options;
};

std::vector<Case> cases(bool quick) {
  const auto add = [](std::string name, Scene scene, double patch, double element, double converge) {
    Case c{std::move(name), std::move(scene), {}};
    c.options.mesh = {patch, element}, c.options.converge = converge;
    c.options.light_samples = 0, c.options.error = c.options.near_field = false;
    return c;
  };
  std::vector<Case> all{
      add("Cornell box", load_scene(CLRAD_SCENES "/cornell.gltf"), 0.07, quick ? 0.035 : 0.01, 1e-2),
      add("room with a block", load_scene(CLRAD_SCENES "/block_room.obj"), 0.5, quick ? 0.25 : 0.0625, 1e-2)};
  if (!quick) all.push_back(add("office", bench::scene_of(make_scene::office(60), "office"), 1.5, 0.25, 0.6));
  return all;
}

struct Way {
  std::string name;
  std::uint32_t samples;  // 0: clipped
};

// Seconds of the stages that differ between ways.
double seconds_of(const Report& report) {
  double sum = 0;
  for (const StageProfile& s : report.stages)
    if (s.name == "find which rays are occluded" || s.name == "weigh form factors by what is visible" ||
        s.name == "clip shooters to what is visible")
      sum += s.seconds;
  return sum;
}

double rms(const Solution& a, const Solution& truth) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < truth.vertex_irradiance.size(); ++i)
    squares += std::pow(a.vertex_irradiance[i] - truth.vertex_irradiance[i], 2),
        all += truth.vertex_irradiance[i];
  const auto count = double(truth.vertex_irradiance.size());
  return std::sqrt(squares / count) / (all / count);
}

}  // namespace

int main(int argc, char** argv) {
  std::string out = "out/bench/clip.json";
  bool quick = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--quick") == 0)
      quick = true;
    else if (std::strcmp(argv[i], "-o") == 0 && i + 1 < argc)
      out = argv[++i];
    else {
      fmt::print(stderr, "usage: bench_clip [-o FILE.json] [--quick]\n");
      return 2;
    }
  }
  constexpr int rounds = 5;
  const std::vector<Way> ways{
      {"4 samples", 4}, {"16 samples", 16}, {"64 samples", 64}, {"256 samples", 256}, {"clipped", 0}};
  Device device, in_double({.precision = Precision::float64});
  fmt::print("{} with {} compute units; median of {} turns\n", device.info().name, device.options().cores,
             rounds);
  fmt::print("{:<18} {:>9} {:>9} {:>8} {:>12}  {:<12} {:>8} {:>8} {:>10}\n", "scene", "triangles", "vertices",
             "shoots", "pairs", "visibility", "seconds", "ns/pair", "RMS off");
  nlohmann::json rows = nlohmann::json::array();
  const bench::Others others;
  for (const Case& c : cases(quick)) {
    const auto with = [&](const Way& way) {
      SolveOptions o = c.options;
      o.visibility_exact = way.samples == 0;
      if (way.samples > 0) o.samples = way.samples;
      return o;
    };
    const Solution truth = solve(in_double, c.scene, with(ways.back()));
    std::vector<std::vector<double>> seconds(ways.size());
    std::vector<double> off(ways.size());
    std::vector<std::uint64_t> rays(ways.size());
    std::string account;
    std::uint64_t vertices = 0, shoots = 0;
    for (int round = -1; round < rounds; ++round)  // the first compiles, and is held against the truth
      for (std::size_t w = 0; w < ways.size(); ++w) {
        device.reset_profile();
        const Solution s = solve(device, c.scene, with(ways[w]));
        vertices = s.vertex_count(), shoots = s.report.shoots, rays[w] = s.report.rays;
        if (round < 0)
          off[w] = rms(s, truth);
        else
          seconds[w].push_back(seconds_of(s.report));
        for (const auto& [name, value] : s.report.options)
          if (name == "visibility_exact") account = value;
      }
    // Float is good to 5e-5 of a factor; what is left to samples in the office has their error in both.
    if (!(off.back() < 1e-3)) {
      fmt::print(stderr, "{}: clipping in float is {:.3g} off\n", c.name, off.back());
      return 1;
    }
    std::uint64_t triangles = 0;
    for (const Polygon& p : c.scene.polygons) triangles += p.corners - 2;
    // Each solve traces the same columns, with so many rays to a pair.
    const double pairs = double(rays[2] - rays[1]) / 48;
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const double s = bench::median(seconds[w]);
      fmt::print("{:<18} {:>9} {:>9} {:>8} {:>12.0f}  {:<12} {:>8.3f} {:>8.1f} {:>9.4f} %\n", c.name,
                 triangles, vertices, shoots, pairs, ways[w].name, s, 1e9 * s / pairs, 100 * off[w]);
      rows.push_back({{"scene", c.name},
                      {"triangles", triangles},
                      {"vertices", vertices},
                      {"shoots", shoots},
                      {"pairs", pairs},
                      {"visibility", ways[w].name},
                      {"seconds", bench::spread(seconds[w])},
                      {"ns_per_pair", 1e9 * s / pairs},
                      {"rms_relative", off[w]}});
    }
    fmt::print("  {}\n", account);
  }
  fmt::print("other processes kept {:.2f} cores busy\n", others.cores());
  write_file(out, nlohmann::json{{"device", device.info().name},
                                 {"driver", device.info().driver},
                                 {"cores", device.options().cores},
                                 {"rows", rows}}
                          .dump(1) +
                      "\n");
  return 0;
}
