/// Form factors a second of the three estimators, on one core and on all: 16 x 16 patches on the ceiling and
/// on a wall of a cubic room against 128 x 128 receivers on its floor, 1e-3 of an element inside the edges as
/// in a solve. `exact` is compared with the contour formula in long double before it is timed.
///     bench_form_factor [-o FILE] [--device D] [--samples N] [--repeats N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "solve/form_factor.hpp"

namespace {

using namespace clrad;
using Clock = std::chrono::steady_clock;

constexpr double half = 0.75;  // of the room's side, in the frame
constexpr int patches = 16, grid = 128;

// Patch (i, j) of the ceiling (facing down) or of the wall x = half (facing -x).
Shooter patch(bool wall, int i, int j) {
  const double side = 2 * half / patches, u = -half + i * side, v = -half + j * side;
  const auto at = [&](double a, double b) { return wall ? glm::dvec3(half, a, b) : glm::dvec3(a, b, half); };
  Shooter s;
  s.corners = 4;
  s.corner[0] = at(u, v), s.corner[1] = at(u, v + side), s.corner[2] = at(u + side, v + side),
  s.corner[3] = at(u + side, v);
  s.normal = wall ? glm::dvec3(-1, 0, 0) : glm::dvec3(0, 0, -1);
  s.area = side * side;
  s.plane = wall ? 1 : 2;
  return s;
}

std::vector<Point> floor_receivers() {
  std::vector<Point> points;
  const auto at = [](int i) {
    const double inset = 1e-3 * 2 * half / (grid - 1), x = -half + i * (2 * half / (grid - 1));
    return std::clamp(x, -half + inset, half - inset);
  };
  for (int j = 0; j < grid; ++j)
    for (int i = 0; i < grid; ++i) points.push_back({{at(i), at(j), -half}, {0, 0, 1}, 0, 0});
  return points;
}

// Lambert's formula for a shooter above the floor's horizon.
long double lambert(const Point& p, const Shooter& s) {
  long double sum = 0;
  for (int k = 0; k < 4; ++k) {
    long double a[3], b[3];
    for (int d = 0; d < 3; ++d)
      a[d] = (long double)(s.corner[k][d]) - p.position[d],
      b[d] = (long double)(s.corner[(k + 1) % 4][d]) - p.position[d];
    const long double c[3] = {b[1] * a[2] - b[2] * a[1], b[2] * a[0] - b[0] * a[2],
                              b[0] * a[1] - b[1] * a[0]};
    const long double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    sum += std::atan2(length, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * c[2] / length;
  }
  return sum / (2 * 3.14159265358979323846L);
}

// Seconds of one shoot's factors, median over repeats of a pass over every 16th patch.
double seconds_per_pass(Device& device, Estimator estimator, bool wall, const PointArray& receivers,
                        std::uint32_t n, int repeats, std::vector<double>& all) {
  RealArray factors(device, grid * grid, "factors");
  std::vector<PointArray> samples;
  for (int k = 0; k < patches; ++k)
    samples.emplace_back(device, stratified_samples(patch(wall, k, k), n, std::uint64_t(k)), "samples");
  const auto pass = [&] {
    for (int k = 0; k < patches; ++k)
      form_factors(device, estimator, patch(wall, k, k), receivers, nullptr, grid * grid,
                   samples[std::size_t(k)], n, factors);
    device.finish();
  };
  pass();  // warm-up
  all.clear();
  for (int r = 0; r < repeats; ++r) {
    const auto start = Clock::now();
    pass();
    all.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  std::sort(all.begin(), all.end());
  return all[all.size() / 2];
}

double worst_error(Device& device, bool wall, const PointArray& receivers, const std::vector<Point>& points) {
  RealArray factors(device, grid * grid, "factors");
  double worst = 0;
  for (int k = 0; k < patches; k += 5) {
    form_factors(device, Estimator::exact, patch(wall, k, k), receivers, nullptr, grid * grid, receivers, 0,
                 factors);
    const auto values = factors.download();
    for (std::size_t i = 0; i < points.size(); i += 7) {
      const double exact = double(lambert(points[i], patch(wall, k, k)));
      worst = std::max(worst, exact > 0 ? std::abs(values[i] - exact) / exact : INFINITY);
    }
  }
  return worst;
}

}  // namespace

int main(int argc, char** argv) try {
  std::string out = "out/bench/form_factor.json", wanted;
  std::uint32_t n = 16;
  int repeats = 9;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string option = argv[i];
    if (option == "-o") out = argv[i + 1];
    if (option == "--device") wanted = argv[i + 1];
    if (option == "--samples") n = std::uint32_t(std::stoul(argv[i + 1]));
    if (option == "--repeats") repeats = std::stoi(argv[i + 1]);
  }
  nlohmann::json report = {{"benchmark", "form_factor"},
                           {"receivers", grid * grid},
                           {"shooters", patches},
                           {"samples", n},
                           {"repeats", repeats}};
  const auto points = floor_receivers();
  fmt::print("{:<9} {:<8} {:<8} {:>6} {:>12} {:>12} {:>14}\n", "estimator", "shooter", "numbers", "cores",
             "M factors/s", "ns (median)", "worst error");
  for (const Precision precision : {Precision::float32, Precision::float64})
    for (const unsigned cores : {1u, 0u}) {
      Device device({.device = wanted, .cores = cores, .precision = precision});
      report["device"] = device.info().name, report["driver"] = device.info().driver;
      const PointArray receivers(device, points, "receivers");
      for (const bool wall : {false, true})
        for (const Estimator estimator : {Estimator::exact, Estimator::disk, Estimator::subdisk}) {
          const char* names[] = {"disk", "subdisk", "exact"};
          const double error =
              estimator == Estimator::exact ? worst_error(device, wall, receivers, points) : 0;
          if (error > (precision == Precision::float32 ? 1e-5 : 1e-9))
            throw Error(fmt::format("exact factors are off by {:.3g} relative", error));
          std::vector<double> times;
          const double median = seconds_per_pass(device, estimator, wall, receivers, n, repeats, times);
          const double factors = double(patches) * grid * grid;
          std::vector<double> deviations;
          for (const double t : times) deviations.push_back(std::abs(t - median));
          std::sort(deviations.begin(), deviations.end());
          fmt::print("{:<9} {:<8} {:<8} {:>6} {:>12.2f} {:>12.1f} {:>14.1e}\n", names[int(estimator)],
                     wall ? "wall" : "ceiling", precision == Precision::float32 ? "float" : "double",
                     cores ? "1" : "all", factors / median * 1e-6, median / factors * 1e9, error);
          report["rows"].push_back({{"estimator", names[int(estimator)]},
                                    {"shooter", wall ? "wall" : "ceiling"},
                                    {"precision", precision == Precision::float32 ? "float" : "double"},
                                    {"cores", cores ? 1u : device.info().compute_units},
                                    {"million_factors_per_s", factors / median * 1e-6},
                                    {"ns_median", median / factors * 1e9},
                                    {"ns_min", times.front() / factors * 1e9},
                                    {"ns_mad", deviations[deviations.size() / 2] / factors * 1e9},
                                    {"worst_relative_error", error}});
        }
    }
  std::filesystem::create_directories(std::filesystem::absolute(out).parent_path());
  std::ofstream(out) << report.dump(2) << "\n";
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
