#include <cstdio>

#include "curves.hpp"

namespace clrad::bench {
namespace {

constexpr int most_serial = 100000;  ///< polygons; above, serial is extrapolated
constexpr double paper_factor = 60;

struct OccluderRow {
  int polygons;
  std::size_t vertices;
  std::uint64_t rays;
  double chop, serial;  ///< seconds a ray
  bool extrapolated;
};

/// Where the ratio first passes `factor`, between rows by the logarithms; 0 when it never does.
double crossing(const std::vector<OccluderRow>& rows, double factor) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double ratio = rows[i].serial / rows[i].chop;
    if (ratio < factor) continue;
    if (i == 0) return rows[0].polygons;
    const double before = std::log(rows[i - 1].serial / rows[i - 1].chop);
    const double at = (std::log(factor) - before) / (std::log(ratio) - before);
    return std::exp(std::log(double(rows[i - 1].polygons)) +
                    at * std::log(double(rows[i].polygons) / rows[i - 1].polygons));
  }
  return 0;
}

}  // namespace

nlohmann::json occluders_curve(const CurveOptions& options) {
  const std::vector<int> sizes =
      options.quick ? std::vector{100, 1000, 5761}
                    : std::vector{100, 300, 1000, 3000, 5761, 10000, 30000, 100000, 300000, 1000000};
  nlohmann::json report;
  std::vector<OccluderRow> rows;
  double serial_per_pair = 0;
  std::printf("\nchop against serial, 8 shooters\n%10s %9s %9s %3s %9s %12s %12s %8s\n", "occluders",
              "patches", "vertices", "n", "rays", "chop us/ray", "serial us", "ratio");
  for (const int size : sizes) {
    const Setting s(size);
    Device device;
    // As many rays as serial does in about a second, at most what 8 shooters send to 4096 receivers each.
    const double affordable = (options.quick ? 1e9 : 4e9) / double(s.triangles.size());
    const auto most = std::size_t(std::clamp(affordable / (8 * n), 128.0, 4096.0));
    std::vector<Step> all;
    for (const std::uint32_t patch : shooters(s, 8))
      all.push_back(step_of(s, patch, n, size > most_serial ? 4096 : most));
    StepsOnDevice steps(device, all);
    auto chop = make_chop(device, s.triangles, options.chop);
    std::vector<std::uint32_t> bits;
    check_bits(steps, *chop, bits);
    std::vector<std::function<void()>> what = {[&] { steps.run(*chop); }};
    std::unique_ptr<VisibilityEngine> serial;
    if (size <= most_serial) {
      serial = make_engine("serial", device, s.triangles);
      check_bits(steps, *serial, bits);
      what.emplace_back([&] { steps.run(*serial); });
    }
    const auto seconds = alternate(what, options.quick ? 3 : 9);
    const double rays = double(steps.rays), chop_s = median(seconds[0]) / rays;
    const bool extrapolated = !serial;
    const double serial_s = serial ? median(seconds[1]) / rays : serial_per_pair * double(s.triangles.size());
    if (serial) serial_per_pair = serial_s / double(s.triangles.size());
    const double ratio_now = serial ? ratio(seconds[1], seconds[0]) : serial_s / chop_s;
    rows.push_back({size, s.mesh.receivers.size(), steps.rays, chop_s, chop_s * ratio_now, extrapolated});
    const auto cells = chop->grid().cells;
    report["rows"].push_back({{"occluder_polygons", s.scene.polygons.size()},
                              {"occluder_triangles", s.triangles.size()},
                              {"patches", s.mesh.patches.size()},
                              {"vertices", s.mesh.receivers.size()},
                              {"samples", n},
                              {"rays", steps.rays},
                              {"cells", {cells[0], cells[1], cells[2]}},
                              {"chop_s", spread(seconds[0])},
                              {"chop_s_per_ray", chop_s},
                              {"serial_s_per_ray", serial_s},
                              {"serial_extrapolated", extrapolated},
                              {"ratio", ratio_now},
                              {"same_bits", serial ? nlohmann::json(true) : nlohmann::json(nullptr)}});
    if (serial) report["rows"].back()["serial_s"] = spread(seconds[1]);
    std::printf("%10zu %9zu %9zu %3u %9llu %12.3f %12.3f %8.2f%s\n", s.scene.polygons.size(),
                s.mesh.patches.size(), s.mesh.receivers.size(), n,
                static_cast<unsigned long long>(steps.rays), 1e6 * chop_s, 1e6 * serial_s, ratio_now,
                extrapolated ? " (serial extrapolated)" : "");
  }
  const double at = crossing(rows, paper_factor);
  report["crosses_60x_at_polygons"] = at > 0 ? nlohmann::json(at) : nlohmann::json(nullptr);
  if (at > 0)
    std::printf("chop passes %.0fx at about %.0f occluder polygons\n", paper_factor, at);
  else
    std::printf("chop does not reach %.0fx here\n", paper_factor);

  Plot plot{"occluders",
            "Visibility by chop and serial, 16 samples",
            "occluder polygons",
            "time per ray [{/Symbol m}s]",
            {}};
  Curve chop_curve{"chop", points_style(0, 7), {}}, serial_curve{"serial", points_style(1, 5), {}};
  Curve guess{"serial, extrapolated", line_style(1), {}};
  Plot ratios{
      "occluders_ratio", "How many times faster than serial chop is", "occluder polygons", "ratio", {}};
  Curve measured{"measured", points_style(0, 7), {}}, guessed{"serial extrapolated", points_style(0, 6), {}};
  Curve sixty{"the paper: 60", line_style(5), {}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const OccluderRow& r = rows[i];
    chop_curve.points.emplace_back(r.polygons, 1e6 * r.chop);
    (r.extrapolated ? guess : serial_curve).points.emplace_back(r.polygons, 1e6 * r.serial);
    (r.extrapolated ? guessed : measured).points.emplace_back(r.polygons, r.serial / r.chop);
    sixty.points.emplace_back(r.polygons, paper_factor);
    if (!r.extrapolated && i + 1 < rows.size() && rows[i + 1].extrapolated) {
      guess.points.emplace_back(r.polygons, 1e6 * r.serial);
      guessed.points.emplace_back(r.polygons, r.serial / r.chop);
    }
  }
  plot.curves = {serial_curve, chop_curve};
  ratios.curves = {measured, sixty};
  if (!guess.points.empty()) {
    plot.curves.push_back(guess);
    ratios.curves.push_back(guessed);
  }
  plot.write(options.folder);
  ratios.extra = "set format y '%g'\n";
  ratios.write(options.folder);
  return report;
}

}  // namespace clrad::bench
