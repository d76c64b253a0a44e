#include <gtest/gtest.h>

#include <functional>

#include <algorithm>
#include <cmath>
#include <set>

#include "clrad/clrad.hpp"
#include "device/divided.hpp"
#include "mesh/build.hpp"
#include "oracle/radiosity.hpp"
#include "oracle/rational_visibility.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"
#include "solve/covered.hpp"
#include "solve/shooter.hpp"

namespace clrad {
namespace {

SolveOptions one_patch_a_face(double size, unsigned elements) {
  SolveOptions o;
  o.mesh = {size, size / elements};
  o.samples = 1;
  o.light_samples = 0;
  return o;
}

// Faces of the cube all emit 1 and reflect rho: B = 1 / (1 - rho) everywhere, and since the factors at every vertex sum to
// 1, meshing makes no error. What is left: 1e-6 unshot, and the rounding of factors (1e-5 relative each, of either sign)
// amplified by rho / (1 - rho) <= 9. Allowed: 1e-4.
TEST(Progressive, WhiteFurnaceCube) {
  Device device;
  const std::vector<double> rho{0.1, 0.3, 0.5, 0.7, 0.9};
  SolveOptions options = one_patch_a_face(1, 32);
  options.converge = 1e-6;
  const Solution s =
      solve(device, oracle::box_scene({1, 1, 1}, rho, std::vector<double>(rho.size(), 1.0)), options);
  ASSERT_FALSE(s.stopped);
  for (std::uint32_t b = 0; b < s.bands; ++b) {
    const double expected = 1 / (1 - rho[b]);
    double worst = 0;
    for (std::uint32_t p = 0; p < 6; ++p)
      for (std::uint32_t v = s.mesh.polygons[p].first_vertex;
           v < s.mesh.polygons[p].first_vertex + s.mesh.polygons[p].vertices; ++v)
        worst = std::max(worst, std::abs(s.vertex_radiosity(b, v, p) / expected - 1));
    EXPECT_LT(worst, 1e-4) << "rho " << rho[b];
  }
  EXPECT_TRUE(s.report.energy.closed);
  EXPECT_TRUE(s.report.warnings.empty()) << s.report.warnings.front();
}

// One patch a face, 32 x 32 elements: the exact 6 x 6 solution of the reference. The average of the point factors over a
// face by the trapezoidal rule errs by h^2 / 12 f'' and at corners, where the factor jumps, by O(h^2): with h = 1/32 some
// 5e-4; the bar is 1e-3.
TEST(Progressive, BoxesWithConstantPatches) {
  Device device;
  const auto data = oracle::reference("c_boxes.json");
  int boxes = 0;
  for (const auto& c : data.at("cases")) {
    if (c.at("kind") != "box_constant_faces") continue;
    ++boxes;
    const Scene scene = oracle::scene_of(c.at("scene"));
    glm::dvec3 high(0);
    for (const auto& p : scene.polygons)
      for (std::uint32_t k = 0; k < p.corners; ++k) high = glm::max(high, p.corner[k]);
    // At least 32 elements along every edge.
    SolveOptions options = one_patch_a_face(std::max({high.x, high.y, high.z}), 1);
    options.mesh.element_edge_m = std::min({high.x, high.y, high.z}) / 32;
    options.converge = 1e-6;
    const Solution s = solve(device, scene, options);
    ASSERT_EQ(s.mesh.patches.size(), 6u);
    const auto means = polygon_means(s);
    for (std::size_t p = 0; p < 6; ++p)
      for (std::uint32_t b = 0; b < 3; ++b) {
        const double expected = c.at("constant_patch_solution_B").at(p).at(b);
        EXPECT_NEAR(means[p].radiosity[b], expected, 1e-3 * expected)
            << c.at("id") << " face " << p << " band " << b;
      }
  }
  EXPECT_GE(boxes, 4);
}

// Same mesh, same averages, solved directly in double: only convergence (1e-6 of the power, amplified by at most 2) and
// rounding of the factors separate the two.
TEST(Progressive, AgreesWithTheScalarOracle) {
  Device device;
  Scene scene = oracle::box_scene({2, 1.5, 1}, {0.6}, {0.0});
  scene.materials.push_back({"light", {0.2}, {3.0}, {}});
  scene.polygons[5].material = 1;
  SolveOptions options;
  options.mesh = {0.75, 0.2};
  options.samples = 1;
  options.converge = 1e-6;
  const Solution s = solve(device, scene, options);
  const auto expected =
      oracle::patch_radiosity(scene, s.mesh, 0, s.vertex_covered, [](auto, auto) { return 1.0; });
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
    const Material& m = scene.materials[scene.polygons[s.mesh.patches[p].polygon].material];
    EXPECT_NEAR(m.emitted_exitance[0] + m.reflectance[0] * s.patch_irradiance[p], expected(Eigen::Index(p)),
                3e-5 * expected(Eigen::Index(p)));
  }
}

// The same with things in the way: the oracle asks exact rational arithmetic about every segment to the same samples and
// weighs them alike. The coarse mesh keeps that to seconds.
TEST(Progressive, AgreesWithTheScalarOracleWhereThingsAreOccluded) {
  Device device;
  const Scene scene = oracle::block_room();
  SolveOptions options;
  options.mesh = {2, 1};
  options.samples = 9;
  options.light_samples = 0;
  options.converge = 1e-6;
  options.closure = Closure::off;  // the oracle takes rows as they are
  const Solution s = solve(device, scene, options);
  const auto planes = plane_ids(scene);
  std::vector<oracle::Triangle> triangles;
  for (const auto& t : occluder_triangles(scene, s.frame, planes))
    triangles.push_back({{snap(t.corner[0]), snap(t.corner[1]), snap(t.corner[2])}, t.plane});
  int hidden = 0, seen = 0;
  const auto visible = [&](std::uint32_t v, std::uint32_t patch) {
    const Shooter shooter = shooter_of(scene, s.mesh, patch, s.frame.metres());
    const Point& r = s.mesh.receivers[v];
    double sum = 0, all = 0;
    for (const Point& sample : samples_on(shooter, patch, options.samples, options.seed)) {
      const glm::dvec3 d = sample.position - r.position;
      const double above = glm::dot(d, r.normal), facing = -glm::dot(d, sample.normal);
      if (above <= 0 || facing <= 0) continue;
      const double weight = above * facing / (glm::dot(d, d) * glm::dot(d, d));
      const bool blocked = oracle::blocked(
          oracle::Segment{snap(r.position), snap(sample.position), r.plane, sample.plane}, triangles);
      all += weight;
      if (!blocked) sum += weight;
      ++(blocked ? hidden : seen);
    }
    // No sample above the horizon: the clipped shooter's centroid decides; at nine samples its factor is a sliver's.
    return all > 0 ? sum / all : 1;
  };
  const auto expected = oracle::patch_radiosity(scene, s.mesh, 0, s.vertex_covered, visible);
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(seen, 1000);
  const std::vector<double> exposed = exposed_shares(s.mesh, s.vertex_covered);
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
    const Material& m = scene.materials[scene.polygons[s.mesh.patches[p].polygon].material];
    const double radiosity = m.emitted_exitance[0] + m.reflectance[0] / exposed[p] * s.patch_irradiance[p];
    EXPECT_NEAR(radiosity, expected(Eigen::Index(p)), 1e-4 * expected(Eigen::Index(p)) + 1e-6)
        << "patch " << p;
  }
}

TEST(Progressive, EnergyIsAccountedFor) {
  Device device;
  SolveOptions options;
  options.samples = 4;
  const Solution s = solve(device, oracle::block_room(), options);
  const auto& e = s.report.energy;
  for (std::uint32_t b = 0; b < s.bands; ++b) {
    EXPECT_NEAR(e.emitted[b], e.absorbed[b] + e.unshot[b] + e.unaccounted[b], 1e-9 * e.emitted[b]);
    EXPECT_LT(e.unshot[b], 2e-3 * e.emitted[b]);
    // Discretisation of point form factors at the default mesh; the room lets nothing out.
    EXPECT_LT(std::abs(e.unaccounted[b]), 0.03 * e.emitted[b]);
  }
  std::set<std::string> names;
  for (const auto& stage : s.report.stages) names.insert(stage.name);
  for (const char* stage :
       {"select the patch with the most unshot power", "emit rays to the receivers that face the shooter",
        "weigh form factors by what is visible", "deliver light to the vertices",
        "gather vertices to elements and patches", "account for what is absorbed and unshot"})
    EXPECT_TRUE(names.contains(stage)) << stage;
}

TEST(Progressive, SameBitsWhateverTheDeviceIsDividedInto) {
  SolveOptions options;
  options.mesh = {1.0, 0.25};
  options.samples = 4;
  const auto run = [&](const DeviceOptions& d) {
    Device device(d);
    options.engine = "chop";
    const Solution s = solve(device, oracle::block_room(), options);
    return std::pair(s.vertex_irradiance, s.patch_irradiance);
  };
  const auto first = run({});
  EXPECT_EQ(run({}), first) << "second run";
  EXPECT_EQ(run({.cores = test::one_core()}), first) << "one core";
  EXPECT_EQ(run({.work_group_size = 16}), first) << "work-groups of 16";
  EXPECT_EQ(run({.packet_width = 4}), first) << "packets of 4";
  EXPECT_EQ(run({.shape = Shape::trees}), first) << "work-group trees";
  EXPECT_EQ(run({.memory_bytes = 96u << 20}), first) << "small memory, small batches";
  options.rays_per_batch = 4096;
  EXPECT_EQ(run({}), first) << "small batches";
  options.grid = {5, 4, 3};
  EXPECT_EQ(run({}), first) << "another grid";
  options.engine = "serial";
  Device device;
  const Solution s = solve(device, oracle::block_room(), options);
  EXPECT_EQ(std::pair(s.vertex_irradiance, s.patch_irradiance), first) << "engine serial";
}

TEST(Progressive, StopLeavesAValidPartialResult) {
  Device device;
  SolveOptions options;
  options.mesh = {1.0, 0.5};
  options.samples = 1;
  options.near_field = false;  // it moves light about
  const Solution full = solve(device, oracle::block_room(), options);
  options.progress = [](const Progress& p) { return p.shoots < 5; };
  const Solution part = solve(device, oracle::block_room(), options);
  EXPECT_TRUE(part.stopped);
  EXPECT_EQ(part.report.shoots, 5u);
  EXPECT_GT(part.unshot_relative, options.converge);
  double some = 0;
  for (std::size_t i = 0; i < part.vertex_irradiance.size(); ++i) {
    // Light is only ever added; rounding of a sum in another order is all that could make it less.
    EXPECT_LE(part.vertex_irradiance[i], full.vertex_irradiance[i] * (1 + 1e-6) + 1e-12);
    some = std::max(some, part.vertex_irradiance[i]);
  }
  EXPECT_GT(some, 0);
}

TEST(Progressive, BadOptionsAreUsageErrors) {
  Device device;
  const Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  const auto refused = [&](const std::function<void(SolveOptions&)>& spoil) {
    SolveOptions options;
    spoil(options);
    EXPECT_THROW(solve(device, scene, options), UsageError);
  };
  refused([](SolveOptions& o) { o.converge = 0; });
  refused([](SolveOptions& o) { o.samples = 0; });
  refused([](SolveOptions& o) { o.engine = "magic"; });
  refused([](SolveOptions& o) { o.shooters = 0; });
  refused([](SolveOptions& o) { o.adaptive.tolerance = -1; });
  refused([](SolveOptions& o) { o.adaptive.every = 0; });
  refused([](SolveOptions& o) { o.adaptive.min_projected_area_px = 1; });
}

// To the solve, mirrors, and glass with nothing behind it, are surfaces of their diffuse part; the report says what that leaves
// out.
TEST(Progressive, MirrorsAndGlassReflectTheirDiffusePartAndTheReportSaysSo) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1.0});
  Device device;
  const Solution plain = solve(device, scene, one_patch_a_face(1, 4));
  EXPECT_TRUE(plain.report.warnings.empty());
  for (Material& m : scene.materials) m.specular = {0.3}, m.transmission = {0.1};
  const Solution glass = solve(device, scene, one_patch_a_face(1, 4));
  EXPECT_EQ(glass.vertex_irradiance, plain.vertex_irradiance);
  ASSERT_EQ(glass.report.warnings.size(), 1u);
  EXPECT_NE(glass.report.warnings[0].find("by way of mirrors is not solved"), std::string::npos);
}

}  // namespace
}  // namespace clrad
