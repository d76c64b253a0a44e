/// Visibility tests a second of the engines and of Embree, on the same segments with the same threads, each in turn: the
/// Cornell box, an office, a hall of columns, and scenes of your own. Prints a table, writes rows as JSON.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <bit>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "boxes_scene.hpp"
#include "clrad/clrad.hpp"
#include "hall.hpp"
#include "office.hpp"
#include "solve/order.hpp"
#include "timing.hpp"
#include "visibility/chop.hpp"
#include "visibility/embree.hpp"
#include "visibility/shaft.hpp"

namespace {

using namespace clrad;
using namespace clrad::bench;

struct Options {
  bool quick = false, profile = false, alone = false, trees = false;
  std::size_t receivers = 20000;
  std::uint32_t elements = 128, shooters = 4, rounds = 9;
  std::string only, out = "out/bench/visibility.json";
  std::vector<std::string> engines{"shaft", "chop", "serial"}, files;
  std::vector<std::uint32_t> samples{4, 16, 64};
  DeviceOptions device;
  ShaftOptions shaft;
};

/// Patches that shoot: one that emits, and others by area.
std::vector<std::uint32_t> patches_that_shoot(const Setting& s, std::size_t count) {
  std::vector<std::uint32_t> chosen;
  std::vector<double> area;
  for (std::uint32_t p = 0; p < s.mesh.patches.size(); ++p) {
    const Patch& patch = s.mesh.patches[p];
    area.push_back(patch.area_m2);
    if (chosen.empty() && s.scene.materials[s.scene.polygons[patch.polygon].material].emitted_exitance[0] > 0)
      chosen.push_back(p);
  }
  std::mt19937 random(7);
  std::discrete_distribution<std::uint32_t> pick(area.begin(), area.end());
  while (chosen.size() < count) chosen.push_back(pick(random));
  return chosen;
}

/// One shooter's segments, on the host for Embree and on the device.
struct Work {
  Step step;
  PointArray origins, targets;
  Array<std::uint32_t> masks;
  std::vector<std::uint32_t> embree;

  Work(Device& device, Step from)
      : step(std::move(from)),
        origins(device, step.receivers, "receivers"),
        targets(device, step.samples, "samples"),
        masks(device, words(), "masks"),
        embree(words()) {}
  std::uint64_t words() const { return step.receivers.size() * ((step.samples.size() + 31) / 32); }
  Segments segments() const {
    return {&origins, nullptr, std::uint32_t(step.receivers.size()), &targets,
            std::uint32_t(step.samples.size())};
  }
};

std::uint64_t differing(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::uint64_t(__builtin_popcount(a[i] ^ b[i]));
  return count;
}

struct Peer {
  const EmbreeScene* scene;
  EmbreeWay way;
  bool robust;
};

/// Float operations of one lane (products, sums, comparisons, least and greatest), counted in the kernels' text: of a node, the hull's
/// six sides and six slants against eight children; of a child's box, that a packet's lanes cross it; of a triangle, what comes
/// before single samples are asked, and what one sample and the triangle alone take is left out.
constexpr double ops_of_node = 8 * (6 + 6 * 4), ops_of_box = 25, ops_of_shaft_triangle = 105,
                 ops_of_packet_triangle = 36;

double operations(const ShaftWork& w, unsigned width) {
  return ops_of_node * double(w.nodes) +
         width * (ops_of_box * double(w.boxes) + ops_of_shaft_triangle * double(w.shaft_triangles) +
                  ops_of_packet_triangle * double(w.packet_triangles));
}

/// Products and sums in registers a second, the best of a few tries [1e9].
double peak_gops(Device& device) {
  constexpr std::uint32_t items = 4096, rounds = 4000, chains = 12;
  Array<float> sums(device, items, "sums");
  double best = 0;
  for (int k = 0; k < 5; ++k) {
    const auto start = Clock::now();
    device.run_local("device/peak.cl", "peak", items, device.info().gpu ? 0 : 1, items, rounds, 0.999f,
                     0.001f, sums);
    device.finish();
    if (k > 0)
      best =
          std::max(best, 1e-9 * items * 2.0 * rounds * chains * device.options().packet_width / since(start));
  }
  return best;
}

/// Embree's segments stay this far clear of their ends.
constexpr float offset = 1e-4f;

/// What the exact predicate says, asked of every triangle, where Embree's bits differ from ours.
struct Verdict {
  std::uint64_t differing = 0, ours_right = 0;
  /// Of those: what shorter segments that ignore no plane, as Embree's are, say as well. The others are its rounding.
  std::uint64_t by_its_segments = 0;
};

Verdict judge(Device& device, VisibilityEngine& serial, const std::vector<Work>& work,
              const std::vector<std::vector<std::uint32_t>>& ours) {
  std::vector<Point> from, to, short_from, short_to;
  std::vector<bool> blocked;
  for (std::size_t i = 0; i < work.size(); ++i) {
    const Step& step = work[i].step;
    const std::size_t words = (step.samples.size() + 31) / 32;
    for (std::size_t at = 0; at < ours[i].size(); ++at)
      for (std::uint32_t bits = ours[i][at] ^ work[i].embree[at]; bits; bits &= bits - 1) {
        const auto k = std::uint32_t(std::countr_zero(bits));
        const Point &a = step.receivers[at / words], &b = step.samples[at % words * 32 + k];
        from.push_back(a), to.push_back(b);
        blocked.push_back(ours[i][at] >> k & 1);
        const glm::dvec3 way = b.position - a.position;
        short_from.push_back({a.position + double(offset) * way, a.normal});
        short_to.push_back({b.position - double(offset) * way, b.normal});
      }
  }
  Verdict v;
  v.differing = from.size();
  if (from.empty()) return v;
  const auto ask = [&](const std::vector<Point>& a, const std::vector<Point>& b) {
    const PointArray origins(device, a, "origins"), targets(device, b, "targets");
    Array<std::uint32_t> masks(device, a.size(), "masks");
    serial.occluded({&origins, nullptr, std::uint32_t(a.size()), &targets, 0}, masks);
    return masks.download();
  };
  const auto whole = ask(from, to), shortened = ask(short_from, short_to);
  for (std::size_t i = 0; i < blocked.size(); ++i) {
    v.ours_right += (whole[i] != 0) == blocked[i];
    v.by_its_segments += (shortened[i] != 0) != blocked[i];
  }
  return v;
}

void measure(const Options& o, Device& device, Setting& setting, nlohmann::json& report, bool& agree) {
  static const double peak = o.profile ? peak_gops(device) : 0;
  const unsigned threads = device.options().cores ? device.options().cores : device.info().compute_units;
  const EmbreeScene robust(setting.triangles, true, threads), plain(setting.triangles, false, threads);
  const auto judging = make_engine("serial", device, setting.triangles);
  std::vector<std::unique_ptr<VisibilityEngine>> engines;
  std::vector<double> build;
  for (const std::string& name : o.engines) {
    const auto start = Clock::now();
    engines.push_back(name == "shaft" ? make_shaft(device, setting.triangles, o.shaft)
                                      : make_engine(name, device, setting.triangles));
    device.finish();
    build.push_back(since(start));
  }
  fmt::print("{}: {} triangles; Embree builds in {:.3f} s", setting.scene.file, setting.triangles.size(),
             robust.build_seconds());
  for (std::size_t e = 0; e < engines.size(); ++e) fmt::print(", {} in {:.3f} s", o.engines[e], build[e]);
  fmt::print("\n");

  const std::vector<std::uint32_t> order =
      in_order(device, PointArray(device, setting.mesh.receivers, "receivers")).download();
  for (const std::uint32_t n : o.samples) {
    std::vector<Work> work;
    std::uint64_t tests = 0;
    for (const std::uint32_t p : patches_that_shoot(setting, o.shooters)) {
      Step step = step_of(setting, p, n, o.receivers / o.shooters, order);
      if (step.receivers.empty()) continue;
      tests += step.rays();
      work.emplace_back(device, std::move(step));
    }
    std::vector<std::function<void()>> turns;
    std::vector<std::string> names;
    for (std::size_t e = 0; e < engines.size(); ++e) {
      // A step of so many pairs takes serial seconds, ten times over.
      if (o.engines[e] == "serial" && tests * setting.triangles.size() > 2'000'000'000) continue;
      names.push_back(o.engines[e]);
      turns.push_back([&, e] {
        for (Work& w : work) engines[e]->occluded(w.segments(), w.masks);
        device.finish();
      });
    }
    const std::size_t ours = turns.size();
    std::vector<Peer> peers;
    for (const EmbreeScene* scene : {&robust, &plain})
      for (const EmbreeWay way : embree_ways) {
        if (o.alone && way != EmbreeWay::packet_8) continue;
        peers.push_back({scene, way, scene == &robust});
        turns.push_back([&, scene, way] {
          for (Work& w : work) scene->occluded(way, w.step.receivers, w.step.samples, offset, w.embree);
        });
      }

    // What is timed has been verified: all engines give the same bits.
    std::vector<std::vector<std::uint32_t>> answer;
    std::vector<std::uint64_t> wrong(turns.size());
    for (std::size_t t = 0; t < turns.size(); ++t) {
      turns[t]();
      for (std::size_t i = 0; i < work.size(); ++i) {
        const auto bits = t < ours ? work[i].masks.download() : work[i].embree;
        if (t == 0) answer.push_back(bits);
        wrong[t] += differing(bits, answer[i]);
      }
      if (t < ours) agree &= wrong[t] == 0;
    }
    const auto seconds = alternate(turns, int(o.quick ? 3 : o.rounds));
    const auto best_of = [&](bool robust_ones) {
      std::size_t best = 0;
      for (std::size_t p = 0; p < peers.size(); ++p)
        if (peers[p].robust == robust_ones &&
            (peers[best].robust != robust_ones || median(seconds[ours + p]) < median(seconds[ours + best])))
          best = p;
      return best;
    };
    const std::size_t best = best_of(true), best_plain = best_of(false);
    turns[ours + best]();
    const Verdict verdict = judge(device, *judging, work, answer);
    agree &= verdict.ours_right == verdict.differing;
    for (std::size_t t = 0; t < ours; ++t) {
      const VisibilityCounts counts = engines[t]->counts();
      const double exact = 1e6 * double(counts.exact) / double(counts.rays);
      std::vector<double> ratio, ratio_plain;
      for (std::size_t r = 0; r < seconds[t].size(); ++r) {
        ratio.push_back(seconds[ours + best][r] / seconds[t][r]);
        ratio_plain.push_back(seconds[ours + best_plain][r] / seconds[t][r]);
      }
      const double mtests = 1e-6 * double(tests) / median(seconds[t]);
      const double peer_mtests = 1e-6 * double(tests) / median(seconds[ours + best]);
      fmt::print(
          "  n={:<3} {:7} {:9.2f} Mtests/s  Embree {:10} {:8.2f}  ratio {:6.2f} ({:.2f}..{:.2f}), not robust "
          "{:6.2f}; "
          "{:.1f} exact tests a million; {} of {} bits differ from Embree's\n",
          n, names[t], mtests, name_of(peers[best].way), peer_mtests, median(ratio), quantile(ratio, 0),
          quantile(ratio, 1), median(ratio_plain), exact, wrong[ours + best], tests);
      report["rows"].push_back({{"scene", setting.scene.file},
                                {"triangles", setting.triangles.size()},
                                {"samples", n},
                                {"engine", names[t]},
                                {"tests", tests},
                                {"mtests_per_s", mtests},
                                {"exact_per_million", exact},
                                {"build_s", build[t]},
                                {"embree_best", name_of(peers[best].way)},
                                {"embree_best_mtests_per_s", peer_mtests},
                                {"embree_build_s", robust.build_seconds()},
                                {"ratio", median(ratio)},
                                {"ratio_min", quantile(ratio, 0)},
                                {"ratio_max", quantile(ratio, 1)},
                                {"ratio_default_flag", median(ratio_plain)},
                                {"mismatches", wrong[t]},
                                {"embree_mismatches", wrong[ours + best]}});
    }
    fmt::print(
        "        Embree differs in {} bits; the exact predicate, asked of every triangle, has {} of them as "
        "ours; {} come of "
        "Embree's segments, {:g} shorter at both ends and ignoring no plane, {} of its rounding\n",
        verdict.differing, verdict.ours_right, verdict.by_its_segments, offset,
        verdict.differing - verdict.by_its_segments);
    report["verdicts"].push_back({{"scene", setting.scene.file},
                                  {"samples", n},
                                  {"differing", verdict.differing},
                                  {"ours_right", verdict.ours_right},
                                  {"by_embrees_segments", verdict.by_its_segments}});
    if (o.profile && !o.engines.empty() && o.engines[0] == "shaft") {
      auto& shaft = dynamic_cast<ShaftEngine&>(*engines[0]);
      const ShaftWork before = shaft.work();
      turns[0]();
      ShaftWork w = shaft.work();
      w.runs -= before.runs, w.given_up -= before.given_up, w.nodes -= before.nodes, w.boxes -= before.boxes;
      w.shaft_triangles -= before.shaft_triangles, w.packet_triangles -= before.packet_triangles;
      const unsigned width = device.options().packet_width;
      const double packets = double(tests) / width;
      const double gops = 1e-9 * operations(w, width) / median(seconds[0]);
      fmt::print(
          "        of {:.0f} packets of {} tests: {:.2f} nodes, {:.2f} boxes, {:.2f} triangles of shafts, "
          "{:.2f} of packets "
          "each; {:.0f} % of the runs given up; {:.1f} Gop/s, {:.0f} % of {:.0f}\n",
          packets, width, double(w.nodes) / packets, double(w.boxes) / packets,
          double(w.shaft_triangles) / packets, double(w.packet_triangles) / packets,
          100 * double(w.given_up) / double(w.runs), gops, 100 * gops / peak, peak);
      report["work"].push_back({{"scene", setting.scene.file},
                                {"samples", n},
                                {"packets", packets},
                                {"nodes", w.nodes},
                                {"boxes", w.boxes},
                                {"shaft_triangles", w.shaft_triangles},
                                {"packet_triangles", w.packet_triangles},
                                {"runs", w.runs},
                                {"given_up", w.given_up},
                                {"gops", gops},
                                {"peak_gops", peak}});
    }
    if (o.profile)
      for (std::size_t p = 0; p < peers.size(); ++p)
        fmt::print("        Embree {:10} {:7} {:8.2f} Mtests/s, {} bits differ\n", name_of(peers[p].way),
                   peers[p].robust ? "robust" : "default", 1e-6 * double(tests) / median(seconds[ours + p]),
                   wrong[ours + p]);
    std::fflush(stdout);
  }
}

/// Seconds to build the tree of a hall of about a million triangles, Embree's and ours in turn.
void measure_trees(const Options& o, Device& device, nlohmann::json& report) {
  const Scene scene = scene_of(make_scene::hall(848, 64), "hall");
  const auto triangles = occluder_triangles(scene, frame_of(scene), plane_ids(scene));
  const unsigned threads = device.options().cores ? device.options().cores : device.info().compute_units;
  std::vector<double> embree, grid, tree, ratio;
  for (std::uint32_t r = 0; r <= (o.quick ? 3 : o.rounds); ++r) {
    const double theirs = EmbreeScene(triangles, true, threads).build_seconds();
    auto start = Clock::now();
    const Occluders occluders(device, triangles);
    device.finish();
    const double snapped = since(start);
    start = Clock::now();
    const Tree built(device, occluders);
    device.finish();
    if (r == 0) continue;  // kernels are compiled
    embree.push_back(theirs), grid.push_back(snapped), tree.push_back(since(start));
    ratio.push_back(tree.back() / theirs);
  }
  fmt::print(
      "{} triangles: Embree's tree in {:.3f} s, ours in {:.3f} s, {:.2f} times as long ({:.2f}..{:.2f}), "
      "after {:.3f} s to "
      "put triangles on the grid\n",
      triangles.size(), median(embree), median(tree), median(ratio), quantile(ratio, 0), quantile(ratio, 1),
      median(grid));
  report["trees"] = {{"triangles", triangles.size()},
                     {"embree_s", median(embree)},
                     {"tree_s", median(tree)},
                     {"grid_s", median(grid)},
                     {"ratio", median(ratio)}};
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{
      "Visibility tests a second of the engines and of Embree on the same segments with the same threads.",
      "bench_visibility"};
  app.add_option("files", o.files, "scenes to measure besides the generated ones");
  app.add_option("-o,--output", o.out)->capture_default_str();
  app.add_option("--only", o.only, "only generated scenes with this in their names");
  app.add_option("--engines", o.engines)->capture_default_str();
  app.add_option("--samples", o.samples)->capture_default_str();
  app.add_option("--receivers", o.receivers, "of all shooters together, at most")->capture_default_str();
  app.add_option("--elements", o.elements, "along the scene's longest side")->capture_default_str();
  app.add_option("--shooters", o.shooters)->capture_default_str();
  app.add_option("--rounds", o.rounds)->capture_default_str();
  app.add_option("--cores", o.device.cores);
  app.add_option("--packet", o.device.packet_width);
  app.add_option("--run-length", o.shaft.run_length, "samples of one shaft");
  app.add_option("--budget", o.shaft.budget, "triangles that a shaft asks sample by sample");
  app.add_flag("--alone", o.alone, "one way of asking Embree only: for work on the engines");
  app.add_flag("--trees", o.trees, "only build the tree of a million triangles");
  app.add_flag("--quick", o.quick, "three rounds");
  app.add_flag(
      "--profile", o.profile,
      "what shafts and packets do, the share of the peak that makes, and every way of asking Embree");
  CLI11_PARSE(app, argc, argv);

  Device device(o.device);
  nlohmann::json report = {{"benchmark", "visibility"},
                           {"device", device.info().name},
                           {"driver", device.info().driver},
                           {"cores", device.options().cores},
                           {"packet_width", device.options().packet_width}};
  bool agree = true;
  const auto one = [&](const std::string& name, const std::function<Scene()>& make) {
    if (!o.only.empty() && name.find(o.only) == std::string::npos) return;
    Scene scene = make();
    const double extent = 2 * frame_of(scene).metres();
    Setting setting(std::move(scene), {extent / 16, extent / o.elements});
    setting.scene.file = name;
    measure(o, device, setting, report, agree);
  };
  if (o.trees) {
    measure_trees(o, device, report);
    o.only = "none of them";
  }
  one("cornell", [] { return load_scene(CLRAD_SCENES "/cornell.obj"); });
  one("office", [] { return scene_of(make_scene::office(60), "office"); });
  one("hall", [] { return scene_of(make_scene::hall(212, 64), "hall"); });
  for (const std::string& file : o.files) one(file, [&] { return load_scene(file); });
  std::filesystem::create_directories(std::filesystem::path(o.out).parent_path());
  std::ofstream(o.out) << report.dump(2) << '\n';
  if (!agree) fmt::print(stderr, "the engines' bits differ, or are not those of the exact predicate\n");
  return agree ? 0 : 1;
}
