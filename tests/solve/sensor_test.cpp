#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

// Irradiance at the reference's points by gathering over a solution at the given mesh; the worst relative error over
// points and bands, and the worst error in units of the sensor's own error estimate's scale.
struct Verdict {
  double worst = 0, rms = 0;
  std::string where;
};

Verdict sensors_against(const std::string& id, const MeshOptions& mesh, std::uint32_t samples) {
  const auto data = oracle::reference("c_scenes_with_occlusion.json");
  const auto& c = oracle::reference_case(data, id);
  SolveOptions options;
  options.mesh = mesh;
  options.samples = samples;
  for (const auto& p : c.at("points"))
    options.sensors.push_back({oracle::vec(p.at("point")), oracle::vec(p.at("normal"))});
  Device device;
  const Solution s = solve(device, oracle::scene_of(c.at("scene")), options);
  Verdict v;
  double squares = 0, mean = 0;
  for (std::size_t i = 0; i < s.sensors.size(); ++i)
    for (std::uint32_t b = 0; b < 3; ++b) {
      const double expected = c.at("points").at(i).at("H").at(b),
                   error = s.sensors[i].irradiance[b] - expected;
      squares += error * error;
      mean += expected;
      if (std::abs(error) / expected > v.worst)
        v.worst = std::abs(error) / expected, v.where = c.at("points").at(i).at("name");
    }
  const double n = 3.0 * double(s.sensors.size());
  v.rms = std::sqrt(squares / n) / (mean / n);
  return v;
}

// The bar is 3 % at every point at settings that take under a minute; the defaults take seconds. The reference's own
// standard error is below 0.2 %.
TEST(Sensor, BlockRoomWithinThreePercentAtEveryPoint) {
  const Verdict v = sensors_against("C-block-room-1", {}, 4);
  EXPECT_LT(v.worst, 0.03) << v.where;
  std::printf("block room: worst %.3g at %s, rms %.3g\n", v.worst, v.where.c_str(), v.rms);
}

TEST(Sensor, CornellBoxWithinThreePercentAtEveryPoint) {
  const Verdict v = sensors_against("C-cornell-1", {}, 4);
  EXPECT_LT(v.worst, 0.03) << v.where;
  std::printf("Cornell box: worst %.3g at %s, rms %.3g\n", v.worst, v.where.c_str(), v.rms);
}

// A coarser mesh is worse: halving the patches twice must not leave the error where it was.
TEST(Sensor, ConvergesAsTheMeshIsRefined) {
  const Verdict coarse = sensors_against("C-block-room-1", {2, 0.5}, 4),
                fine = sensors_against("C-block-room-1", {0.5, 0.125}, 4);
  EXPECT_LT(fine.rms, 0.6 * coarse.rms) << coarse.rms << " -> " << fine.rms;
}

// In a furnace with rho = 1/2 every point receives B = 2 from everywhere: H = 2 whatever the position, also on walls, in
// edges and behind nothing; nothing is occluded, so only rounding (1e-5 a factor) and 1e-3 of unshot light are left.
TEST(Sensor, FurnaceIrradianceIsTheSameEverywhere) {
  SolveOptions options;
  options.mesh = {0.5, 0.25};
  options.samples = 1;
  options.converge = 1e-5;
  options.sensors = {{{0.5, 0.5, 0.5}, {0, 0, 1}},  {{0.5, 0.5, 0}, {0, 0, 1}},
                     {{0.1, 0.2, 0.3}, {1, 2, -3}}, {{0, 0.5, 0.5}, {1, 0, 0}},
                     {{1e-4, 1e-4, 0}, {0, 0, 1}},  {{1e-3, 0.5, 1e-3}, {0, 0, 1}}};
  Device device;
  const Solution s = solve(device, oracle::box_scene({1, 1, 1}, {0.5}, {1}), options);
  for (const auto& sensor : s.sensors) {
    EXPECT_NEAR(sensor.irradiance[0], 2, 2e-4)
        << sensor.position_m.x << " " << sensor.position_m.y << " " << sensor.position_m.z;
    EXPECT_LT(sensor.irradiance_error[0], 2e-2);
  }
}

TEST(Sensor, BehindAWallItIsDarkAndOnABackNothingArrives) {
  SolveOptions options;
  options.mesh = {1, 1};
  options.sensors = {{{0.5, 0.5, -0.25}, {0, 0, 1}}, {{0.5, 0.5, 0}, {0, 0, -1}}};
  Device device;
  const Solution s = solve(device, oracle::box_scene({1, 1, 1}, {0.5}, {1}), options);
  EXPECT_EQ(s.sensors[0].irradiance[0], 0);
  EXPECT_EQ(s.sensors[1].irradiance[0], 0);
}

}  // namespace
}  // namespace clrad
