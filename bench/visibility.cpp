/// Visibility tests a second of the engines: the Cornell box (light to receivers) and generated rooms full of
/// boxes. Usage: bench_visibility [-o FILE] [--quick] [--cores N] [--receivers N] [--profile] [--packet N] [--batch N] [--cells
/// NxNxN] [--slab N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include <sys/resource.h>

#include "clrad/visibility.hpp"
#include "visibility/chop.hpp"

namespace {

using clrad::OccluderTriangle;
using clrad::Point;
using Clock = std::chrono::steady_clock;

struct Case {
  std::string name;
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> receivers, samples;
};

struct Quad {
  glm::dvec3 corner[4];
  std::uint32_t plane;
};

void add(Case& c, const Quad& q, std::uint32_t polygon) {
  c.triangles.push_back({{q.corner[0], q.corner[1], q.corner[2]}, q.plane, polygon});
  c.triangles.push_back({{q.corner[0], q.corner[2], q.corner[3]}, q.plane, polygon});
}

glm::dvec3 cross(glm::dvec3 a, glm::dvec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double dot(glm::dvec3 a, glm::dvec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// n x n cell middles of a quad, with its plane.
void spread(std::vector<Point>& points, const Quad& q, int n) {
  const auto area = cross(q.corner[1] - q.corner[0], q.corner[3] - q.corner[0]);
  const auto normal = area / std::sqrt(dot(area, area));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double u = (i + 0.5) / n, v = (j + 0.5) / n;
      const auto low = q.corner[0] * (1 - u) + q.corner[1] * u,
                 high = q.corner[3] * (1 - u) + q.corner[2] * u;
      points.push_back({low * (1 - v) + high * v, normal, q.plane});
    }
}

void keep_facing(Case& c, glm::dvec3 light) {
  std::erase_if(c.receivers, [&](const Point& p) { return dot(p.normal, light - p.position) <= 0; });
}

/// The published geometry in units of half a metre about its middle; ceiling and light lie in one plane.
Case cornell(int receivers, int samples) {
  const double v[][12] = {
      {0.5528, 0, 0, 0, 0, 0, 0, 0, 0.5592, 0.5496, 0, 0.5592},
      {0.343, 0.5488, 0.227, 0.343, 0.5488, 0.332, 0.213, 0.5488, 0.332, 0.213, 0.5488, 0.227},
      {0, 0.5488, 0, 0.556, 0.5488, 0, 0.556, 0.5488, 0.227, 0, 0.5488, 0.227},
      {0, 0.5488, 0.332, 0.556, 0.5488, 0.332, 0.556, 0.5488, 0.5592, 0, 0.5488, 0.5592},
      {0, 0.5488, 0.227, 0.213, 0.5488, 0.227, 0.213, 0.5488, 0.332, 0, 0.5488, 0.332},
      {0.343, 0.5488, 0.227, 0.556, 0.5488, 0.227, 0.556, 0.5488, 0.332, 0.343, 0.5488, 0.332},
      {0.5496, 0, 0.5592, 0, 0, 0.5592, 0, 0.5488, 0.5592, 0.556, 0.5488, 0.5592},
      {0, 0, 0.5592, 0, 0, 0, 0, 0.5488, 0, 0, 0.5488, 0.5592},
      {0.5528, 0, 0, 0.5496, 0, 0.5592, 0.556, 0.5488, 0.5592, 0.556, 0.5488, 0},
      {0.13, 0.165, 0.065, 0.082, 0.165, 0.225, 0.24, 0.165, 0.272, 0.29, 0.165, 0.114},
      {0.082, 0, 0.225, 0.082, 0.165, 0.225, 0.13, 0.165, 0.065, 0.13, 0, 0.065},
      {0.24, 0, 0.272, 0.24, 0.165, 0.272, 0.082, 0.165, 0.225, 0.082, 0, 0.225},
      {0.29, 0, 0.114, 0.29, 0.165, 0.114, 0.24, 0.165, 0.272, 0.24, 0, 0.272},
      {0.13, 0, 0.065, 0.13, 0.165, 0.065, 0.29, 0.165, 0.114, 0.29, 0, 0.114},
      {0.423, 0.33, 0.247, 0.265, 0.33, 0.296, 0.314, 0.33, 0.456, 0.472, 0.33, 0.406},
      {0.265, 0, 0.296, 0.265, 0.33, 0.296, 0.423, 0.33, 0.247, 0.423, 0, 0.247},
      {0.314, 0, 0.456, 0.314, 0.33, 0.456, 0.265, 0.33, 0.296, 0.265, 0, 0.296},
      {0.472, 0, 0.406, 0.472, 0.33, 0.406, 0.314, 0.33, 0.456, 0.314, 0, 0.456},
      {0.423, 0, 0.247, 0.423, 0.33, 0.247, 0.472, 0.33, 0.406, 0.472, 0, 0.406},
  };
  Case c{fmt::format("cornell_{}", samples * samples), {}, {}, {}};
  std::uint32_t polygon = 0;
  for (const auto& p : v) {
    Quad q;
    for (int k = 0; k < 4; ++k)
      q.corner[k] = glm::dvec3(p[3 * k] - 0.278, p[3 * k + 1] - 0.2744, p[3 * k + 2] - 0.2796) * 2.0;
    q.plane = polygon >= 1 && polygon <= 5 ? 1 : polygon;
    add(c, q, polygon);
    if (polygon == 1) spread(c.samples, q, samples);
    spread(c.receivers, q, std::max(1, int(std::sqrt(receivers / 19.0))));
    ++polygon;
  }
  keep_facing(c, c.samples[0].position);
  return c;
}

/// A closed room [-1, 1]^3 with `boxes` small boxes, a light under its ceiling and receivers all over.
Case room(int boxes, int receivers, int samples, unsigned seed) {
  Case c{fmt::format("room_{}_{}", 12 * boxes + 12, samples * samples), {}, {}, {}};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::uint32_t polygon = 0;
  std::vector<Quad> quads;
  const auto box = [&](glm::dvec3 low, glm::dvec3 high) {
    const auto corner = [&](int k) {
      return glm::dvec3(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z);
    };
    const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : faces) {
      quads.push_back({{corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3])}, polygon});
      add(c, quads.back(), polygon++);
    }
  };
  box({-0.99, -0.99, -0.99}, {0.99, 0.99, 0.99});
  const double most = 0.6 / std::cbrt(double(boxes) + 1);
  for (int i = 0; i < boxes; ++i) {
    const glm::dvec3 low(unit(random) * 1.6 - 0.95, unit(random) * 1.6 - 0.95, unit(random) * 1.6 - 0.95);
    box(low, low + glm::dvec3(0.2 + unit(random), 0.2 + unit(random), 0.2 + unit(random)) * (most / 1.2));
  }
  spread(c.samples, {{{-0.2, 0.97, -0.2}, {0.2, 0.97, -0.2}, {0.2, 0.97, 0.2}, {-0.2, 0.97, 0.2}}, polygon},
         samples);
  for (int i = 0; i < receivers; ++i) {
    const auto& q = quads[random() % quads.size()];
    const double u = unit(random), v = unit(random);
    const auto area = cross(q.corner[1] - q.corner[0], q.corner[3] - q.corner[0]);
    c.receivers.push_back({q.corner[0] + (q.corner[1] - q.corner[0]) * u + (q.corner[3] - q.corner[0]) * v,
                           area / std::sqrt(dot(area, area)), q.plane});
  }
  keep_facing(c, {0, 0.97, 0});
  return c;
}

/// Processor time of the whole process [s]: what a busy machine does not change much.
double cpu_seconds() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return double(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
         1e-6 * double(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false, profile = false;
  int receivers = 20000;
  clrad::DeviceOptions device_options;
  clrad::ChopOptions chop_options;
  std::string only, out = "out/bench/visibility.json";
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const auto value = [&] { return i + 1 < argc ? argv[++i] : "0"; };
    if (a == "--quick")
      quick = true;
    else if (a == "--profile")
      profile = true;
    else if (a == "--cores")
      device_options.cores = unsigned(std::atoi(value()));
    else if (a == "--packet")
      device_options.packet_width = unsigned(std::atoi(value()));
    else if (a == "--receivers")
      receivers = std::atoi(value());
    else if (a == "--batch")
      chop_options.rays_per_batch = unsigned(std::atoi(value()));
    else if (a == "--slab")
      chop_options.slab = unsigned(std::atoi(value()));
    else if (a == "-o")
      out = value();
    else if (a == "--only")
      only = value();
    else if (a == "--cells") {
      if (std::sscanf(value(), "%ux%ux%u", &chop_options.cells[0], &chop_options.cells[1],
                      &chop_options.cells[2]) != 3)
        return 2;
    } else {
      std::fprintf(stderr, "unknown option %s\n", a.c_str());
      return 2;
    }
  }
  if (quick) receivers = 2000;

  clrad::Device device(device_options);
  nlohmann::json report;
  report["benchmark"] = "visibility";
  report["device"] = device.info().name;
  report["driver"] = device.info().driver;
  report["cores"] = device.options().cores;
  report["packet_width"] = device.options().packet_width;
  report["work_group_size"] = device.options().work_group_size;
  bool agree = true;
  std::printf("%-18s %-7s %10s %9s %9s %9s %9s %9s %9s %9s\n", "scene", "engine", "triangles", "Mtests/s",
              "best", "MAD ms", "cpu ns", "pieces/r", "pairs/r", "exact/M");
  const Case cases[] = {cornell(receivers, 2),          cornell(receivers, 4),
                        cornell(receivers, 8),          room(80, receivers / 8, 4, 1),
                        room(800, receivers / 8, 4, 2), room(8000, receivers / 8, 4, 3)};
  for (const auto& c : cases) {
    if (!only.empty() && c.name.find(only) == std::string::npos) continue;
    clrad::PointArray origins(device, c.receivers, "receivers"), targets(device, c.samples, "samples");
    clrad::Segments s{&origins, nullptr, std::uint32_t(c.receivers.size()), &targets,
                      std::uint32_t(c.samples.size())};
    std::vector<std::uint32_t> answer;
    for (const std::string name : {"chop", "serial"}) {
      if (name == "serial" && c.triangles.size() > 20000) continue;
      const auto built = Clock::now();
      auto engine = name == "chop" ? clrad::make_chop(device, c.triangles, chop_options)
                                   : clrad::make_engine(name, device, c.triangles);
      device.finish();
      const double build_s = std::chrono::duration<double>(Clock::now() - built).count();
      clrad::Array<std::uint32_t> masks(device, std::uint64_t(s.origin_count) * s.words_per_origin(),
                                        "masks");
      engine->occluded(s, masks);  // warm-up, and the answer that is verified before anything is timed
      auto bits = masks.download();
      if (answer.empty()) answer = bits;
      const bool same = bits == answer;
      agree &= same;
      device.reset_profile();
      const auto before = engine->counts();
      std::vector<double> ms;
      double spent = 0;
      const double cpu_before = cpu_seconds();
      const int least = quick ? 2 : 5;
      while (int(ms.size()) < least || (spent < (quick ? 0.2 : 1.0) && ms.size() < 50)) {
        const auto start = Clock::now();
        engine->occluded(s, masks);
        device.finish();
        ms.push_back(1e3 * std::chrono::duration<double>(Clock::now() - start).count());
        spent += ms.back() * 1e-3;
      }
      const double cpu_ns = 1e9 * (cpu_seconds() - cpu_before) / (double(s.count()) * double(ms.size()));
      const auto counts = engine->counts();
      const double rays = double(counts.rays - before.rays), middle = median(ms);
      std::vector<double> away;
      for (double x : ms) away.push_back(std::abs(x - middle));
      const double tests = double(s.count());
      nlohmann::json row = {{"scene", c.name},
                            {"engine", name},
                            {"triangles", c.triangles.size()},
                            {"samples", s.samples},
                            {"segments", s.count()},
                            {"runs", ms.size()},
                            {"build_s", build_s},
                            {"ms_median", middle},
                            {"ms_min", *std::min_element(ms.begin(), ms.end())},
                            {"ms_mad", median(away)},
                            {"cpu_ns_per_test", cpu_ns},
                            {"tests_per_s", tests / middle * 1e3},
                            {"pieces_per_ray", double(counts.pieces - before.pieces) / rays},
                            {"candidates_per_ray", double(counts.candidates - before.candidates) / rays},
                            {"exact_per_million_rays", 1e6 * double(counts.exact - before.exact) / rays},
                            {"same_bits", same}};
      std::printf("%-18s %-7s %10zu %9.2f %9.2f %9.2f %9.1f %9.2f %9.1f %9.1f%s\n", c.name.c_str(),
                  name.c_str(), c.triangles.size(), tests / middle * 1e-3,
                  tests / double(row["ms_min"]) * 1e-3, double(row["ms_mad"]), cpu_ns,
                  double(row["pieces_per_ray"]), double(row["candidates_per_ray"]),
                  double(row["exact_per_million_rays"]), same ? "" : "  DIFFERENT BITS");
      for (const auto& stage : device.profile()) {
        const double ns = 1e9 * stage.seconds / (tests * double(ms.size()));
        row["stages"].push_back({{"name", stage.name}, {"launches", stage.launches}, {"ns_per_ray", ns}});
        if (profile)
          std::printf("    %-36s %7.1f ns/ray  %6llu launches\n", stage.name.c_str(), ns,
                      static_cast<unsigned long long>(stage.launches));
      }
      report["rows"].push_back(row);
    }
  }
  std::filesystem::create_directories("out/bench");
  std::ofstream(out) << report.dump(2) << '\n';
  return agree ? 0 : 1;
}
