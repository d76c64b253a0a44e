// Points where sensors look, drawn so that a wall beside a sensor is not missed.
#include "solve/seen_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "visibility/open.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t wanted = 128;

// A box of 1 x 2 x 1.5 m and a sensor 1 mm from the wall x = 0, which is half of what it sees.
class SeenPoints : public ::testing::Test {
 protected:
  const Scene scene_ = oracle::box_scene({1, 2, 1.5}, {0.5}, {1});
  Device device_;
  SolveOptions options_;
  Solution solution_;
  std::unique_ptr<VisibilityEngine> engine_ = make_open(device_);
  std::unique_ptr<SolveState> state_;
  SensorGather gathered_;

  void SetUp() override {
    options_.mesh = {0.5, 0.125}, options_.error = false, options_.sensor_rays = 64;
    options_.sensors = {{{0.001, 1, 0.7}, {0, 0, 1}}};
    solution_ = solve(device_, scene_, options_);
    state_ = std::make_unique<SolveState>(device_, solution_.scene, solution_.mesh, 1, *engine_, options_,
                                          solution_.vertex_covered, solution_.frame.metres());
    const std::vector<std::uint32_t> planes(scene_.polygons.size(), 0xffffffffu);
    gather_at_sensors(device_, solution_, planes, *engine_, options_, gathered_);
  }
  std::vector<CheckPoint> drawn(std::uint64_t seed) {
    Random random(seed);
    const std::vector<CheckPoint> spread = points_in_elements(solution_, wanted, random);
    return seen_points(*state_, solution_, gathered_, spread, wanted, seed, random);
  }
  bool beside_sensor(const CheckPoint& p) const {
    const Polygon& polygon = scene_.polygons[p.polygon];
    for (std::uint32_t k = 0; k < polygon.corners; ++k)
      if (polygon.corner[k].x != 0) return false;
    return true;
  }
};

// Rays are spread evenly: of `wanted` ends half lie there but for a few, and of the half of the others that are taken at most its
// share of the area besides (3 of 13 m2).
TEST_F(SeenPoints, HalfOfThemLieOnTheWallBesideTheSensor) {
  const std::vector<CheckPoint> points = drawn(1);
  const auto beside = std::count_if(points.begin(), points.end(), [&](auto& p) { return beside_sensor(p); });
  EXPECT_NEAR(double(points.size()), 1.5 * wanted, 0.05 * wanted);
  EXPECT_GT(double(beside), 0.45 * wanted);
  EXPECT_LT(double(beside), 0.55 * wanted + 0.5 * wanted * 3 / 13 * 2);
}

// However they are drawn, the mean over the surfaces of anything is the sum of weight x value. Of 20 draws of 192 points, none of which weighs
// more than 1 / 32 (half of 64 are drawn by area), the mean sum is off by sqrt(192 / 20) / 32 = 0.1 at most as a standard error.
TEST_F(SeenPoints, WeightsAreSharesOfTheArea) {
  double all = 0, beside = 0;
  constexpr int draws = 20;
  for (std::uint64_t seed = 1; seed <= draws; ++seed)
    for (const CheckPoint& p : drawn(seed)) {
      EXPECT_LE(p.weight, 1.0 / 32 * 1.01);
      all += p.weight / draws, beside += beside_sensor(p) ? p.weight / draws : 0;
    }
  EXPECT_NEAR(all, 1, 0.2);
  EXPECT_NEAR(beside, 3.0 / 13, 0.1);
}

// A point is where its weights say: what is interpolated there is what is checked there.
TEST_F(SeenPoints, EndsOfRaysLieInTheirElements) {
  for (const CheckPoint& p : drawn(3)) {
    double sum = 0;
    for (const double w : p.where.weight) sum += w;
    EXPECT_NEAR(sum, 1, 1e-6);
    const Polygon& polygon = scene_.polygons[p.polygon];
    const glm::dvec3 r = p.point.position - solution_.frame.to_frame(polygon.corner[0]);
    EXPECT_NEAR(glm::dot(r, polygon.normal()), 0, 1e-6);  // single precision of the weights
    // No farther from any corner of the element than they are from each other.
    const double edge = 0.125 / solution_.frame.metres();
    for (const std::uint32_t v : solution_.mesh.elements[p.where.element].vertex)
      EXPECT_LE(glm::length(solution_.mesh.receivers[v].position - p.point.position),
                edge * std::sqrt(2.0) * 1.001);
  }
}

}  // namespace
}  // namespace clrad
