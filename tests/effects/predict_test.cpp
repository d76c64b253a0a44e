#include "effects/predict.hpp"

#include "effects/rooms.hpp"
#include "effects/support.hpp"
#include "mesh/build.hpp"
#include "solve/sensor.hpp"
#include "solve/vertex_gather.hpp"

namespace clrad {
namespace {

using test::make_room;

TEST(Predict, CountsAreThoseOfTheMesh) {
  Device device;
  Scene scene = make_room({.block = true});
  scene.polygons[3].corners = 3;
  for (const MeshOptions mesh : {MeshOptions{}, MeshOptions{0.7, 0.2}, MeshOptions{2, 0.06}}) {
    SolveOptions options;
    options.mesh = mesh;
    const Prediction p = predict(device, scene, options, plan_effects(scene, options));
    const Mesh built =
        build_mesh(scene, frame_of(scene), std::vector<std::uint32_t>(scene.polygons.size()), mesh);
    EXPECT_EQ(p.patches, double(built.patches.size()));
    EXPECT_EQ(p.elements, double(built.elements.size()));
    EXPECT_EQ(p.vertices, double(built.vertex_count()));
  }
}

// Rooms see their patches about evenly, so shoots and memory are close; seconds depend on who else uses the machine.
TEST(Predict, ShootsAndMemoryAreNearTheActual) {
  Device device;
  for (const double converge : {1e-3, 0.03})
    for (const bool block : {false, true}) {
      const Scene scene = make_room({.coloured_wall = true, .block = block});
      SolveOptions options;
      options.mesh = {0.5, 0.06};
      options.converge = converge;
      const Prediction p = predict(device, scene, options, plan_effects(scene, options));
      const Solution s = test::solve_alone(scene, options);
      EXPECT_GT(p.shoots, double(s.report.shoots) / 1.5);
      EXPECT_LT(p.shoots, double(s.report.shoots) * 1.5);
      EXPECT_GT(p.device_bytes, double(s.report.device_peak_bytes) / 1.5);
      EXPECT_LT(p.device_bytes, double(s.report.device_peak_bytes) * 1.5);
      EXPECT_GT(p.seconds, 0);
    }
}

// Rays of sensors are most of the memory where many are cast at a time; with few, those of the vertices.
TEST(Predict, MemoryOfSensorsIsNearTheActual) {
  const Scene scene = make_room({.coloured_wall = true, .block = true});
  for (const std::uint32_t rays : {1024u, 16384u}) {
    SolveOptions options;
    options.mesh = {0.25, 0.125};
    options.sensor_rays = rays;
    for (int i = 0; i < 64; ++i)
      options.sensors.push_back({{0.1 + 0.1 * (i % 8), 0.1 + 0.1 * (i / 8), 0.5}, {0, 0, 1}});
    Device device;  // whose peak is of this solve
    const Prediction p = predict(device, scene, options, plan_effects(scene, options));
    const Solution s = solve(device, scene, options);
    EXPECT_GT(p.device_bytes, double(s.report.device_peak_bytes) / 1.5) << rays;
    EXPECT_LT(p.device_bytes, double(s.report.device_peak_bytes) * 1.5) << rays;
  }
}

// What is predicted is compared with these, and does not know what is compiled already. Loading is most of so small a solve.
TEST(Predict, SecondsOfASolveAreWithoutLoadingKernels) {
  Device device;
  SolveOptions options;
  options.mesh = {1, 0.5};
  options.error = false;
  const Solution s = solve(device, make_room({}), options);
  EXPECT_GT(device.loading_seconds(), 0);
  EXPECT_GT(s.report.seconds.solve, 0);
  // All of these are parts of the same time, by one clock.
  EXPECT_LE(s.report.seconds.build + s.report.seconds.solve + device.loading_seconds(),
            s.report.seconds.total + 1e-3);
}

TEST(Predict, GatheringAtNothingTakesLittle) {
  Device device;
  const MeshSize mesh{10, 40, 60, 100}, one{1, 1, 4, 4};
  for (const MeshSize& m : {mesh, one})
    for (const double uncovered : {0.0, 1.0}) {
      EXPECT_GT(gather_work(m, uncovered, 0, 1024), 0);
      EXPECT_TRUE(std::isfinite(gather_work(m, uncovered, 0, 1024)));
      EXPECT_GT(gather_work(m, uncovered, 8, 1024), gather_work(m, uncovered, 0, 1024));
      EXPECT_EQ(vertex_gather_bytes(device, m, uncovered, 3, 0, 1024), 0);
    }
  EXPECT_EQ(vertex_gather_bytes(device, mesh, 0, 3, 8, 1024), 0);
  EXPECT_EQ(sensor_gather_bytes(device, 10, 3, 0, 1024), 0);
  // As many rays as there may be take what memory is left, and not more.
  EXPECT_LT(sensor_gather_bytes(device, 10, 3, 1u << 20, 1u << 20), double(device.ledger()->limit));
}

// Two thousand crumbs on shelves of air: large patches shoot again from what is kept before crumbs would shoot at all.
TEST(Predict, SmallPatchesHaveLittleToShoot) {
  Device device;
  Scene scene = make_room({});
  Polygon crumb = scene.polygons[0];
  crumb.corners = 4;
  for (int i = 0; i < 2000; ++i) {
    const glm::dvec3 at(0.1 + 0.019 * (i % 45), 0.1 + 0.019 * (i / 45), 0.3 + 0.1 * (i % 3));
    crumb.corner = {at, at + glm::dvec3(0.01, 0, 0), at + glm::dvec3(0.01, 0.01, 0),
                    at + glm::dvec3(0, 0.01, 0)};
    scene.polygons.push_back(crumb);
  }
  SolveOptions options;
  options.mesh = {0.5, 0.25};
  options.converge = 0.03;
  const Prediction p = predict(device, scene, options, plan_effects(scene, options));
  const Solution s = test::solve_alone(scene, options);
  EXPECT_GT(p.patches, 2000);
  EXPECT_LT(s.report.shoots, 400u);
  EXPECT_GT(p.shoots, double(s.report.shoots) / 1.5);
  EXPECT_LT(p.shoots, double(s.report.shoots) * 1.5);
}

TEST(Predict, WhatDoesNotRunCostsNothing) {
  Device device;
  const Scene scene = make_room({});
  const auto plan = plan_effects(scene, {});
  const Prediction p = predict(device, scene, {}, plan);
  ASSERT_EQ(p.parts.size(), plan.size() + 1);
  for (std::size_t i = 0; i < plan.size(); ++i)
    if (!plan[i].runs) {
      EXPECT_EQ(p.parts[i + 1].seconds, 0) << plan[i].name;
      EXPECT_EQ(p.parts[i + 1].device_bytes, 0) << plan[i].name;
    }
}

}  // namespace
}  // namespace clrad
