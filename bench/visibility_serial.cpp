/// The engine `serial` against the device's own arithmetic: ray/triangle tests a second, and the share that
/// their floating-point operations are of the rate at which the same device multiplies and adds in registers
/// (no contraction: no program of this project has it). Masks are compared with those of one-ray packets
/// before anything is timed.
///     bench_visibility_serial [-o FILE] [--device D] [--cores N] [--repeats N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "clrad/visibility.hpp"

namespace {

using namespace clrad;
using Clock = std::chrono::steady_clock;

// Floating-point operations of kernels/visibility/serial.cl (additions, multiplications, minima, maxima,
// comparisons; signs and bit operations are not counted). Per test: three dot products, least and most, the
// bound, two comparisons.
constexpr double operations_per_test = 3 * 5 + 4 + 1 + 2;
// Per origin and triangle, shared by the samples of a chunk: two differences, norm, side and its bound,
// comparisons, three cross products, the scale of the bound. Per sample and triangle, shared by the lanes of
// a packet: its side.
constexpr double operations_per_origin = 9 + 9 + 2 + 5 + 2 + 2 + 27 + 3;
constexpr double operations_per_sample = 9 + 2 + 5 + 2 + 2;
constexpr double chunk = 16;

// Sixteen independent chains, half multiplying and half adding, kept in registers.
constexpr char peak_source[] = R"(
#pragma OPENCL FP_CONTRACT OFF
#if WIDTH == 1
typedef float floats;
#define SUM(v) (v)
#else
#define PASTE_2(a, b) a##b
#define PASTE(a, b) PASTE_2(a, b)
typedef PASTE(float, WIDTH) floats;
#define SUM(v) (v).s0
#endif
__kernel void peak(__global float* out, uint rounds, float factor, float step) {
  floats m0 = 1.0f, m1 = 1.1f, m2 = 1.2f, m3 = 1.3f, m4 = 1.4f, m5 = 1.5f, m6 = 1.6f, m7 = 1.7f;
  floats a0 = 0.0f, a1 = 0.1f, a2 = 0.2f, a3 = 0.3f, a4 = 0.4f, a5 = 0.5f, a6 = 0.6f, a7 = 0.7f;
  const floats f = factor, s = step;
  for (uint i = 0; i < rounds; ++i) {
    m0 *= f; m1 *= f; m2 *= f; m3 *= f; m4 *= f; m5 *= f; m6 *= f; m7 *= f;
    a0 += s; a1 += s; a2 += s; a3 += s; a4 += s; a5 += s; a6 += s; a7 += s;
  }
  const floats all = m0 + m1 + m2 + m3 + m4 + m5 + m6 + m7 + a0 + a1 + a2 + a3 + a4 + a5 + a6 + a7;
  out[get_global_id(0)] = SUM(all);
}
)";

double seconds_of(Device& device, const auto& work) {
  device.finish();
  const auto start = Clock::now();
  work();
  device.finish();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Times {
  double median_s, min_s, mad_s;
};
double middle(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}
Times times(std::vector<double> s) {
  const double median = middle(s), least = *std::min_element(s.begin(), s.end());
  for (double& x : s) x = std::abs(x - median);
  return {median, least, middle(s)};
}

/// Lane operations a second of multiplications and additions in registers.
class Peak {
 public:
  explicit Peak(Device& device)
      : device_(device),
        items_(std::max(1u, device.info().compute_units) * (device.info().gpu ? 4096 : 16)),
        out_(device, items_, "peak") {
    const unsigned width = device.options().packet_width;
    cl::Program program(device.context(), std::string(peak_source));
    program.build(fmt::format("-cl-std=CL1.2 -DWIDTH={}", width).c_str());
    kernel_ = cl::Kernel(program, "peak");
    kernel_.setArg(0, out_.buffer());
    kernel_.setArg(1, rounds_);
    kernel_.setArg(2, 0.999999f);
    kernel_.setArg(3, 1e-6f);
    operations_ = 16.0 * rounds_ * double(items_) * width;
    measure();
  }
  double measure() {
    const std::size_t local = device_.info().gpu ? 128 : 1;
    return operations_ / seconds_of(device_, [&] {
             device_.queue().enqueueNDRangeKernel(kernel_, cl::NullRange, cl::NDRange(items_),
                                                  cl::NDRange(local));
           });
  }

 private:
  static constexpr std::uint32_t rounds_ = 1u << 17;
  Device& device_;
  std::uint64_t items_;
  Array<float> out_;
  cl::Kernel kernel_;
  double operations_ = 0;
};

struct Scene {
  std::string name;
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> origins, targets;
};

/// Receivers at z = -1, samples at z = 1, small triangles between that face along z: every test is made (no
/// plane has all its samples and origins on one side) and few hit.
Scene scattered(std::size_t triangles, std::size_t origins, std::size_t samples) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> in(-1, 1);
  Scene scene{fmt::format("scattered, {} triangles, {} samples", triangles, samples), {}, {}, {}};
  for (std::size_t i = 0; i < triangles; ++i) {
    OccluderTriangle t;
    const glm::dvec3 middle{in(random), in(random), 0.5 * in(random)};
    for (glm::dvec3& corner : t.corner)
      corner = middle + 0.005 * glm::dvec3{in(random), in(random), 0.1 * in(random)};
    t.plane = std::uint32_t(i);
    scene.triangles.push_back(t);
  }
  for (std::size_t i = 0; i < origins; ++i) scene.origins.push_back({{in(random), in(random), -1}});
  for (std::size_t i = 0; i < samples; ++i)
    scene.targets.push_back({{0.2 * in(random), 0.2 * in(random), 1}});
  return scene;
}

void add_box(Scene& scene, const glm::dvec3& low, const glm::dvec3& high, double turn) {
  const auto corner = [&](int i) {
    const glm::dvec3 p{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    const glm::dvec3 c = 0.5 * (low + high);
    return glm::dvec3{c.x + (p.x - c.x) * std::cos(turn) - (p.y - c.y) * std::sin(turn),
                      c.y + (p.x - c.x) * std::sin(turn) + (p.y - c.y) * std::cos(turn), p.z};
  };
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    const auto plane = std::uint32_t(scene.triangles.size() / 2);
    scene.triangles.push_back({{corner(f[0]), corner(f[1]), corner(f[2])}, plane, plane});
    scene.triangles.push_back({{corner(f[0]), corner(f[2]), corner(f[3])}, plane, plane});
  }
}

/// A closed room with two blocks, receivers on its floor and a light under its ceiling: what users solve.
Scene room(std::size_t origins, std::size_t samples) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> in(-1, 1);
  Scene scene{fmt::format("room with two blocks, 36 triangles, {} samples", samples), {}, {}, {}};
  add_box(scene, {-1, -1, -1}, {1, 1, 1}, 0);
  add_box(scene, {-0.6, -0.1, -1}, {0, 0.5, 0.2}, 0.3);
  add_box(scene, {0.1, -0.6, -1}, {0.7, 0, -0.4}, -0.3);
  for (std::size_t i = 0; i < origins; ++i)
    scene.origins.push_back({{in(random), in(random), -1}, {0, 0, 1}, 4});
  for (std::size_t i = 0; i < samples; ++i)
    scene.targets.push_back({{0.2 * in(random), 0.2 * in(random), 0.99}});
  // Neighbours in the array are neighbours on the floor, as on a mesh.
  std::sort(scene.origins.begin(), scene.origins.end(), [](const Point& a, const Point& b) {
    const int row_a = int((a.position.y + 1) * 32), row_b = int((b.position.y + 1) * 32);
    return row_a != row_b ? row_a < row_b : a.position.x < b.position.x;
  });
  return scene;
}

struct Bench {
  Scene scene;
  std::unique_ptr<VisibilityEngine> engine;
  PointArray origins, targets;
  Array<std::uint32_t> masks;
  Segments segments;

  Bench(Device& device, Scene made)
      : scene(std::move(made)),
        engine(make_engine("serial", device, scene.triangles)),
        origins(device, scene.origins, "origins"),
        targets(device, scene.targets, "targets") {
    segments = {&origins, nullptr, std::uint32_t(scene.origins.size()), &targets,
                std::uint32_t(scene.targets.size())};
    masks = Array<std::uint32_t>(device, segments.origin_count * std::uint64_t(segments.words_per_origin()),
                                 "masks");
  }
};

}  // namespace

int main(int argc, char** argv) try {
  std::string file = "out/bench/visibility_serial.json";
  DeviceOptions options;
  int repeats = 9;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string flag = argv[i];
    if (flag == "-o")
      file = argv[i + 1];
    else if (flag == "--device")
      options.device = argv[i + 1];
    else if (flag == "--cores")
      options.cores = unsigned(std::atoi(argv[i + 1]));
    else if (flag == "--repeats")
      repeats = std::max(1, std::atoi(argv[i + 1]));
    else
      throw UsageError(fmt::format("unknown option {}", flag));
  }
  Device device(options);
  DeviceOptions narrow = options;
  narrow.packet_width = 1;
  Device scalar(narrow);
  Peak peak(device);
  const unsigned width = device.options().packet_width;
  const double operations =
      operations_per_test + operations_per_origin / chunk + operations_per_sample / width;

  nlohmann::json report{{"schema", "clrad-bench-1"},
                        {"bench", "visibility_serial"},
                        {"device", device.info().name},
                        {"driver", device.info().driver},
                        {"cores", device.options().cores},
                        {"packet_width", width},
                        {"repeats", repeats},
                        {"operations_per_test", operations},
                        {"rows", nlohmann::json::array()}};
  fmt::print("{} ({}), packets of {}, {:.1f} operations a test\n", device.info().name, device.info().driver,
             width, operations);
  fmt::print("{:<48}{:>12}{:>12}{:>14}{:>14}{:>10}\n", "scene", "ms median", "ms min", "M tests/s",
             "Goperations/s", "of peak");
  for (Scene& scene :
       std::vector<Scene>{scattered(2000, 4096, 16), scattered(2000, 4096, 64), room(65536, 16)}) {
    const bool counted = scene.name.starts_with("scattered");
    Bench fast(device, scene), slow(scalar, scene);
    fast.engine->occluded(fast.segments, fast.masks);
    slow.engine->occluded(slow.segments, slow.masks);
    if (fast.masks.download() != slow.masks.download())
      throw DeviceError("packets and single rays disagree: " + scene.name);
    std::vector<double> seconds, peaks;
    for (int i = 0; i < repeats; ++i) {  // alternately, so that both see the same machine
      peaks.push_back(peak.measure());
      seconds.push_back(seconds_of(device, [&] { fast.engine->occluded(fast.segments, fast.masks); }));
    }
    const Times t = times(seconds);
    const double tests = double(fast.segments.count()) * double(scene.triangles.size());
    const double rate = tests / t.median_s, ratio = rate * operations / middle(peaks);
    nlohmann::json row{{"scene", scene.name},
                       {"rays", fast.segments.count()},
                       {"triangles", scene.triangles.size()},
                       {"ms_median", t.median_s * 1e3},
                       {"ms_min", t.min_s * 1e3},
                       {"ms_mad", t.mad_s * 1e3},
                       {"tests_per_s", rate},
                       {"rays_per_s", double(fast.segments.count()) / t.median_s},
                       {"peak_operations_per_s", middle(peaks)},
                       {"exact_pairs", fast.engine->counts().exact}};
    // In the room most tests are settled for a whole packet by the side of the plane: no operations to count.
    if (counted) row["share_of_peak"] = ratio;
    fmt::print("{:<48}{:>12.2f}{:>12.2f}{:>14.0f}", scene.name, t.median_s * 1e3, t.min_s * 1e3, rate * 1e-6);
    if (counted) fmt::print("{:>14.1f}{:>9.0f}%", rate * operations * 1e-9, 100 * ratio);
    fmt::print("\n");
    report["rows"].push_back(row);
  }
  if (const auto folder = std::filesystem::path(file).parent_path(); !folder.empty())
    std::filesystem::create_directories(folder);
  std::ofstream(file) << report.dump(2) << '\n';
  fmt::print("wrote {}\n", file);
} catch (const std::exception& e) {
  fmt::print(stderr, "bench_visibility_serial: {}\n", e.what());
  return 1;
}
