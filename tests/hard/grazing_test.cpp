// Lamps and receivers at angles of 1e-1 to 1e-7: grazing, nearly coplanar, edge-on. Expected: Lambert's formula with 34
// digits at the corners as given.
//
// What is allowed, beside a factor's 1e-5 (double: 1e-12):
// - A receiver's normal is a float (a double) per component: it is off by at most sqrt(3) 2^-25 (sqrt(3) 2^-53 with the
//   host's normalising), and F = n . Phi by that times |Phi|, Phi being the vector of the factors for normals x, y, z.
//   Axis-parallel normals are exact.
// - Corners and points are put into the frame by rounding to 2^-53 of it, and to 2^-49 in float pairs. What is 1e-7 above a
//   plane is off by that over 1e-7; a factor that goes with the square of the height by twice that, and by four times where
//   both ends round.
#include <gtest/gtest.h>

#include "hard/obj_scene.hpp"
#include "hard/table.hpp"
#include "oracle/point_factor.hpp"

namespace clrad {
namespace {

using oracle::Quad;
using test::Corners;
using test::HardCase;
using test::ObjScene;
using test::precisions;

constexpr double factor_tolerance[] = {1e-5, 2e-12};
const double normal_error[] = {std::sqrt(3.0) * 0x1p-25, 4 * 0x1p-53};
const double place_error[] = {4 * 0x1p-49, 8 * 0x1p-53};

// A turn by no simple angle, the same for points and normals.
glm::dvec3 turned(const glm::dvec3& p) {
  static const glm::dvec3 x = glm::normalize(glm::dvec3(3, 1, -2)), y = glm::normalize(glm::dvec3(1, 3, 3)),
                          z = glm::cross(x, y);
  return x * p.x + y * p.y + z * p.z;
}

double vector_factor(const glm::dvec3& p, const Corners& lamp) {
  double squares = 0;
  for (const glm::dvec3& axis : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
    for (const double sign : {1.0, -1.0})
      squares += std::pow(double(oracle::point_factor<Quad>(p, sign * axis, lamp)), 2);
  return std::sqrt(squares);
}

// Asks for the factor of `lamp` at each receiver; `height` is the smallest distance from a plane that matters.
void ask(HardCase& verdict, const Corners& lamp, const std::vector<Sensor>& receivers, double height,
         bool turn, const std::string& where, std::size_t p, Device& device) {
  Corners corners = lamp;
  std::vector<Sensor> sensors = receivers;
  if (turn) {
    for (auto& c : corners) c = turned(c);
    for (auto& s : sensors) s = {turned(s.position_m), turned(s.normal)};
  }
  ObjScene scene;
  scene.lamp(corners);
  const auto got =
      test::irradiance(device, scene.load(), test::lamp_options(test::longest_edge(lamp), 4, sensors));
  for (std::size_t i = 0; i < got.size(); ++i) {
    const double expected =
        double(oracle::point_factor<Quad>(sensors[i].position_m, sensors[i].normal, corners));
    const double normals = turn ? normal_error[p] * vector_factor(sensors[i].position_m, corners) : 0;
    verdict.relative(got[i], expected, factor_tolerance[p] + place_error[p] / height,
                     fmt::format("{} receiver {}", where, i), normals);
  }
}

TEST(HardGrazing, LampsJustAboveTheHorizon) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(
        fmt::format("A lamp 1e-1 to 1e-7 rad above the receiver's horizon, upright, and parallel to it, {}",
                    p ? "double" : "float"),
        "Cosines of 1e-7 from unit vectors in floats: off by 60 %; the lamp is culled");
    Device device({.precision = precisions[p]});
    for (const double h : {1e-1, 1e-3, 1e-5, 1e-6, 1e-7})
      for (const bool turn : {false, true}) {
        const std::vector<Sensor> receivers{{{0, 0, 0}, {0, 0, 1}}, {{0.5, 0.25, 0}, {0, 0, 1}}};
        // Upright, facing the receivers, from h to 2 h; then face down at height h.
        ask(verdict, {{1, -0.5, h}, {1, -0.5, 2 * h}, {1, 0.5, 2 * h}, {1, 0.5, h}}, receivers, h, turn,
            fmt::format("upright {}{}", h, turn ? " turned" : ""), p, device);
        ask(verdict, {{1, -0.5, h}, {1, 0.5, h}, {2, 0.5, h}, {2, -0.5, h}}, receivers, h, turn,
            fmt::format("parallel {}{}", h, turn ? " turned" : ""), p, device);
      }
  }
}

TEST(HardGrazing, LampsSeenEdgeOn) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(
        fmt::format("Receivers in the plane of a lamp, and 1e-1 to 1e-9 before and behind it, {}",
                    p ? "double" : "float"),
        "Which side is a matter of rounding: the lamp's back shines, or its front is lost");
    Device device({.precision = precisions[p]});
    const Corners lamp{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};  // faces +x
    for (const double d : {1e-1, 1e-3, 1e-5, 1e-7, 1e-9})
      for (const bool turn : {false, true}) {
        const glm::dvec3 n = glm::normalize(glm::dvec3(-1, 0.25, 1));
        ask(verdict, lamp, {{{d, 0.5, -0.25}, n}, {{d, 2, 0.5}, {0, -1, 0}}, {{d, -1, -1}, {0, 0, 1}}}, d,
            turn, fmt::format("{} before{}", d, turn ? ", turned" : ""), p, device);
        ask(verdict, lamp, {{{-d, 0.5, -0.25}, n}, {{-d, 2, 0.5}, {0, -1, 0}}}, d, turn,
            fmt::format("{} behind{}", d, turn ? ", turned" : ""), p, device);
      }
    ask(verdict, lamp, {{{0, 2, 0.5}, {0, -1, 0}}, {{0, 0.5, -1}, {0, 0, 1}}}, 1, false, "in its plane", p,
        device);
  }
}

// Two squares that share an edge and meet at pi - angle: vertices of the one see the other at `angle` and less. The solve
// itself delivers here, to its vertices in the frame.
TEST(HardGrazing, NearlyCoplanarShooterAndReceiver) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(
        fmt::format("Squares that share an edge at 180 degrees less 1e-1 to 1e-7 rad: every vertex, {}",
                    p ? "double" : "float"),
        "Taken for coplanar, factor 0; or 0/0 next to the shared edge");
    Device device({.precision = precisions[p]});
    for (const double angle : {1e-1, 1e-3, 1e-5, 1e-7}) {
      Scene scene;
      scene.bands = {"grey"};
      scene.materials = {{"lamp", {0}, {1}, {}}, {"black", {0}, {0}, {}}};
      Polygon receiver, lamp;
      receiver.corners = lamp.corners = 4;
      receiver.corner = {glm::dvec3(0, 0, 0), {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
      lamp.corner = {glm::dvec3(1, 0, 0), {2, 0, angle}, {2, 1, angle}, {1, 1, 0}};
      receiver.material = 1;
      scene.polygons = {receiver, lamp};
      SolveOptions options;
      options.mesh = {2, 0.125};
      options.samples = 1, options.light_samples = 0;
      options.near_field = false;
      const Solution s = solve(device, scene, options);
      const Patch& shooter = s.mesh.patches.at(1);
      const Corners corners(shooter.corner.begin(), shooter.corner.begin() + shooter.corners);
      for (std::uint32_t v = 0; v < s.mesh.polygons[0].vertices; ++v) {
        const Point& r = s.mesh.receivers[v];
        const double expected = double(oracle::point_factor<Quad>(r.position, r.normal, corners));
        // The distance from the lamp's plane is angle x distance from the edge, at least 1e-3 / 8 of it.
        const double height = angle * std::max(1e-4, double(corners[0].x - r.position.x));
        verdict.relative(s.vertex_irradiance[v], expected, factor_tolerance[p] + place_error[p] / height,
                         fmt::format("{} vertex {}", angle, v));
      }
    }
  }
}

}  // namespace
}  // namespace clrad
