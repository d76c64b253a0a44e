/// What adaptive subdivision saves: error of the displayed radiosity at random points of the surfaces, of uniform and of
/// adaptive meshes, against a uniform mesh two levels finer than the finest of them. Usage: bench_adaptive [-o FILE]
/// [--scene FILE] [--quick] [--patches N] [--coarse N] [--levels N] [--samples N] [--light-samples N] [--visibility-exact] [--tolerance T ...]
/// [--points CSV (first band at each point)]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "clrad/clrad.hpp"
#include "mesh/locate.hpp"
#include "output/displayed.hpp"

namespace {

using namespace clrad;

struct Place {
  std::uint32_t polygon;
  double u, v;
};

std::vector<Place> random_places(const Scene& scene, std::size_t count) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> area;
  for (const Polygon& p : scene.polygons) area.push_back(p.area_m2());
  std::discrete_distribution<std::uint32_t> by_area(area.begin(), area.end());
  std::vector<Place> places;
  while (places.size() < count) {
    Place p{by_area(random), unit(random), unit(random)};
    if (scene.polygons[p.polygon].corners == 3 && p.u + p.v > 1) p.u = 1 - p.u, p.v = 1 - p.v;
    places.push_back(p);
  }
  return places;
}

// Places that something stands on, and those within an element of the reference of such, are not displayed.
std::vector<Place> visible_places(const Solution& reference, std::size_t count) {
  std::vector<Place> places;
  for (const Place& p : random_places(reference.scene, 2 * count)) {
    const Interpolant at =
        locate(reference.mesh, p.polygon, reference.scene.polygons[p.polygon].corners, p.u, p.v);
    const bool covered = std::any_of(at.vertex.begin(), at.vertex.end(),
                                     [&](std::uint32_t v) { return reference.vertex_covered[v] != 0; });
    if (!covered && places.size() < count) places.push_back(p);
  }
  return places;
}

// [place][band]
std::vector<double> displayed(const Solution& solution, const std::vector<Place>& places) {
  const Displayed shown(solution);
  std::vector<double> values;
  for (const Place& p : places) {
    const Interpolant at =
        locate(solution.mesh, p.polygon, solution.scene.polygons[p.polygon].corners, p.u, p.v);
    for (std::uint32_t b = 0; b < solution.bands; ++b) values.push_back(shown.at(b, at));
  }
  return values;
}

struct Row {
  std::string name;
  std::size_t elements, vertices;
  std::uint64_t rays;
  double seconds;
  std::vector<double> values;
  std::vector<std::uint32_t> levels;
};

Row run(Device& device, const Scene& scene, const std::string& name, const SolveOptions& options,
        const std::vector<Place>& places) {
  const auto start = std::chrono::steady_clock::now();
  const Solution s = solve(device, scene, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::vector<std::uint32_t> levels;
  for (const Place& p : places)
    levels.push_back(
        s.mesh.elements[locate(s.mesh, p.polygon, scene.polygons[p.polygon].corners, p.u, p.v).element]
            .level);
  return {name,  s.mesh.elements.size(), s.vertex_count(), s.report.rays, seconds, displayed(s, places),
          levels};
}

}  // namespace

int main(int argc, char** argv) {
  std::string file = "scenes/block_room.obj", out = "out/bench/adaptive.json", points;
  std::vector<double> tolerances;
  double coarse_parts = 16, patch_parts = 8;
  SolveOptions options;
  std::uint32_t levels = 3;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const auto value = [&] { return i + 1 < argc ? argv[++i] : "0"; };
    if (a == "--quick")
      coarse_parts = 8;
    else if (a == "--levels")
      levels = unsigned(std::atoi(value()));
    else if (a == "--coarse")
      coarse_parts = std::atof(value());
    else if (a == "--patches")
      patch_parts = std::atof(value());
    else if (a == "--samples")
      options.samples = unsigned(std::atoi(value()));
    else if (a == "--light-samples")
      options.light_samples = unsigned(std::atoi(value()));
    else if (a == "--visibility-exact")
      options.visibility_exact = true;
    else if (a == "--scene")
      file = value();
    else if (a == "-o")
      out = value();
    else if (a == "--points")
      points = value();
    else if (a == "--tolerance")
      tolerances.push_back(std::atof(value()));
    else
      return fmt::print(stderr, "unknown option {}\n", a), 2;
  }
  if (tolerances.empty()) tolerances = {0.2, 0.1, 0.05};
  Device device;
  const Scene scene = load_scene(file);
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const auto& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z});

  // What is left unshot differs from mesh to mesh; here it is to be far below what the meshes themselves get wrong.
  options.converge = 1e-6;
  options.closure = Closure::off;  // rows are closed when that pays, which also differs from mesh to mesh
  options.mesh.patch_edge_m = extent / patch_parts;
  options.mesh.element_edge_m = extent / coarse_parts;
  options.adaptive.max_level = levels;
  // Kernels are loaded at their first use; no row is to pay for that.
  for (const double t : {0., 0.05}) {
    options.adaptive.tolerance = t;
    solve(device, scene, options);
  }
  options.adaptive = {};
  options.mesh.element_edge_m = extent / coarse_parts / double(1u << (levels + 2));
  const Solution reference_solution = solve(device, scene, options);
  const auto places = visible_places(reference_solution, 10000);
  const std::vector<double> reference = displayed(reference_solution, places);
  std::vector<Row> rows;
  for (std::uint32_t level = 0; level <= levels; ++level) {
    options.mesh.element_edge_m = extent / coarse_parts / double(1u << level);
    rows.push_back(run(device, scene, fmt::format("uniform, extent / {:g}", coarse_parts * (1u << level)),
                       options, places));
  }
  options.mesh.element_edge_m = extent / coarse_parts;
  options.adaptive.max_level = levels;
  for (const double t : tolerances) {
    options.adaptive.tolerance = t;
    rows.push_back(run(device, scene, fmt::format("adaptive {:g}", t), options, places));
  }
  const std::size_t bands = scene.bands.size();
  double mean = 0;
  for (const double x : reference) mean += x / double(reference.size());

  nlohmann::json report = {
      {"benchmark", "adaptive"}, {"scene", file}, {"device", device.info().name}, {"points", places.size()}};
  fmt::print("{}: displayed radiosity at {} points against {} elements\n", file, places.size(),
             reference_solution.mesh.elements.size());
  fmt::print("{:<24} {:>9} {:>9} {:>10} {:>9} {:>9} {:>9}\n", "mesh", "elements", "vertices", "rays", "RMS %",
             "99.5 % %", "seconds");
  for (const Row& r : rows) {
    std::vector<double> error;
    double squares = 0;
    for (std::size_t i = 0; i < r.values.size(); ++i) {
      error.push_back(std::abs(r.values[i] - reference[i]) / mean);
      squares += error.back() * error.back() / double(r.values.size());
    }
    std::sort(error.begin(), error.end());
    const double rms = std::sqrt(squares), high_error = error[std::size_t(0.995 * double(error.size()))];
    fmt::print("{:<24} {:>9} {:>9} {:>10} {:>9.3f} {:>9.3f} {:>9.2f}\n", r.name, r.elements, r.vertices,
               r.rays, 100 * rms, 100 * high_error, r.seconds);
    report["rows"].push_back({{"mesh", r.name},
                              {"elements", r.elements},
                              {"vertices", r.vertices},
                              {"rays", r.rays},
                              {"rms_relative", rms},
                              {"p99_5_relative", high_error},
                              {"seconds", r.seconds}});
  }
  if (!points.empty()) {
    std::ofstream csv(points);
    csv << "polygon,u,v,reference";
    for (const Row& r : rows) csv << ",\"" << r.name << "\",level";
    csv << '\n';
    for (std::size_t i = 0; i < places.size(); ++i) {
      csv << places[i].polygon << ',' << places[i].u << ',' << places[i].v << ',' << reference[i * bands];
      for (const Row& r : rows) csv << ',' << r.values[i * bands] << ',' << r.levels[i];
      csv << '\n';
    }
  }
  std::filesystem::create_directories(std::filesystem::path(out).parent_path());
  std::ofstream(out) << report.dump(2) << '\n';
}
