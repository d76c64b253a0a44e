// Point, spot and directional lights: closed forms at every vertex, shadows, and what a solve makes of their light.
#include "solve/lights.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <numbers>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using Kind = PunctualLight::Kind;
using test::polygon;
constexpr double pi = std::numbers::pi;

PunctualLight light_of(Kind kind, const glm::dvec3& at, const glm::dvec3& direction,
                       std::vector<double> intensity) {
  PunctualLight light;
  light.name = "lamp", light.kind = kind;
  light.position_m = at, light.direction = glm::normalize(direction);
  light.intensity = std::move(intensity);
  return light;
}
PunctualLight point_light(const glm::dvec3& at, double intensity) {
  return light_of(Kind::point, at, {0, 0, -1}, {intensity});
}
PunctualLight spot_light(const glm::dvec3& at, const glm::dvec3& direction, double intensity, double inner,
                         double outer) {
  PunctualLight light = light_of(Kind::spot, at, direction, {intensity});
  light.inner_cone_rad = inner, light.outer_cone_rad = outer;
  return light;
}

// A black square of 2 m in z = 0, facing up, and black squares of 0.5 m above it, facing down.
Polygon ground() {
  return polygon({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
}
Polygon shade_at(double z) {
  return polygon({{-0.25, -0.25, z}, {-0.25, 0.25, z}, {0.25, 0.25, z}, {0.25, -0.25, z}});
}
Scene black(const std::vector<Polygon>& polygons, const std::vector<PunctualLight>& lights) {
  Scene scene = test::scene(polygons);
  scene.materials = {test::material(1, 0)};
  scene.lights = lights;
  return scene;
}
SolveOptions meshed(double patch, double element) {
  SolveOptions options;
  options.mesh = {patch, element};
  return options;
}

// Irradiance of every vertex of polygon 0 against `expected`(position, normal), off by at most what lights.cpp says; where
// that is negative the vertex is left out.
using Expected = std::function<double(const glm::dvec3& position_m, const glm::dvec3& normal)>;
int expect_irradiance(const Scene& scene, const Expected& expected, Precision precision,
                      const SolveOptions& options = meshed(0.5, 0.125)) {
  Device& device = test::device(precision);
  const Solution s = solve(device, scene, options);
  const Lights lights(device, scene, s.frame, plane_ids(scene));
  const double unit = precision == Precision::float64 ? 0x1p-53 : 0x1p-24;
  int compared = 0;
  const auto vertices = s.mesh.receivers.size();
  for (std::size_t v = 0; v < vertices; ++v) {
    const Point& p = s.mesh.receivers[v];
    if (p.surface != 0 || s.vertex_covered[v]) continue;
    const double h = expected(s.frame.from_frame(p.position), p.normal);
    if (h < 0) continue;
    const double allowed = h == 0 ? 0 : lights.bound(p.position, std::array{h}, unit)[0];
    EXPECT_NEAR(s.vertex_irradiance[v], h, allowed) << "vertex " << v;
    ++compared;
  }
  return compared;
}

double irradiance_by(const PunctualLight& light, const glm::dvec3& position, const glm::dvec3& normal) {
  if (light.kind == Kind::directional)
    return std::max(0.0, -glm::dot(light.direction, normal)) * light.intensity[0];
  const glm::dvec3 r = light.position_m - position;
  const double distance = glm::length(r);
  double h = light.intensity[0] * std::max(0.0, glm::dot(normal, r)) / std::pow(distance, 3);
  if (light.kind == Kind::spot) {
    const double c = -glm::dot(light.direction, r) / distance, outer = std::cos(light.outer_cone_rad);
    const double ramp = std::clamp((c - outer) / (std::cos(light.inner_cone_rad) - outer), 0.0, 1.0);
    h *= ramp * ramp;
  }
  return h;
}

TEST(LightsInSolve, PointLightAboveAPlane) {
  const PunctualLight light = point_light({0.3, -0.2, 1.5}, 7);
  for (const Precision precision : {Precision::float32, Precision::float64})
    EXPECT_EQ(
        expect_irradiance(
            black({ground()}, {light}),
            [&](const glm::dvec3& x, const glm::dvec3& n) { return irradiance_by(light, x, n); }, precision),
        17 * 17);
}

// Positions scale with the unit of length, candela do not: the same numbers in kilometres give a millionth.
TEST(LightsInSolve, AnySizeAndPlace) {
  for (const double size : {1e-6, 1e3}) {
    const glm::dvec3 away = glm::dvec3(1e3, -2e3, 5e2) * size;
    Polygon floor = ground();
    for (auto& corner : floor.corner) corner = corner * size + away;
    const PunctualLight light = point_light(glm::dvec3(0.3, -0.2, 1.5) * size + away, 7);
    expect_irradiance(
        black({floor}, {light}),
        [&](const glm::dvec3& x, const glm::dvec3& n) { return irradiance_by(light, x, n); },
        Precision::float32, meshed(0.5 * size, 0.25 * size));
  }
}

// A light far outside the scene: the frame is made larger for it. Positions still have 48 bits of it.
TEST(LightsInSolve, FarLight) {
  const PunctualLight light = point_light({100, 0, 800}, 7e6);
  expect_irradiance(
      black({ground(), shade_at(0.5)}, {light}),
      [&](const glm::dvec3& x, const glm::dvec3& n) {
        const glm::dvec3 hit = x + 0.5 / 800 * (light.position_m - x);  // in the plane of the shade
        const double edge = std::max(std::abs(hit.x), std::abs(hit.y));
        return std::abs(edge - 0.25) < 1e-3 ? -1 : edge < 0.25 ? 0 : irradiance_by(light, x, n);
      },
      Precision::float32);
}

TEST(LightsInSolve, SpotLightFadesBetweenItsCones) {
  const PunctualLight light = spot_light({0.1, 0.05, 1}, {0.1, -0.2, -1}, 5, 0.3, 0.6);
  int inside = 0, between = 0, outside = 0;
  for (const Precision precision : {Precision::float32, Precision::float64})
    expect_irradiance(
        black({ground()}, {light}),
        [&](const glm::dvec3& x, const glm::dvec3& n) {
          const double angle = std::acos(glm::dot(glm::normalize(x - light.position_m), light.direction));
          ++(angle < 0.3 ? inside : angle < 0.6 ? between : outside);
          return std::abs(angle - 0.6) < 1e-6 ? -1 : irradiance_by(light, x, n);
        },
        precision);
  EXPECT_GT(inside, 20);
  EXPECT_GT(between, 100);
  EXPECT_GT(outside, 100);
}

TEST(LightsInSolve, SharpSpotLight) {
  const PunctualLight light = spot_light({0, 0, 1}, {0, 0, -1}, 5, 0.5, 0.5);
  const PunctualLight all_around = point_light({0, 0, 1}, 5);
  expect_irradiance(
      black({ground()}, {light}),
      [&](const glm::dvec3& x, const glm::dvec3& n) {
        const double angle = std::atan2(std::hypot(x.x, x.y), 1 - x.z);
        return std::abs(angle - 0.5) < 1e-3 ? -1 : angle < 0.5 ? irradiance_by(all_around, x, n) : 0;
      },
      Precision::float32);
}

TEST(LightsInSolve, DirectionalLight) {
  for (const glm::dvec3 direction : {glm::dvec3(0, 0, -1), {0.4, -0.7, -0.5}, {0.4, -0.7, 0.5}}) {
    const PunctualLight light = light_of(Kind::directional, {}, direction, {3});
    for (const Precision precision : {Precision::float32, Precision::float64})
      expect_irradiance(
          black({ground()}, {light}),
          [&](const glm::dvec3& x, const glm::dvec3& n) { return irradiance_by(light, x, n); }, precision);
  }
}

// Below a shade in z = 0.5: exactly nothing in its shadow, everything beside it. Directions are rounded to a float, so a
// directional shadow's edge is known to 1e-6; vertices nearer to it are left out.
TEST(LightsInSolve, ShadowsAreExact) {
  const PunctualLight lamp = point_light({0.1, 0.2, 1.5}, 4);
  const PunctualLight sun = light_of(Kind::directional, {}, {0.3, 0.1, -1}, {2});
  for (const PunctualLight& light : {lamp, sun}) {
    int dark = 0, lit = 0;
    expect_irradiance(
        black({ground(), shade_at(0.5)}, {light}),
        [&](const glm::dvec3& x, const glm::dvec3& n) {
          const glm::dvec3 to = light.kind == Kind::point ? light.position_m - x : -light.direction;
          const glm::dvec3 hit = x + 0.5 / to.z * to;
          const double edge = std::max(std::abs(hit.x), std::abs(hit.y));
          if (std::abs(edge - 0.25) < 1e-6) return -1.0;
          ++(edge < 0.25 ? dark : lit);
          return edge < 0.25 ? 0.0 : irradiance_by(light, x, n);
        },
        Precision::float32);
    EXPECT_GT(dark, 10);
    EXPECT_GT(lit, 100);
  }
}

// Also of a plane that is turned so that nothing about it is a round number.
TEST(LightsInSolve, NothingComesFromTheOwnPlane) {
  const glm::dvec3 u = glm::normalize(glm::dvec3(1, 0.3, 0.7)),
                   w = glm::normalize(glm::cross(u, glm::dvec3(0.2, 1, -0.4))), corner(0.1, 0.7, -0.3);
  const Scene scene = black({polygon({corner, corner + u, corner + u + w, corner + w})},
                            {point_light(corner + 3.3 * u + 0.4 * w, 1e3)});
  for (const Precision precision : {Precision::float32, Precision::float64})
    for (const double h : solve(test::device(precision), scene, meshed(0.5, 0.125)).vertex_irradiance)
      EXPECT_EQ(h, 0);
}

// A lamp on the ceiling lights the floor and not the roof's other side, and the report says what it is taken for.
TEST(LightsInSolve, LightOnASurfaceIsInFrontOfIt) {
  const Polygon ceiling = polygon({{-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}}),
                above = polygon({{-1, -1, 2}, {-1, 1, 2}, {1, 1, 2}, {1, -1, 2}});
  const PunctualLight light = point_light({0.3, 0.2, 1}, 2);
  const Scene scene = black({ground(), ceiling, above}, {light});
  expect_irradiance(
      scene, [&](const glm::dvec3& x, const glm::dvec3& n) { return irradiance_by(light, x, n); },
      Precision::float32);
  const Solution s = solve(test::device(), scene, meshed(0.5, 0.125));
  for (std::size_t v = 0; v < s.mesh.receivers.size(); ++v) {
    if (s.mesh.receivers[v].surface == 0) continue;
    EXPECT_EQ(s.vertex_irradiance[v], 0);
  }
  ASSERT_EQ(s.report.warnings.size(), 1u);
  EXPECT_NE(s.report.warnings[0].find("lies on a surface"), std::string::npos);
}

TEST(LightsInSolve, ShutInLightIsWarnedOf) {
  const Scene scene = black({ground(), shade_at(0.5)}, {point_light({0, 0, -1}, 2)});
  const auto warnings = solve(test::device(), scene, meshed(0.5, 0.125)).report.warnings;
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings[0].find("reaches no front"), std::string::npos);
}

TEST(LightsInSolve, SensorsSeeThem) {
  const PunctualLight lamp = point_light({0.1, 0.2, 1.5}, 4);
  SolveOptions options = meshed(0.5, 0.125);
  options.sensors = {
      {{0.7, 0.3, 0.25}, {0, 0, 1}}, {{0, 0, 0.25}, {0, 0, 1}}, {{0.7, 0.3, 0.25}, {0, 0, -1}}};
  const auto sensors = solve(test::device(), black({ground(), shade_at(0.5)}, {lamp}), options).sensors;
  const double h = irradiance_by(lamp, options.sensors[0].position_m, options.sensors[0].normal);
  EXPECT_NEAR(sensors[0].irradiance[0], h, 1e-5 * h);  // rounding, as above, of a position in decimals
  EXPECT_EQ(sensors[1].irradiance[0], 0);
  EXPECT_EQ(sensors[2].irradiance[0], 0);
  EXPECT_EQ(sensors[0].irradiance_error[0], 0);
}

// A light outside the frame that the scene alone would have, and a sensor as far out on the other side.
TEST(LightsInSolve, SensorsFarOutSeeDirectionalLights) {
  const PunctualLight sun = light_of(Kind::directional, {}, {0, 0, -1}, {2});
  SolveOptions options = meshed(0.5, 0.125);
  options.sensors = {{{0.1, 0.1, 7}, {0, 0, 1}}, {{0.1, 0.1, -7}, {0, 0, 1}}, {{3, 3, -7}, {0, 0, 1}}};
  const auto sensors = solve(test::device(), black({ground()}, {sun}), options).sensors;
  EXPECT_EQ(sensors[0].irradiance[0], 2);
  EXPECT_EQ(sensors[1].irradiance[0], 0);
  EXPECT_EQ(sensors[2].irradiance[0], 2);
}

// The flux of a spot by the midpoint rule over its cone, whose error is some (range / n)^2 / 24 of the second derivative.
TEST(LightsInSolve, SolidAngles) {
  EXPECT_DOUBLE_EQ(point_light({}, 1).solid_angle_sr(), 4 * pi);
  for (const auto& [inner, outer] : {std::pair{0.0, 0.7}, {0.3, 0.31}, {0.5, 0.5}, {0.2, pi / 2}}) {
    const PunctualLight spot = spot_light({}, {0, 0, -1}, 1, inner, outer);
    double sum = 0;
    constexpr int n = 200000;
    for (int i = 0; i < n; ++i) {
      const double a = outer * (i + 0.5) / n, width = std::cos(inner) - std::cos(outer);
      const double ramp = a < inner ? 1 : (std::cos(a) - std::cos(outer)) / width;
      sum += 2 * pi * std::sin(a) * ramp * ramp * outer / n;
    }
    EXPECT_NEAR(spot.solid_angle_sr(), sum, 1e-5 * sum) << inner << " " << outer;
  }
}

// Emission, absorption and what is unshot balance in a closed room up to the mesh, each light's power as it should be.
TEST(LightsInSolve, EnergyBalances) {
  Scene scene = oracle::box_scene({2, 3, 1}, {0.5}, {0});
  scene.lights = {point_light({0.7, 1.1, 0.4}, 3), spot_light({1, 1.5, 0.6}, {0.3, 0.4, -1}, 5, 0.2, 1)};
  const auto energy = solve(test::device(), scene, meshed(0.5, 0.1)).report.energy;
  EXPECT_TRUE(energy.closed);
  EXPECT_DOUBLE_EQ(energy.emitted[0], 4 * pi * 3 + 5 * scene.lights[1].solid_angle_sr());
  EXPECT_LT(std::abs(energy.unaccounted_relative), 0.01);  // elements of 0.1 m, 0.4 m from the nearer light
}

// Of directional lights what arrives counts: cos x area of the floor.
TEST(LightsInSolve, EnergyOfDirectionalLights) {
  const PunctualLight sun = light_of(Kind::directional, {}, {0.6, 0, -0.8}, {2});
  const auto energy = solve(test::device(), black({ground()}, {sun}), meshed(0.5, 0.125)).report.energy;
  EXPECT_NEAR(energy.emitted[0], 2 * 0.8 * 4, 1e-6);
  EXPECT_NEAR(energy.absorbed[0], 2 * 0.8 * 4, 1e-6);
}

// Room of 4 x 3 x 2.5 m with a block: lit by a point and a spot light besides its lamp.
Scene lit_block_room() {
  Scene scene = oracle::block_room();
  scene.lights = {light_of(Kind::point, {1, 1, 1.2}, {0, 0, -1}, {3, 2, 1}),
                  light_of(Kind::spot, {3, 2.5, 2}, {-0.2, -0.3, -1}, {4, 4, 8})};
  return scene;
}

double mean_difference(const Solution& a, const Solution& b) {
  double sum = 0, mean = 0;
  for (std::size_t i = 0; i < a.vertex_irradiance.size(); ++i)
    sum += std::abs(a.vertex_irradiance[i] - b.vertex_irradiance[i]), mean += a.vertex_irradiance[i];
  return sum / mean;
}

// As GatheringTest: what is unshot is at most 2 x converge of the mean, and float sums over 72 columns add 1e-5.
TEST(LightsInSolve, AllSolversAgree) {
  Device& device = test::device();
  const Scene scene = lit_block_room();
  SolveOptions options = meshed(1, 0.25);
  options.converge = 1e-5;
  const Solution shot = solve(device, scene, options);
  EXPECT_LT(shot.unshot_relative, 1e-5);
  for (const Solver solver : {Solver::gathering, Solver::gauss_seidel, Solver::progressive}) {
    SolveOptions with = options;
    with.solver = solver;
    if (solver == Solver::progressive) with.shooters = 8;
    EXPECT_LT(mean_difference(shot, solve(device, scene, with)), 3e-5) << int(solver);
  }
}

// Light is linear: lamp and lights together are the lamp alone and the lights alone.
TEST(LightsInSolve, LightAddsUp) {
  Device& device = test::device();
  const Scene both = lit_block_room();
  Scene lamp = both, lights = both;
  lamp.lights.clear();
  for (Material& m : lights.materials) m.emitted_exitance.assign(3, 0);
  SolveOptions options = meshed(1, 0.25);
  options.converge = 1e-5;
  options.near_field = false;  // its weights are ratios of radiosities
  options.light_samples = 0;   // or the number of rays to the lamp would follow its share of the power
  Solution sum = solve(device, both, options);
  const Solution a = solve(device, lamp, options), b = solve(device, lights, options);
  Solution parts = a;
  for (std::size_t i = 0; i < parts.vertex_irradiance.size(); ++i)
    parts.vertex_irradiance[i] += b.vertex_irradiance[i];
  EXPECT_LT(mean_difference(sum, parts), 6e-5);  // three solves of 2 x converge each
}

// Floor alone under a black shade: nothing is reflected onto it, so every vertex, new ones included, has the closed form.
TEST(LightsInSolve, NewVerticesGetTheirLight) {
  const PunctualLight light = point_light({0.1, 0.2, 1.5}, 4);
  Scene scene = black({ground(), shade_at(0.5)}, {light});
  scene.materials.push_back(test::material(1, 0.5));
  scene.polygons[0].material = 1;
  SolveOptions options = meshed(0.5, 0.25);
  options.adaptive.tolerance = 0.1;
  options.adaptive.max_level = 2;
  const int compared = expect_irradiance(
      scene,
      [&](const glm::dvec3& x, const glm::dvec3& n) {
        const glm::dvec3 hit = x + 0.5 / light.position_m.z * (light.position_m - x);
        const double edge = std::max(std::abs(hit.x), std::abs(hit.y));
        if (std::abs(edge - 0.25) < 1e-6) return -1.0;
        return edge < 0.25 ? 0.0 : irradiance_by(light, x, n);
      },
      Precision::float32, options);
  EXPECT_GT(compared, 9 * 9 + 50);  // the shadow's edge was refined
  // By interpolation some are wrong, and that is all that the option is for.
  options.adaptive.interpolate_new = true;
  const Solution s = solve(test::device(), scene, options);
  int wrong = 0;
  for (std::size_t v = 81; v < s.mesh.receivers.size(); ++v) {
    const Point& p = s.mesh.receivers[v];
    const double h = irradiance_by(light, s.frame.from_frame(p.position), p.normal);
    wrong +=
        p.surface == 0 && s.vertex_irradiance[v] > 1e-3 && std::abs(s.vertex_irradiance[v] - h) > 0.1 * h;
  }
  EXPECT_GT(wrong, 0);
}

// An adaptive solve comes to what a fine one has where both have vertices.
TEST(LightsInSolve, AdaptiveAgreesWithFine) {
  Device& device = test::device();
  const Scene scene = lit_block_room();
  SolveOptions options = meshed(1, 0.125);
  options.sensors = {{{2, 1, 1}, {0, 0, 1}}, {{0.5, 2.5, 0.3}, {0.6, 0, 0.8}}, {{3.5, 1, 1.2}, {-1, 0, 0}}};
  const Solution fine = solve(device, scene, options);
  options.mesh = {1, 0.5};
  options.adaptive.tolerance = 0.1, options.adaptive.every = 8;
  const Solution adaptive = solve(device, scene, options);
  EXPECT_GT(adaptive.report.refinement.vertices_added, 100u);
  for (std::size_t s = 0; s < options.sensors.size(); ++s)
    for (std::size_t b = 0; b < 3; ++b)
      EXPECT_NEAR(adaptive.sensors[s].irradiance[b] / fine.sensors[s].irradiance[b], 1, 0.01) << s;
  EXPECT_LT(std::abs(adaptive.report.energy.unaccounted_relative), 0.02);
}

// Rows are closed at reflectance 0.95; the lights' own part is no part of a row, so what closing does not touch in a room
// without interreflection it does not touch here: the mean is flux / area / (1 - rho).
TEST(LightsInSolve, ClosedRows) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.95}, {0});
  scene.lights = {point_light({0.5, 0.5, 0.5}, 1)};
  for (const Closure closure : {Closure::automatic, Closure::on}) {
    SolveOptions options = meshed(0.25, 0.0625);
    options.converge = 1e-5;
    options.closure = closure;
    const Solution s = solve(test::device(), scene, options);
    EXPECT_TRUE(s.report.closure.applied);
    EXPECT_TRUE(s.report.closure.converges);
    double mean = 0;
    for (const PolygonMean& p : polygon_means(s)) mean += p.irradiance[0] / 6;
    // Direct light is the only discretisation left: elements of 1/16, at distance 1/2: (1/8)^2 / 12 of it.
    EXPECT_NEAR(mean / (4 * pi / 6 / 0.05), 1, 0.002);
    // By symmetry all faces are alike, so that of a wall's middle vertices: what is direct stands on top undivided.
    double low = INFINITY, high = 0;
    for (std::size_t v = 0; v < s.mesh.receivers.size(); ++v) {
      const glm::dvec3 off = glm::abs(s.mesh.position_m[v] - 0.5);
      if (off.x + off.y + off.z < 0.5 + 1e-9)
        low = std::min(low, s.vertex_irradiance[v]), high = std::max(high, s.vertex_irradiance[v]);
    }
    EXPECT_NEAR(high / low, 1, 1e-3);
  }
}

class LightsResumed : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }
  std::string file_ =
      (std::filesystem::temp_directory_path() / ("clrad_lights_" + std::to_string(::getpid()))).string();
};

TEST_F(LightsResumed, GoOnWithTheSameBits) {
  Device& device = test::device();
  const Scene scene = lit_block_room();
  for (const bool adaptive : {false, true})
    for (const Solver solver : {Solver::progressive, Solver::gauss_seidel}) {
      SolveOptions options = meshed(1, 0.5);
      options.solver = solver;
      if (adaptive) options.adaptive.tolerance = 0.1, options.adaptive.every = 8;
      const Solution whole = solve(device, scene, options);
      SolveOptions first = options;
      first.checkpoint = file_, first.checkpoint_every_s = 0;
      int left = 20;
      first.progress = [&](const Progress&) { return left-- > 0; };
      ASSERT_TRUE(solve(device, scene, first).stopped);
      options.resume = file_;
      const Solution resumed = solve(device, scene, options);
      EXPECT_EQ(resumed.vertex_irradiance, whole.vertex_irradiance);
      EXPECT_EQ(resumed.patch_irradiance, whole.patch_irradiance);
      EXPECT_EQ(resumed.unshot_relative, whole.unshot_relative);
      EXPECT_EQ(resumed.report.rays, whole.report.rays);
      EXPECT_EQ(resumed.report.energy.emitted, whole.report.energy.emitted);
      options.without = {"lights"};
      EXPECT_THROW(solve(device, scene, options), InputError);
    }
}

// Keldysh's cube: 10 m, 50,000 cd in its middle, rho = 2/3. In all flux / ((1 - rho) area) = 4 pi 50000 / (600 / 3) = 3141.6 lm/m^2
// fall on a wall, of which it reflects a luminance of rho / pi.
TEST(KeldyshCube, MeanLuminance) {
  const Scene scene = load_scene(std::string(CLRAD_SCENES) + "/keldysh.gltf");
  const Solution s = solve(test::device(), scene);
  double luminance = 0;
  for (const PolygonMean& p : polygon_means(s)) luminance += p.radiosity[0] / pi / 6;
  EXPECT_NEAR(luminance, 2000.0 / 3, 0.005 * 2000.0 / 3);
  EXPECT_TRUE(s.report.warnings.empty()) << s.report.warnings[0];
}

// The middle of a face, and 0.1 m from the edges at its corner. References: B = rho (H_direct + F B) collocated in double on 24^2
// and 32^2 rectangles of a face, graded towards its edges, all six faces alike, with exact factors of points to rectangles; from 893.98
// and 421.82 at 32^2, less what an error of 1/n^2 leaves (by which the mean comes out as 666.70, so they are good to 0.1 %). Errors of the
// middle go with the square of the edge of elements; where three faces meet radiosity is no smooth function of the place, and halving them
// is what finer elements do there. Closer than the references are good to nothing is asked.
TEST(KeldyshCube, CentreAndCornerConverge) {
  const Scene scene = load_scene(std::string(CLRAD_SCENES) + "/keldysh.gltf");
  const std::array<double, 2> reference{892.8, 420.3};
  std::array<double, 2> before{INFINITY, INFINITY};
  for (const double cells : {4.0, 8.0, 16.0}) {
    SolveOptions options = meshed(20 / cells, 10 / cells);
    options.converge = 1e-6;
    options.sensors = {{{5, 5, 0}, {0, 0, 1}}, {{0.1, 0.1, 0}, {0, 0, 1}}};
    const Solution s = solve(test::device(), scene, options);
    for (std::size_t k = 0; k < 2; ++k) {
      const double luminance = 2.0 / 3 * s.sensors[k].irradiance[0] / pi;
      const double error = std::abs(luminance / reference[k] - 1);
      EXPECT_LT(error, std::max(0.6 * before[k], 0.001))
          << (k ? "corner" : "centre") << ", " << cells << " cells";
      before[k] = error;
    }
  }
  EXPECT_LT(before[0], 0.002);
  EXPECT_LT(before[1], 0.04);
}

}  // namespace
}  // namespace clrad
