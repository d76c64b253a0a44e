// Closed rooms of high reflectance: what rows of form factors lack must not be amplified by 1 / (1 - rho).
#include "solve/balance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clrad/clrad.hpp"
#include "device/divided.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

using oracle::json;

const json& closed_forms() {
  static const json data = oracle::reference("c_closed_forms.json");
  return data;
}

Scene furnace(const json& polygons, const std::vector<double>& rho, const std::vector<double>& emitted) {
  Scene scene;
  scene.file = "furnace";
  for (std::size_t b = 0; b < rho.size(); ++b) scene.bands.push_back(std::to_string(b));
  scene.materials.push_back({"all", rho, emitted, {}});
  for (const auto& p : polygons) scene.polygons.push_back(oracle::polygon(p, 0, "wall"));
  return scene;
}

// The largest relative error of radiosity at vertices that nothing covers and of patches against E / (1 - rho).
double furnace_error(const Solution& s) {
  double worst = 0;
  const Material& m = s.scene.materials[0];
  for (std::uint32_t b = 0; b < s.bands; ++b) {
    const double expected = m.emitted_exitance[b] / (1 - m.reflectance[b]);
    for (std::uint32_t v = 0; v < s.vertex_count(); ++v)
      if (!s.vertex_covered[v])
        worst =
            std::max(worst, std::abs(s.vertex_radiosity(b, v, s.mesh.receivers[v].surface) / expected - 1));
    for (const PolygonMean& p : polygon_means(s))
      worst = std::max(worst, std::abs(p.radiosity[b] / expected - 1));
  }
  return worst;
}

SolveOptions coarse(const Scene& scene, double patches, double elements) {
  SolveOptions o;
  o.mesh = {oracle::extent_of(scene) / patches, oracle::extent_of(scene) / elements};
  o.light_samples = 0;
  o.converge = 1e-5;
  return o;
}

const std::vector<double> reflectances{0.1, 0.3, 0.5, 0.8, 0.9, 0.99, 0.999, 0.9999};

// All furnaces of the reference, all reflectances at once, in float: 1e-3. Where nothing is left to round, what remains is 1e-5 of
// unshot light, which weighs at most 1e-5 of B, and some roundings.
TEST(Balance, WhiteFurnacesOfTheReferenceInFloat) {
  Device device;
  int furnaces = 0;
  for (const auto& c : closed_forms().at("cases")) {
    if (c.at("kind") != "white_furnace" || !c.contains("rho")) continue;
    EXPECT_EQ(c.at("rho").get<std::vector<double>>(), reflectances);
    const Scene scene =
        furnace(c.at("polygons"), reflectances, std::vector<double>(reflectances.size(), 1.0));
    const Solution s = solve(device, scene, coarse(scene, 4, 8));
    EXPECT_TRUE(s.report.closure.proven) << c.at("id") << ": " << s.report.closure.reason;
    EXPECT_TRUE(s.report.closure.applied && s.report.closure.converges);
    EXPECT_LT(s.unshot_relative, 1e-5);
    EXPECT_LT(furnace_error(s), 5e-5) << c.at("id");
    EXPECT_LT(s.report.closure.worst_defect_after, 1e-6);
    EXPECT_LT(std::abs(s.report.energy.unaccounted_relative), 1e-4) << c.at("id");
    ++furnaces;
  }
  EXPECT_EQ(furnaces, 6);
}

TEST(Balance, WhiteFurnacesInDoubleUpToAMillionBounces) {
  Device device({.precision = Precision::float64});
  const std::vector<double> rho{0.5, 0.9999, 0.99999, 0.999999};
  for (const char* id : {"C-furnace-1", "C-furnace-3", "C-furnace-4"}) {
    const Scene scene = furnace(oracle::reference_case(closed_forms(), id).at("polygons"), rho, {1, 2, 3, 4});
    SolveOptions options = coarse(scene, 2, 4);
    options.converge = 1e-8;
    const Solution s = solve(device, scene, options);
    EXPECT_LT(furnace_error(s), 1e-6) << id;
    EXPECT_LT(furnace_error(s), 1e-7) << id << ": 1e-8 of unshot light";
    // Bounded work: the columns once, and some cycles of the solver.
    EXPECT_EQ(s.report.shoots, s.mesh.patches.size());
    EXPECT_LT(s.report.reshoots, 12 * s.mesh.patches.size());
  }
}

TEST(Balance, FurnacePerChannelAndTrivialCases) {
  Device device;
  const auto& rgb = oracle::reference_case(closed_forms(), "C-furnace-rgb");
  const Scene scene = furnace(rgb.at("polygons"), rgb.at("reflectance_rgb"), rgb.at("emission"));
  EXPECT_LT(furnace_error(solve(device, scene, coarse(scene, 2, 8))), 5e-5);
  for (const char* id : {"C-trivial-1", "C-trivial-2"}) {
    const auto& c = oracle::reference_case(closed_forms(), id);
    Scene faces;
    faces.bands = {"grey"};
    for (std::size_t p = 0; p < 6; ++p) {
      faces.materials.push_back({"", {c.at("reflectance").at(p)}, {c.at("emission").at(p)}, {}});
      faces.polygons.push_back(oracle::polygon(c.at("polygons").at(p), std::uint32_t(p), "face"));
    }
    const Solution s = solve(device, faces, coarse(faces, 2, 8));
    EXPECT_FALSE(s.stopped);
    for (std::uint32_t v = 0; v < s.vertex_count(); ++v) {
      const std::uint32_t p = s.mesh.receivers[v].surface;
      EXPECT_EQ(s.vertex_radiosity(0, v, p), c.at("B").at(p).get<double>()) << id;
    }
  }
}

// Visibility is sampled here, so rows are off by far more than rounding.
TEST(Balance, RawRowsShowWhatClosingThemIsWorth) {
  Device device;
  const Scene scene =
      furnace(oracle::reference_case(closed_forms(), "C-furnace-4").at("polygons"), {0.9999}, {1});
  SolveOptions options = coarse(scene, 4, 8);
  const Solution closed = solve(device, scene, options);
  EXPECT_LT(furnace_error(closed), 5e-5);
  EXPECT_GT(closed.report.closure.worst_defect_before, 1e-3);
  EXPECT_LT(closed.report.closure.worst_defect_after, 1e-6);
  EXPECT_LT(closed.report.closure.amplified_defect, 0.01);
  options.closure = Closure::off;
  const Solution raw = solve(device, scene, options);
  EXPECT_GT(furnace_error(raw), 0.1);
  EXPECT_FALSE(raw.report.closure.applied);
  EXPECT_FALSE(raw.report.closure.converges);
  EXPECT_GT(raw.report.closure.amplified_defect, 1);
  EXPECT_EQ(raw.report.closure.worst_defect_after, raw.report.closure.worst_defect_before);
  EXPECT_EQ(json::parse(report_json(raw)).at("converged"), false);
  ASSERT_FALSE(raw.report.warnings.empty());
  EXPECT_NE(raw.report.warnings.back().find("cannot claim convergence"), std::string::npos);
  options.strict = true;
  EXPECT_THROW(solve(device, scene, options), DeviceError);
}

// The same at a finer mesh, where rows happen to sum to more than 1 and the raw answer is below zero.
TEST(Balance, AnAnswerBelowZeroIsNotClaimed) {
  Device device;
  const Scene scene =
      furnace(oracle::reference_case(closed_forms(), "C-furnace-4").at("polygons"), {0.9999}, {1});
  SolveOptions options;
  options.closure = Closure::off;
  const Solution raw = solve(device, scene, options);
  EXPECT_GT(furnace_error(raw), 1);
  EXPECT_FALSE(raw.report.closure.converges);
  EXPECT_NE(raw.report.warnings.back().find("cannot claim convergence"), std::string::npos);
}

// A room with a slit of a hundredth of a millimetre is not proven closed, and at this reflectance nobody can say how much
// light the slit lets out and how much the factors lose; that it is closed can be said instead.
TEST(Balance, WhatIsNotProvenClosedIsNotClaimedButCanBeSaid) {
  Device device;
  Scene scene = furnace(oracle::reference_case(closed_forms(), "C-furnace-4").at("polygons"), {0.99999}, {1});
  for (auto& corner : scene.polygons[0].corner) corner.x -= 1e-5;
  SolveOptions options = coarse(scene, 4, 8);
  const Solution open = solve(device, scene, options);
  EXPECT_FALSE(open.report.closure.proven);
  EXPECT_NE(open.report.closure.reason.find("open side"), std::string::npos);
  EXPECT_FALSE(open.report.closure.converges);
  options.closure = Closure::on;
  const Solution said = solve(device, scene, options);
  EXPECT_TRUE(said.report.closure.applied && said.report.closure.converges);
  EXPECT_LT(furnace_error(said), 1e-3);
  // At moderate reflectance an open scene converges like any other.
  scene.materials[0].reflectance = {0.7};
  options.closure = Closure::automatic;
  const Solution moderate = solve(device, scene, options);
  EXPECT_TRUE(moderate.report.closure.converges) << moderate.report.closure.amplified_defect;
  EXPECT_LT(moderate.report.closure.amplification, 5);
}

// Whether rows are closed follows from the scene and what is asked, not from which patches happened to be shot: otherwise two
// meshes of one room would differ by more than their meshes. A dark corner patch must not decide it.
TEST(Balance, ClosedByTheSceneNotByTheMesh) {
  Device device;
  const Scene scene = oracle::scene_of(
      oracle::reference_case(oracle::reference("c_scenes_with_occlusion.json"), "C-block-room-1")
          .at("scene"));
  for (const double patches : {2, 4, 8}) {
    SolveOptions options = coarse(scene, patches, 2 * patches);
    options.converge = 0.01;
    const Solution closed = solve(device, scene, options);
    EXPECT_TRUE(closed.report.closure.applied) << patches;
    EXPECT_LT(closed.report.closure.worst_defect_after, 1e-6) << patches;
    options.converge = 0.1;  // a preview: columns of dark patches are not traced for it
    EXPECT_FALSE(solve(device, scene, options).report.closure.applied) << patches;
  }
}

// Open by a whole side: all light is lost there, which is no defect.
TEST(Balance, ParallelPlatesOfTheReference) {
  Device device;
  for (const auto& c : closed_forms().at("cases")) {
    if (c.at("kind") != "parallel_plates") continue;
    Scene scene;
    scene.bands = {"grey"};
    for (std::size_t p = 0; p < 2; ++p) {
      scene.materials.push_back({"", {c.at("reflectance").at(p)}, {c.at("emission").at(p)}, {}});
      scene.polygons.push_back(oracle::polygon(c.at("polygons").at(p), std::uint32_t(p), "plate"));
    }
    // One patch a plate, as the reference has it. Its factor is a mean of point factors over the plate: the trapezoidal
    // rule on elements of h errs where they fall off, over a rim as wide as the gap, by less than h / (12 x plate) once
    // elements resolve the rim and by half the rim otherwise.
    const double edge = c.at("polygons").at(0).at(1).at(0), h = edge / 64;
    SolveOptions options;
    options.mesh = {edge, h};
    options.samples = 1, options.light_samples = 0, options.converge = 1e-7;
    options.near_field = false;
    const Solution s = solve(device, scene, options);
    EXPECT_FALSE(s.report.closure.proven);
    EXPECT_TRUE(s.report.closure.converges);
    const double allowed = 2 * std::max(1.0, h) / edge;
    for (std::size_t p = 0; p < 2; ++p) {
      const double expected = c.at("constant_patch_B").at(p);
      EXPECT_NEAR(polygon_means(s)[p].radiosity[0], expected, allowed * expected) << c.at("id");
    }
  }
}

// The inside of a sphere, by flat triangles: irradiance is the same everywhere. Level 1 of the icosphere as the reference has it.
TEST(Balance, ClosedSphere) {
  Device device;
  const auto& polygons = oracle::reference_case(closed_forms(), "C-furnace-5").at("polygons");
  for (const auto& c : closed_forms().at("cases")) {
    if (c.at("kind") != "closed_sphere") continue;
    Scene scene;
    scene.bands = {"grey"};
    double area = 0, emitted = 0, absorbed_share = 0;
    for (const auto& vertices : polygons) {
      Polygon p = oracle::polygon(vertices, std::uint32_t(scene.materials.size()), "facet");
      const double z = (p.corner[0].z + p.corner[1].z + p.corner[2].z) / 3;
      const double e = z > c.at("emission_cap_z_min").get<double>() ? c.at("emission").get<double>() : 0;
      const double rho = c.at("rho_a").get<double>() + c.at("rho_b").get<double>() * z;
      scene.materials.push_back({"", {rho}, {e}, {}});
      scene.polygons.push_back(p);
      area += p.area_m2(), emitted += e * p.area_m2(), absorbed_share += (1 - rho) * p.area_m2();
    }
    SolveOptions options = coarse(scene, 4, 16);
    options.near_field = false;
    const Solution s = solve(device, scene, options);
    EXPECT_TRUE(s.report.closure.proven) << s.report.closure.reason;
    // Energy alone fixes the mean. Facets are not a sphere: a facet sees its neighbours at angles of up to 40 degrees, and
    // irradiance varies by some per cent about it.
    double mean = 0;
    for (std::size_t p = 0; p < scene.polygons.size(); ++p)
      mean += polygon_means(s)[p].irradiance[0] * scene.polygons[p].area_m2() / area;
    EXPECT_NEAR(mean, emitted / absorbed_share, 0.03 * mean) << c.at("id");
  }
}

TEST(Balance, SameBitsHoweverTheDeviceIsDivided) {
  const Scene scene =
      furnace(oracle::reference_case(closed_forms(), "C-furnace-4").at("polygons"), {0.9999}, {1});
  const auto run = [&](const DeviceOptions& with) {
    Device device(with);
    const Solution s = solve(device, scene, coarse(scene, 4, 8));
    return std::pair(s.vertex_irradiance, s.patch_irradiance);
  };
  const auto first = run({});
  EXPECT_EQ(run({.cores = test::one_core()}), first);
  EXPECT_EQ(run({.shape = Shape::trees, .work_group_size = 16}), first);
}

}  // namespace
}  // namespace clrad
