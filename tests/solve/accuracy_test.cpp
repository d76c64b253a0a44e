// What a solve says of its own error, against what it is.
#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "output/displayed.hpp"
#include "solve/check_points.hpp"

namespace clrad {
namespace {

Device& accuracy_device() {
  static Device device;
  return device;
}

double part_of_error(const Solution& s, const std::string& name) {
  for (const ErrorPart& part : s.report.error.parts)
    if (part.name == name) return part.relative;
  return NAN;
}

SolveOptions meshed(const Scene& scene, double patches, double elements) {
  SolveOptions o;
  o.mesh.patch_edge_m = oracle::extent_of(scene) / patches;
  o.mesh.element_edge_m = oracle::extent_of(scene) / elements;
  return o;
}

// RMS of what `s` displays at places of `other`'s mesh, against what that displays there.
double rms_against(const Solution& s, const Solution& other) {
  Random random(3);
  const Displayed mine(s, display_irradiance(s)), theirs(other, display_irradiance(other));
  double squares = 0, mean = 0;
  for (const CheckPoint& p : points_in_elements(other, 2000, random)) {
    const Interpolant at = locate(s.mesh, p.polygon, s.scene.polygons[p.polygon].corners, p.u, p.v);
    for (std::uint32_t b = 0; b < s.bands; ++b) {
      squares += p.weight * std::pow(mine.at(b, at) - theirs.at(b, p.where), 2);
      mean += p.weight * theirs.at(b, p.where);
    }
  }
  return std::sqrt(squares * s.bands) / mean;
}

double mean_displayed(const Solution& s) {
  double mean = 0, area = 0;
  for (const PolygonMean& polygon : polygon_means(s)) {
    area += polygon.area_m2;
    for (const double h : polygon.irradiance) mean += h * polygon.area_m2;
  }
  return mean / area;
}

// A box of the reference with a coloured wall, whose truth here is a mesh with elements an eighth as large: errors fall at least in
// proportion to the edge, so the truth's own is an eighth at most. Between 1/2 and 3 times is what the estimate is held to.
TEST(Accuracy, TheEstimateIsBetweenHalfAndThriceTheError) {
  const auto data = oracle::reference("c_boxes.json");
  const Scene scene = oracle::scene_of(oracle::reference_case(data, "C-daylit-1").at("scene"));
  SolveOptions fine = meshed(scene, 12, 96);
  fine.error = false;
  const Solution truth = solve(accuracy_device(), scene, fine);
  for (const auto& [patches, elements] : {std::pair{2, 12}, {4, 12}, {6, 12}}) {
    const Solution s = solve(accuracy_device(), scene, meshed(scene, patches, elements));
    const double error = rms_against(s, truth), estimate = s.report.error.total_relative;
    EXPECT_GT(estimate, error / 2) << patches;
    EXPECT_LT(estimate, 3 * error) << patches;
  }
}

// The disk estimator is some 10 % off at this mesh (`./run bench budget`; its bias does not go away with samples), the exact one
// by rounding: which part of the error that is has to be seen.
TEST(Accuracy, FormFactorsAreTheLargestPartWhereTheyAreWrong) {
  const Scene scene = oracle::block_room();
  SolveOptions o = meshed(scene, 4, 16);
  const Solution exact = solve(accuracy_device(), scene, o);
  o.estimator = Estimator::disk;
  const Solution disk = solve(accuracy_device(), scene, o);
  EXPECT_EQ(part_of_error(exact, "form factor"), 0);
  for (const char* other : {"visibility", "mesh-receive", "mesh-shoot", "convergence"})
    EXPECT_GT(part_of_error(disk, "form factor"), part_of_error(disk, other)) << other;
}

// Also where the room is a small part of the scene: a dark plane below it, of several times its surface, gets none of the light.
TEST(Accuracy, LightThatIsLeftUnshotIsThePartThatItIs) {
  for (const bool with_plane : {false, true}) {
    Scene scene = oracle::block_room();
    SolveOptions o = meshed(scene, 4, 8);
    if (with_plane) {
      Material black = scene.materials[0];
      for (double& rho : black.reflectance) rho = 0;
      for (double& e : black.emitted_exitance) e = 0;
      scene.materials.push_back(black);
      Polygon plane = scene.polygons[0];
      plane.name = "plane", plane.corners = 4, plane.material = std::uint32_t(scene.materials.size() - 1);
      plane.corner = {glm::dvec3{-10, -10, -1}, {-10, 20, -1}, {20, 20, -1}, {20, -10, -1}};
      scene.polygons.push_back(plane);
    }
    const Solution full = solve(accuracy_device(), scene, o);
    o.converge = 0.05;
    const Solution dark = solve(accuracy_device(), scene, o);
    // The part is relative to the darker solution's mean.
    const double there = rms_against(dark, full) * mean_displayed(full) / mean_displayed(dark);
    EXPECT_GT(part_of_error(dark, "convergence"), there / 2) << with_plane;
    EXPECT_LT(part_of_error(dark, "convergence"), 2 * there) << with_plane;
  }
}

TEST(Accuracy, TheTotalIsTheRootOfTheSumOfSquaresOfEstimates) {
  const Scene scene = oracle::block_room();
  const Solution s = solve(accuracy_device(), scene, meshed(scene, 2, 4));
  double squares = 0;
  for (const ErrorPart& part : s.report.error.parts)
    if (!part.bound) squares += part.relative * part.relative;
  EXPECT_DOUBLE_EQ(s.report.error.total_relative, std::sqrt(squares));
  EXPECT_TRUE(std::isnan(s.report.error.sensors_relative));
}

TEST(Accuracy, WithoutItNothingIsSpentAndTheAnswerIsTheSame) {
  const Scene scene = oracle::block_room();
  Device device, other;
  SolveOptions o = meshed(scene, 2, 4);
  const Solution with = solve(device, scene, o);
  o.error = false;
  const Solution without = solve(other, scene, o);
  EXPECT_EQ(with.vertex_irradiance, without.vertex_irradiance);
  EXPECT_TRUE(std::isnan(without.report.error.total_relative));
  for (const StageProfile& stage : without.report.stages) EXPECT_NE(stage.name, "estimate the error");
}

// Weights are shares of the area: their sums over polygons are the polygons' areas, up to the chance of 4000 draws, which
// for a share p with weights of at most twice their mean is below sqrt(2 p / 4000); four times that here.
TEST(Accuracy, CheckPointsStandForTheAreasOfTheirPolygons) {
  const Scene scene = oracle::box_scene({1, 2, 3}, {0.5}, {1});
  const Solution s = solve(accuracy_device(), scene, meshed(scene, 2, 4));
  Random random(1);
  std::vector<double> share(6, 0);
  for (const CheckPoint& p : points_in_elements(s, 4000, random)) share[p.polygon] += p.weight;
  const double area[6] = {6, 6, 3, 3, 2, 2};
  for (int p = 0; p < 6; ++p)
    EXPECT_NEAR(share[p], area[p] / 22, 4 * std::sqrt(2 * area[p] / 22 / 4000)) << p;
}

TEST(Accuracy, CheckVerticesStandForTheAreasOfTheirPolygons) {
  const Scene scene = oracle::box_scene({1, 2, 3}, {0.5}, {1});
  const Solution s = solve(accuracy_device(), scene, meshed(scene, 2, 4));
  Random random(1);
  const CheckVertices chosen = check_vertices(s, 4000, random);
  ASSERT_EQ(chosen.weight.size(), 4000u);
  std::vector<double> share(6, 0);
  for (std::size_t i = 0; i < chosen.vertex.size(); ++i)
    share[s.mesh.receivers[chosen.vertex[i]].surface] += chosen.weight[i];
  const double area[6] = {6, 6, 3, 3, 2, 2};
  for (int p = 0; p < 6; ++p)
    EXPECT_NEAR(share[p], area[p] / 22, 4 * std::sqrt(2 * area[p] / 22 / 4000)) << p;
}

}  // namespace
}  // namespace clrad
