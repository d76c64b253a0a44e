// How many rays at sensors a target asks for.
#include "solve/more_rays.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "tradeoff/places.hpp"

namespace clrad {
namespace {

// One sensor of irradiance 1, whose rays are off by `rays` and whose light by `seen`.
Solution with_errors(double rays, double seen) {
  Solution s;
  s.bands = 1;
  s.sensors = {{{0, 0, 0}, {0, 0, 1}, {1}, {std::hypot(rays, seen)}}};
  s.report.error.sensors_relative = std::hypot(rays, seen);
  s.report.error.sensor_parts = {{"sensor rays", rays, false}, {"light seen", seen, false}};
  return s;
}

SolveOptions to(double target) {
  SolveOptions o;
  o.target_error = target, o.sensor_rays = 1000;
  return o;
}

TEST(MoreRays, AsManyAsBringTheErrorBelowTheTarget) {
  const SensorGather none;
  // 0.4 % falls by 2^-0.6 to 0.264 %, with 0.1 % it is 0.282 %.
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.001), to(0.003), none, 1, INFINITY), 2000u);
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.001), to(0.0025), none, 1, INFINITY), 4000u);
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.001), to(0.005), none, 1, INFINITY), 0u);  // it is met
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.001), to(0), none, 1, INFINITY), 0u);      // there is none
}

TEST(MoreRays, NoneWhereTheyAreNotWhatIsWrong) {
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.003), to(0.003), {}, 1, INFINITY), 0u);
  EXPECT_EQ(rays_for_target(with_errors(0.1, 0.001), to(0.003), {}, 1, INFINITY), 0u);  // far too many
  SensorGather vertices;
  vertices.of_vertices = {0.004 * 0.004};  // what rays at vertices left stays
  EXPECT_EQ(rays_for_target(with_errors(0.004, 0.001), to(0.003), vertices, 1, INFINITY), 0u);
}

TEST(MoreRays, NoneWhereThereIsNoTimeOrNoHelp) {
  const Solution s = with_errors(0.004, 0.001);
  EXPECT_EQ(rays_for_target(s, to(0.003), {}, 1, 2), 2000u);
  EXPECT_EQ(rays_for_target(s, to(0.003), {}, 1, 1.9), 0u);
  SolveOptions o = to(0.003);
  o.target_of = TargetOf::worst_sensor;
  EXPECT_EQ(rays_for_target(s, o, {}, 1, INFINITY), 0u);
  o = to(0.003), o.sensor_rays = most_sensor_rays;
  EXPECT_EQ(rays_for_target(s, o, {}, 1, INFINITY), 0u);
  Solution stopped = s;
  stopped.stopped = true;
  EXPECT_EQ(rays_for_target(stopped, to(0.003), {}, 1, INFINITY), 0u);
}

// In the room with a block 1024 rays are not enough for 0.3 % and this mesh is: it is solved once, and the error is what was asked.
TEST(MoreRays, ASolveIsNotRepeatedForThem) {
  const auto data = oracle::reference("c_scenes_with_occlusion.json");
  const auto& room = oracle::reference_case(data, "C-block-room-1");
  SolveOptions o;
  std::vector<double> known;
  for (const auto& p : room.at("points")) {
    o.sensors.push_back({oracle::vec(p.at("point")), oracle::vec(p.at("normal"))});
    for (const double h : p.at("H")) known.push_back(h);
  }
  const Scene scene = oracle::scene_of(room.at("scene"));
  o.target_error = 0.003;
  o.mesh = {oracle::extent_of(scene) / 4, oracle::extent_of(scene) / 16};
  Device device;
  const Solution s = solve(device, scene, o);
  ASSERT_EQ(s.report.target.steps.size(), 1u);
  EXPECT_GT(s.report.target.steps[0].sensor_rays, 1024u);
  EXPECT_EQ(s.report.sensor_rays, s.report.target.steps[0].sensor_rays);
  std::vector<double> found;
  for (const SensorResult& r : s.sensors) found.insert(found.end(), r.irradiance.begin(), r.irradiance.end());
  EXPECT_LT(rms_relative(found, known, {}, s.bands), 0.003);
}

}  // namespace
}  // namespace clrad
