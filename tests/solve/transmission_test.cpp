// Light that passes glass on its way from surface to surface.
#include "solve/transmission.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>

#include "clrad/clrad.hpp"
#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

Material diffuse(const std::vector<double>& rho, const std::vector<double>& emitted) {
  Material m;
  m.name = "diffuse";
  m.reflectance = rho, m.emitted_exitance = emitted;
  return m;
}

Material glass_of(const std::vector<double>& transmission, double ior) {
  Material m;
  m.name = "pane";
  m.reflectance.assign(transmission.size(), 0), m.emitted_exitance.assign(transmission.size(), 0);
  m.transmission = transmission, m.ior = ior;
  return m;
}

// A square of half size `half` about (0, 0, z), facing up or down.
Polygon level_square(double half, double z, bool up, std::uint32_t material, double x = 0) {
  Polygon p;
  p.corners = 4, p.material = material;
  const glm::dvec3 c[4] = {
      {x - half, -half, z}, {x + half, -half, z}, {x + half, half, z}, {x - half, half, z}};
  for (int k = 0; k < 4; ++k) p.corner[up ? k : 3 - k] = c[k];
  return p;
}

// Materials 0: the lamp, 1: what receives, 2, ..: panes at heights `at` between them.
struct Plates {
  Scene scene;
  Plates(const std::vector<double>& rho, const std::vector<Material>& panes, const std::vector<double>& at) {
    scene.file = "plates";
    for (std::size_t b = 0; b < rho.size(); ++b) scene.bands.push_back(std::to_string(b));
    scene.materials = {diffuse(rho, std::vector<double>(rho.size(), 1.0)),
                       diffuse(rho, std::vector<double>(rho.size(), 0.0))};
    scene.polygons = {level_square(0.5, 1, false, 0), level_square(0.5, 0, true, 1)};
    for (std::size_t k = 0; k < panes.size(); ++k) {
      scene.polygons.push_back(level_square(2, at[k], true, std::uint32_t(2 + k)));
      scene.materials.push_back(panes[k]);
    }
  }
};

// (1 - R) / (1 + R) of a sheet at angle i, by the sines and tangents of Fresnel's own form (Born & Wolf 1.5).
double sheet_passes(double ior, double cosine) {
  const double i = std::acos(std::min(1.0, cosine)), t = std::asin(std::sin(i) / ior);
  double r = std::pow((ior - 1) / (ior + 1), 2);
  if (i > 1e-6) {
    const double s = std::sin(i - t) / std::sin(i + t), p = std::tan(i - t) / std::tan(i + t);
    r = 0.5 * (s * s + p * p);
  }
  return (1 - r) / (1 + r);
}

// Form factor of a point in z = 0 facing up to the lamp, x what `passes` says at each cosine, by the midpoint rule: with 128 x 128
// points at a distance of 1 its error is below 1e-5 of the integral.
double lamp_factor(const glm::dvec3& p, const std::function<double(double)>& passes) {
  constexpr int n = 128;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const glm::dvec3 r = glm::dvec3((i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5, 1) - p;
      const double r2 = glm::dot(r, r), cosine = r.z / std::sqrt(r2);
      sum += cosine * cosine / (std::numbers::pi * r2) / (n * n) * passes(cosine);
    }
  return sum;
}

SolveOptions plate_options() {
  SolveOptions o;
  o.mesh = {1.0, 0.25};
  o.samples = 64, o.light_samples = 64;
  o.converge = 1e-6;
  return o;
}

// What the receiving plate's vertices get, [vertex][band], and where they are.
struct Received {
  std::vector<std::vector<double>> irradiance;
  std::vector<glm::dvec3> at;
};
Received received(const Solution& s, std::uint32_t polygon = 1) {
  Received r;
  const PolygonMesh& m = s.mesh.polygons[polygon];
  for (std::uint32_t v = m.first_vertex; v < m.first_vertex + m.vertices; ++v) {
    auto& h = r.irradiance.emplace_back();
    for (std::uint32_t b = 0; b < s.bands; ++b) h.push_back(s.vertex_irradiance[b * s.vertex_count() + v]);
    r.at.push_back(s.frame.from_frame(s.mesh.receivers[v].position));
  }
  return r;
}

const StageProfile* stage_of(const Report& report, const std::string& name) {
  for (const StageProfile& s : report.stages)
    if (s.name == name) return &s;
  return nullptr;
}
constexpr const char* glass_stage = "multiply by what glass lets pass";

const Effect& effect_of(const std::vector<Effect>& effects, const std::string& name) {
  return *std::find_if(effects.begin(), effects.end(), [&](const Effect& e) { return e.name == name; });
}

// The plates are black, so what arrives is the lamp's light through the pane: F x the mean of T, weighted like F. T is sampled at 64
// stratified points; over the lamp it varies between T(worst) and T(0), so independent samples would have a standard error of
// at most half that difference / 8, and four of them are allowed. Sensors take thousands of rays.
TEST(Transmission, BetweenPlatesIsTheIntegralOfFresnel) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    for (const double ior : {1.1, 1.5, 2.4}) {
      const Plates plates({0.0}, {glass_of({0.9}, ior)}, {0.5});
      SolveOptions options = plate_options();
      options.sensors = {{{0, 0, 0}, {0, 0, 1}}, {{0.45, -0.3, 0.2}, {0, 0, 1}}};
      const Solution s = solve(device, plates.scene, options);
      const auto passes = [&](double cosine) { return 0.9 * sheet_passes(ior, cosine); };
      const Received r = received(s);
      ASSERT_GE(r.at.size(), 25u);
      for (std::size_t v = 0; v < r.at.size(); ++v) {
        const glm::dvec3 p(r.at[v].x, r.at[v].y, 0);
        const double f = lamp_factor(p, [](double) { return 1; });
        const double least =
            1 / std::sqrt(1 + std::pow(std::abs(p.x) + 0.5, 2) + std::pow(std::abs(p.y) + 0.5, 2));
        const double tolerance = f * (2.0 / 8 * (passes(1) - passes(least)) + 2e-5);
        EXPECT_NEAR(r.irradiance[v][0], lamp_factor(p, passes), tolerance) << ior << " " << p.x << " " << p.y;
      }
      const double middle = lamp_factor({0, 0, 0}, passes);
      EXPECT_NEAR(s.sensors[0].irradiance[0], middle, 1e-4 * middle) << ior;
      EXPECT_TRUE(effect_of(s.report.effects, "transmission").runs);
      ASSERT_NE(stage_of(s.report, glass_stage), nullptr);
      EXPECT_GT(stage_of(s.report, glass_stage)->launches, 0u);
      for (const Invariant& i : s.report.invariants) EXPECT_TRUE(i.holds) << i.name;
    }
  }
}

// A pane of nothing (index 1, all passes) is not there. Rounding: R is below 1e-9 at these angles, T rounds once or twice.
TEST(Transmission, APaneOfAirChangesNothing) {
  Device device;
  for (const Estimator estimator : {Estimator::exact, Estimator::disk, Estimator::subdisk}) {
    SolveOptions options = plate_options();
    options.estimator = estimator;
    const Plates without({0.5}, {}, {}), with({0.5}, {glass_of({1}, 1)}, {0.5});
    // The mesh and the frame are to be the same: a pane of the lamp's own size.
    Scene scene = with.scene;
    scene.polygons[2] = level_square(0.5, 0.5, true, 2);
    const Received open = received(solve(device, without.scene, options)),
                   pane = received(solve(device, scene, options));
    ASSERT_EQ(open.at.size(), pane.at.size());
    for (std::size_t v = 0; v < open.at.size(); ++v)
      EXPECT_NEAR(pane.irradiance[v][0], open.irradiance[v][0], 4e-6 * open.irradiance[v][0]);
  }
}

// Panes of index 1 take no more than their transmission, whatever the angle: shares multiply exactly, also of samples that are
// decided late or lie in edges. Two panes in one plane that meet in the middle are one.
TEST(Transmission, PanesMultiplyAndAPaneOfPartsCountsOnce) {
  Device device;
  for (const Estimator estimator : {Estimator::exact, Estimator::disk}) {
    SolveOptions options = plate_options();
    options.estimator = estimator;
    options.sensors = {{{0, 0, 0}, {0, 0, 1}}, {{0, 0, 0.3}, {0, 1, 1}}};
    const auto solved = [&](const std::vector<double>& shares, const std::vector<double>& at, bool parts) {
      std::vector<Material> panes;
      for (const double t : shares) panes.push_back(glass_of({t}, 1));
      Plates plates({0.0}, panes, at);
      if (parts) {  // x < 0 and x > 0, in place of the first pane, and one of them once more, back to back
        plates.scene.polygons[2] = level_square(1, at[0], true, 2, -1);
        plates.scene.polygons.push_back(level_square(1, at[0], true, 2, 1));
        plates.scene.polygons.push_back(level_square(1, at[0], false, 2, 1));
        for (Polygon& p : plates.scene.polygons)
          if (p.material == 2)
            for (glm::dvec3& c : p.corner) c.y *= 2;
      }
      return solve(device, plates.scene, options);
    };
    const Solution clear = solved({1.0}, {0.5}, false);
    const auto expect = [&](const Solution& s, double share) {
      const Received a = received(clear), b = received(s);
      for (std::size_t v = 0; v < a.at.size(); ++v)
        EXPECT_NEAR(b.irradiance[v][0], share * a.irradiance[v][0], 4e-6 * a.irradiance[v][0]);
      EXPECT_NEAR(s.sensors[0].irradiance[0], share * clear.sensors[0].irradiance[0], 1e-5);
    };
    expect(solved({0.5}, {0.5}, false), 0.5);
    expect(solved({0.5, 0.25}, {0.5, 0.7}, false), 0.125);
    expect(solved({0.5}, {0.5}, true), 0.5);
  }
}

// Single segments, on purpose through diagonals, shared edges and corners, and at random through many panes at all angles.
class GlassSegments : public ::testing::TestWithParam<Precision> {
 protected:
  GlassSegments() : device_({.precision = GetParam()}) {}
  // passes of segments a[i] - b[i], bands one after the other.
  std::vector<double> passes(const Scene& scene, const std::vector<glm::dvec3>& a,
                             const std::vector<glm::dvec3>& b,
                             const std::vector<std::uint32_t>& blocked = {}) {
    const Frame frame = frame_of(scene);
    const Glass glass(device_, scene, occluder_triangles(scene, frame, plane_ids(scene)));
    std::vector<Point> from, to;
    for (const glm::dvec3& p : a) from.push_back({frame.to_frame(p), {0, 0, 1}});
    for (const glm::dvec3& p : b) to.push_back({frame.to_frame(p), {0, 0, 1}});
    const PointArray origins(device_, from, "from"), ends(device_, to, "to");
    Array<std::uint32_t> masks(device_, a.size(), "masks");
    masks.fill_zero();
    if (!blocked.empty()) masks.upload(blocked);
    return glass.pass_pairs({&origins, nullptr, std::uint32_t(a.size()), &ends, 0}, masks).download();
  }
  Device device_;
};

TEST_P(GlassSegments, DiagonalsEdgesAndCornersCountOnce) {
  Scene scene;
  scene.bands = {"a", "b"};
  scene.materials = {glass_of({0.5, 0.25}, 1), glass_of({0.75, 0.125}, 1)};
  // Four squares that meet at the origin; the last two are of the other glass.
  for (int k = 0; k < 4; ++k) {
    Polygon p = level_square(0.5, 0, true, k / 2);
    for (glm::dvec3& c : p.corner) c += glm::dvec3(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, 0);
    scene.polygons.push_back(p);
  }
  const std::vector<glm::dvec3> a = {{-0.5, -0.5, 1}, {-0.25, -0.25, 1}, {0, -0.5, 1}, {0, 0, 1},
                                     {0.5, 0, 1},     {-0.6, -0.7, -1},  {3, 3, 1},    {-0.5, -0.5, 1}};
  std::vector<glm::dvec3> b = a;
  for (glm::dvec3& p : b) p.z = -p.z;
  b[7] = {-0.5, -0.5, 0.5};  // does not get there
  const std::size_t n = a.size();
  const std::vector<double> found = passes(scene, a, b);
  // Middle of a diagonal, elsewhere on it, an edge of two alike, and where the upper in the file decides: corner and edge.
  const double first[] = {0.5, 0.5, 0.5, 0.75, 0.75, 0.5, 1, 1},
               second[] = {0.25, 0.25, 0.25, 0.125, 0.125, 0.25, 1, 1};
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_NEAR(found[i], first[i], 1e-6) << i;
    EXPECT_NEAR(found[n + i], second[i], 1e-6) << i;
  }
  // What is blocked is not looked at.
  EXPECT_EQ(passes(scene, a, b, std::vector<std::uint32_t>(n, 1)), std::vector<double>(2 * n, 1));
}

// 80 triangles of three kinds of glass in general position and a solid; 2000 segments. The oracle tests in doubles, in which no
// segment is near an edge by less than 1e-9 (checked). A pass is (1 - R) of rounded numbers: cos i of a difference good to
// 2^-22 and a normal good to 2^-24 is off by some 2^-22, and d(1 - R)/d(cos i) is below 8, but for grazing (cos i < 0.05: left
// out); so 2^-19 for each of at most a dozen surfaces.
TEST_P(GlassSegments, ManySurfacesAtAllAngles) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> at(-1, 1);
  Scene scene;
  scene.bands = {"a"};
  scene.materials = {glass_of({0.9}, 1.5), glass_of({0.8}, 1.2), glass_of({1}, 2)};
  for (int k = 0; k < 80; ++k) {
    Polygon p;
    p.corners = 3, p.material = std::uint32_t(k % 3);
    const glm::dvec3 middle(at(random), at(random), at(random));
    for (int c = 0; c < 3; ++c) p.corner[c] = middle + 0.5 * glm::dvec3(at(random), at(random), at(random));
    scene.polygons.push_back(p);
  }
  std::vector<glm::dvec3> a, b;
  for (int k = 0; k < 2000; ++k)
    a.emplace_back(at(random), at(random), at(random)), b.emplace_back(at(random), at(random), at(random));
  const std::vector<double> found = passes(scene, a, b);
  std::size_t crossings = 0, compared = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    double expected = 1, surfaces = 0;
    bool clear = true;
    const glm::dvec3 d = b[i] - a[i];
    for (const Polygon& p : scene.polygons) {
      const glm::dvec3 n = p.normal();
      const double t = glm::dot(p.corner[0] - a[i], n) / glm::dot(d, n);
      if (!(t > 0 && t < 1)) continue;
      const glm::dvec3 x = a[i] + t * d;
      double least = 1;
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 e = p.corner[(c + 1) % 3] - p.corner[c];
        least = std::min(least, glm::dot(glm::cross(e, x - p.corner[c]), n));
      }
      clear &= std::abs(least) > 1e-9;
      if (least < 0) continue;
      const double cosine = std::abs(glm::dot(glm::normalize(d), n));
      clear &= cosine > 0.05;
      const Material& m = scene.materials[p.material];
      expected *= m.transmission[0] * sheet_passes(m.ior, cosine);
      ++surfaces;
    }
    if (!clear) continue;
    EXPECT_NEAR(found[i], expected, std::ldexp(surfaces + 1, -19)) << i;
    crossings += std::size_t(surfaces), ++compared;
  }
  EXPECT_GT(compared, 1500u);
  EXPECT_GT(crossings, 1500u);
}

INSTANTIATE_TEST_SUITE_P(Precisions, GlassSegments,
                         ::testing::Values(Precision::float32, Precision::float64));

// Through a solid of glass: two faces of R each, by the angle outside.
TEST(Transmission, ASolidTakesItsShareAtBothFaces) {
  Device device;
  const double ior = 1.5, t = 0.95;
  Plates plates({0.0}, {glass_of({t}, ior)}, {0.5});
  plates.scene.polygons.pop_back();
  const Scene block = oracle::box_scene({4, 4, 0.4}, {0.0}, {0.0});
  for (Polygon p : block.polygons) {
    std::swap(p.corner[1], p.corner[3]);  // outward
    for (glm::dvec3& c : p.corner) c += glm::dvec3(-2, -2, 0.3);
    p.material = 2;
    plates.scene.polygons.push_back(p);
  }
  SolveOptions options = plate_options();
  options.sensors = {{{0, 0, 0}, {0, 0, 1}}};
  const Solution s = solve(device, plates.scene, options);
  const double expected = lamp_factor({0, 0, 0}, [&](double cosine) {
    const double both = sheet_passes(ior, cosine);  // (1 - R) / (1 + R)
    const double r = (1 - both) / (1 + both);
    return t * t * (1 - r) * (1 - r);
  });
  EXPECT_NEAR(s.sensors[0].irradiance[0], expected, 1e-4 * expected);
}

// A room in a glass pane's light: the block room with a coloured pane above its block.
Scene room_with_pane(const std::vector<double>& transmission) {
  Scene scene = oracle::block_room();
  scene.materials.push_back(glass_of(transmission, 1.5));
  Polygon pane;
  pane.corners = 4, pane.material = std::uint32_t(scene.materials.size() - 1);
  pane.name = "pane";
  const glm::dvec3 c[4] = {{0.3, 0.4, 1.6}, {3.1, 0.4, 1.6}, {3.1, 2.7, 1.8}, {0.3, 2.7, 1.8}};
  std::copy(c, c + 4, pane.corner.begin());
  scene.polygons.push_back(pane);
  return scene;
}

SolveOptions room_options() {
  SolveOptions o;
  o.mesh = {1.0, 0.5};
  o.converge = 1e-4;
  o.sensors = {{{1, 1, 0.5}, {0, 0, 1}}, {{2, 1.5, 2}, {0, 0, -1}}};
  return o;
}

void expect_same(const Solution& a, const Solution& b) {
  EXPECT_EQ(a.vertex_irradiance, b.vertex_irradiance);
  EXPECT_EQ(a.patch_irradiance, b.patch_irradiance);
  for (std::size_t i = 0; i < a.sensors.size(); ++i)
    EXPECT_EQ(a.sensors[i].irradiance, b.sensors[i].irradiance);
}

TEST(Transmission, AllEnginesGiveTheSameBits) {
  Device device;
  SolveOptions options = room_options();
  options.engine = "serial";
  const Scene scene = room_with_pane({0.9, 0.5, 0.1});
  const Solution serial = solve(device, scene, options);
  for (const char* engine : {"chop", "shaft"}) {
    options.engine = engine;
    expect_same(solve(device, scene, options), serial);
  }
  Device narrow({.work_group_size = 32, .packet_width = 4});
  options.engine = "auto";
  expect_same(solve(narrow, scene, options), serial);
}

// Each band by itself, in a grey scene with the pane's share of that band. Both solves leave at most 1e-4 of the light unshot, which
// they leave in different places: 4e-4 of the mean; 1e-5 for sums in another order.
TEST(Transmission, EachBandIsThatOfGreyGlass) {
  Device device;
  const std::vector<double> shares = {0.9, 0.5, 0.1};
  const SolveOptions options = room_options();
  const Scene scene = room_with_pane(shares);
  const Solution coloured = solve(device, scene, options);
  for (std::uint32_t b = 0; b < 3; ++b) {
    Scene grey = scene;
    grey.bands = {"grey"};
    for (Material& m : grey.materials) {
      m.reflectance = {m.reflectance[b]}, m.emitted_exitance = {m.emitted_exitance[b]};
      if (m.is_glass()) m.transmission = {m.transmission[b]};
    }
    const Solution one = solve(device, grey, options);
    const std::size_t n = one.vertex_irradiance.size();
    ASSERT_EQ(coloured.vertex_irradiance.size(), 3 * n);
    double mean = 0;
    for (const double h : one.vertex_irradiance) mean += h / double(n);
    for (std::size_t v = 0; v < n; ++v)
      ASSERT_NEAR(coloured.vertex_irradiance[b * n + v], one.vertex_irradiance[v], 5e-4 * mean)
          << b << " " << v;
    // Rays are shared out by what all bands bring together, so they are others: by their standard errors.
    for (std::size_t i = 0; i < 2; ++i) {
      const auto &x = coloured.sensors[i], &y = one.sensors[i];
      EXPECT_NEAR(x.irradiance[b], y.irradiance[0],
                  4 * std::hypot(x.irradiance_error[b], y.irradiance_error[0]) + 5e-4 * mean);
    }
  }
}

TEST(Transmission, SolversAgree) {
  Device device;
  const Scene scene = room_with_pane({0.9, 0.5, 0.1});
  SolveOptions options = room_options();
  options.converge = 1e-5;
  const Solution shot = solve(device, scene, options);
  double mean = 0;
  for (const double h : shot.vertex_irradiance) mean += h / double(shot.vertex_irradiance.size());
  for (const Solver solver : {Solver::gathering, Solver::gauss_seidel}) {
    options.solver = solver;
    const Solution other = solve(device, scene, options);
    double sum = 0;
    for (std::size_t i = 0; i < shot.vertex_irradiance.size(); ++i)
      sum += std::abs(other.vertex_irradiance[i] - shot.vertex_irradiance[i]) /
             double(shot.vertex_irradiance.size());
    EXPECT_LT(sum, 3e-5 * mean);
  }
}

// Columns that memory does not hold are traced again, with the same bits.
TEST(Transmission, LittleMemoryGivesTheSameBits) {
  const Scene scene = room_with_pane({0.9, 0.5, 0.1});
  SolveOptions options = room_options();
  options.sensors.clear();
  options.mesh = {1.0, 0.25};
  options.error = false;  // half of what that takes would hold the columns
  Device device;
  const Solution roomy = solve(device, scene, options);
  Device small({.memory_bytes = roomy.report.device_peak_bytes / 2});
  const Solution tight = solve(small, scene, options);
  EXPECT_GT(tight.report.rays, roomy.report.rays);
  expect_same(tight, roomy);
}

TEST(Transmission, AdaptiveSolvesGoOnFromACheckpoint) {
  Device device;
  const Scene scene = room_with_pane({0.9, 0.5, 0.1});
  SolveOptions options = room_options();
  options.adaptive.tolerance = 0.05, options.adaptive.max_level = 2, options.adaptive.every = 8;
  const Solution whole = solve(device, scene, options);
  EXPECT_GT(whole.report.refinement.vertices_added, 0u);
  const std::string file =
      (std::filesystem::temp_directory_path() / ("clrad_glass_" + std::to_string(::getpid()))).string();
  for (const int calls : {12, 40}) {
    SolveOptions first = options;
    first.checkpoint = file, first.checkpoint_every_s = 0;
    int left = calls;
    first.progress = [&](const Progress&) { return left-- > 0; };
    ASSERT_TRUE(solve(device, scene, first).stopped);
    SolveOptions rest = options;
    rest.resume = file;
    expect_same(solve(device, scene, rest), whole);
    // Without the light through glass it is another solve.
    rest.without = {"transmission"};
    EXPECT_THROW(solve(device, scene, rest), InputError);
  }
  std::filesystem::remove(file);
}

TEST(Transmission, ForceAndWithout) {
  Device device;
  SolveOptions options = room_options();
  // A scene without glass: nothing runs, and forcing it changes no bit.
  const Scene plain = oracle::block_room();
  const Solution skipped = solve(device, plain, options);
  const Effect& effect = effect_of(skipped.report.effects, "transmission");
  EXPECT_FALSE(effect.needed);
  EXPECT_FALSE(effect.runs);
  EXPECT_EQ(effect.skip_error_relative, 0);
  EXPECT_EQ(stage_of(skipped.report, glass_stage), nullptr);
  options.force_effects = {"transmission"};
  const Solution forced = solve(device, plain, options);
  EXPECT_NE(stage_of(forced.report, glass_stage), nullptr);
  expect_same(forced, skipped);
  EXPECT_EQ(forced.report.closure.applied, skipped.report.closure.applied);

  // One with glass, left out: the pane is opaque, and the report says so.
  options.force_effects.clear(), options.without = {"transmission"};
  device.reset_profile();
  const Scene scene = room_with_pane({0.9, 0.9, 0.9});
  const Solution without = solve(device, scene, options);
  EXPECT_TRUE(effect_of(without.report.effects, "transmission").needed);
  EXPECT_FALSE(effect_of(without.report.effects, "transmission").runs);
  EXPECT_EQ(stage_of(without.report, glass_stage), nullptr);
  ASSERT_FALSE(without.report.warnings.empty());
  EXPECT_NE(without.report.warnings[0].find("transmission was left out"), std::string::npos);
  Scene opaque = scene;
  for (Material& m : opaque.materials) m.transmission.clear();
  options.without.clear();
  expect_same(solve(device, opaque, options), without);
}

// A window in a room's outer wall: with nothing outside it is as good as a black wall, proven, and forcing the effect changes
// no bit; with a lamp outside, it lets light in, the room is not closed, and no invariant is violated by what is lost.
TEST(Transmission, AWindowOfAClosedRoom) {
  Device device;
  Scene room = oracle::box_scene({2, 2, 2}, {0.5}, {0.0});
  room.materials[0].name = "wall";
  room.materials.push_back(diffuse({0}, {1}));
  room.materials.push_back(glass_of({0.9}, 1.5));
  room.polygons[5].material = 1;  // the ceiling shines
  room.polygons[0].material = 2;
  room.polygons[0].name = "window";
  SolveOptions options;
  options.mesh = {1.0, 0.5};
  options.converge = 1e-4;
  const Solution dark = solve(device, room, options);
  const Effect& effect = effect_of(dark.report.effects, "transmission");
  EXPECT_FALSE(effect.needed);
  EXPECT_EQ(effect.skip_error_relative, 0);
  EXPECT_NE(effect.reason.find("nothing is behind"), std::string::npos) << effect.reason;
  EXPECT_TRUE(dark.report.closure.proven);
  EXPECT_TRUE(dark.report.warnings.empty());
  options.force_effects = {"transmission"};
  expect_same(solve(device, room, options), dark);
  options.force_effects.clear();

  room.polygons.push_back(level_square(1, 0, true, 1));
  for (glm::dvec3& c : room.polygons.back().corner) c = {-1, c.x + 1, c.y + 1};  // x = -1, facing the window
  const Solution lit = solve(device, room, options);
  EXPECT_TRUE(effect_of(lit.report.effects, "transmission").needed);
  EXPECT_NE(effect_of(lit.report.effects, "transmission").reason.find("\"pane\""), std::string::npos);
  EXPECT_FALSE(lit.report.closure.proven);
  EXPECT_NE(lit.report.closure.reason.find("window"), std::string::npos) << lit.report.closure.reason;
  EXPECT_TRUE(lit.report.warnings.empty());
  const auto mean = [](const Solution& s, std::uint32_t polygon) {
    return polygon_means(s)[polygon].irradiance[0];
  };
  EXPECT_GT(mean(lit, 1), 1.05 * mean(dark, 1));  // the wall across
  EXPECT_GT(lit.report.energy.unaccounted[0], 0);
}

// Under and behind glass, surfaces are not covered; what glass lies on is opaque as ever.
TEST(Transmission, WhatStandsUnderGlassIsSeen) {
  Device device;
  Plates plates({0.0}, {glass_of({1}, 1)}, {0.5});
  plates.scene.polygons.pop_back();
  const Scene block = oracle::box_scene({4, 4, 0.4}, {0.0}, {0.0});
  for (Polygon p : block.polygons) {  // a block of glass that holds the receiver
    std::swap(p.corner[1], p.corner[3]);
    for (glm::dvec3& c : p.corner) c += glm::dvec3(-2, -2, -0.2);
    p.material = 2;
    plates.scene.polygons.push_back(p);
  }
  const Solution s = solve(device, plates.scene, plate_options());
  const PolygonMesh& m = s.mesh.polygons[1];
  for (std::uint32_t v = m.first_vertex; v < m.first_vertex + m.vertices; ++v)
    EXPECT_EQ(s.vertex_covered[v], 0);
  EXPECT_NEAR(received(s).irradiance[12][0], lamp_factor({0, 0, 0}, [](double) { return 1; }), 1e-4);
}

TEST(Transmission, PlansFast) {
  Scene scene;
  scene.bands = {"grey"};
  scene.materials = {diffuse({0.5}, {0}), glass_of({0.9}, 1.5)};
  for (int k = 0; k < 100000; ++k)
    scene.polygons.push_back(level_square(0.01, 0.001 * (k % 317), true, k % 2, 0.03 * k));
  // All glass at the top: nothing is above any of it.
  for (Polygon& p : scene.polygons)
    if (p.material == 1)
      for (glm::dvec3& c : p.corner) c.z = 1;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(effect_of(plan_effects(scene, {}), "transmission").needed);  // too many to prove anything
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 1.0);
}

}  // namespace
}  // namespace clrad
