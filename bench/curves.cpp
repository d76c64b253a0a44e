/// The paper's claims as curves, in out/bench/curves: data (.dat), gnuplot script, PNG where gnuplot is there.
///   occluders  chop against serial over 1e2 to 1e6 occluder polygons, bits compared, and where it crosses 60x
///   pairs      a visibility step against ray/object pairs, 1e4 to 1e9, at different splits into rays and objects
///   units      a visibility step on 1 and 2 compute units
///   waves      the work that each wave of chop was spared by rays that are blocked already
///   patches    seconds a shoot against patches, 1e3 to 1e6
/// Usage: bench_curves [-o FILE] [--quick] [--only NAME] [--slab N] [--batch N]
#include "curves/curves.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>

int main(int argc, char** argv) try {
  using namespace clrad::bench;
  std::string out = "out/bench/curves.json", only;
  CurveOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--quick")
      options.quick = true;
    else if (a == "-o" && i + 1 < argc)
      out = argv[++i];
    else if (a == "--slab" && i + 1 < argc)
      options.chop.slab = std::uint32_t(std::atoi(argv[++i]));
    else if (a == "--batch" && i + 1 < argc)
      options.chop.rays_per_batch = std::uint32_t(std::atoi(argv[++i]));
    else if (a == "--only" && i + 1 < argc)
      only = argv[++i];
    else
      return std::fprintf(stderr, "unknown option %s\n", a.c_str()), 2;
  }
  options.folder = (std::filesystem::path(out).parent_path() / "curves").string();
  std::filesystem::create_directories(options.folder);

  nlohmann::json report;
  report["benchmark"] = "curves";
  report["load_before"] = load();
  const clrad::Device device;
  report["device"] = device.info().name;
  report["driver"] = device.info().driver;
  report["cores"] = device.options().cores;
  const std::pair<const char*, nlohmann::json (*)(const CurveOptions&)> curves[] = {
      {"occluders", occluders_curve},
      {"pairs", pairs_curve},
      {"units", units_curve},
      {"waves", waves_curve},
      {"patches", patches_curve}};
  for (const auto& [name, measure] : curves)
    if (only.empty() || only == name) report[name] = measure(options);
  report["load_after"] = load();
  std::ofstream(out) << report.dump(2) << '\n';
  std::printf("load average of the machine %.1f before, %.1f after; wrote %s and %s\n",
              double(report["load_before"]), double(report["load_after"]), out.c_str(),
              options.folder.c_str());
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "bench_curves: %s\n", e.what());
  return 1;
}
