// Form factors of points and polygons as a user gets them: the polygon as an OBJ file, the point as a sensor. All of family
// A's points and of family D's, in float and double, and through the command line.
//
// What is allowed. Each factor that the kernel gives is within 1e-5 of itself in float and 1e-12 in double
// (kernels/shared/factor.cl); all terms are positive, so sums over the polygon's elements keep that. An element cut by the
// receiver's horizon has in float heights of its corners only to 2^-46, in double to 2^-100, so that a last sliver above it
// may be off by 2^-44 / pi. Sums and the product with E = pi Ke / pi round 4 times more: within the 1e-5; in double 4e-16.
// Corners are put into the frame with one rounding of 2^-54 each: the cases that the table gives for that say so.
#include <gtest/gtest.h>

#include "hard/obj_scene.hpp"
#include "hard/table.hpp"

namespace clrad {
namespace {

using test::Corners;
using test::corners_of;
using test::HardCase;
using test::irradiance;
using test::ObjScene;
using test::precisions;

constexpr double tolerance[] = {1e-5, 2e-12};
const double horizon[] = {0x1p-44, 0x1p-98};
struct Question {
  std::string id;
  Corners polygon;
  std::vector<Sensor> receivers;
  std::vector<double> factors;
  Corners ground = {};  // a black polygon of the case that hides nothing
};

ObjScene scene_of(const Question& q) {
  ObjScene scene;
  scene.lamp(q.polygon);
  if (!q.ground.empty()) scene.occluder(q.ground);
  return scene;
}

// With one element the sensor sees the polygon itself; with 16 a side it sums over elements where it is near.
SolveOptions options_for(const Question& q, unsigned elements) {
  return test::lamp_options(
      std::max(test::longest_edge(q.polygon), q.ground.empty() ? 0 : test::longest_edge(q.ground)), elements,
      q.receivers);
}

void ask(HardCase& verdict, Device& device, const Question& q, unsigned elements, double allowed,
         double absolute) {
  const auto got = irradiance(device, scene_of(q).load(), options_for(q, elements));
  ASSERT_EQ(got.size(), q.factors.size());
  for (std::size_t i = 0; i < got.size(); ++i)
    verdict.relative(got[i], q.factors[i], allowed, fmt::format("{} receiver {}", q.id, i), absolute);
}

std::vector<Question> of_family_a() {
  std::vector<Question> all;
  for (const auto& c : test::cases_of("a_point_factors.json"))
    all.push_back({c["id"],
                   corners_of(c["polygon"]),
                   {{oracle::vec(c["element"]["point"]), oracle::vec(c["element"]["normal"])}},
                   {c["value"]}});
  return all;
}

std::vector<Question> of_receivers(const std::string& id) {
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, id);
  Question q{id, corners_of(c.contains("polygon") ? c["polygon"] : c["light"]), {}, {}};
  if (c.contains("floor")) q.ground = corners_of(c["floor"]);
  for (const auto& r : c["receivers"]) {
    q.receivers.push_back({oracle::vec(r["point"]), oracle::vec(r["normal"])});
    q.factors.push_back(r["F"]);
  }
  return {q};
}

TEST(HardPointFactors, FamilyAInFloatAndDouble) {
  const auto questions = of_family_a();
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(fmt::format("Points and polygons of every kind, {}", p ? "double" : "float"),
                     "Corner sums cancel far away; horizons clipped by the centre's side; concave polygons "
                     "taken for convex");
    Device device({.precision = precisions[p]});
    for (const Question& q : questions)
      for (const unsigned elements : {1u, 16u})
        ask(verdict, device, q, elements, tolerance[p], elements * elements * horizon[p]);
  }
}

TEST(HardPointFactors, FamilyAThroughTheCommandLine) {
  HardCase verdict("The same by `clrad solve --sensors`",
                   "The library is right and the program in front of it loses digits in text");
  std::size_t number = 0;
  for (const Question& q : of_family_a()) {
    if (!test::long_tests() && number++ % 12 != 5) continue;
    const SolveOptions options = options_for(q, 1);
    const ObjScene scene = scene_of(q);
    const auto got = test::command_line_irradiance(scene, options);
    ASSERT_EQ(got.size(), 1u) << q.id;
    verdict.relative(got[0], q.factors[0], tolerance[0], q.id, horizon[0]);
  }
}

TEST(HardPointFactors, JustBelowALampOnItsEdgesAndInItsPlane) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(
        fmt::format("Receivers 1e-12 to 0.1 below a 2 m lamp, above it and in its plane, {}",
                    p ? "double" : "float"),
        "Positions in floats: F is 0, NaN or above 1; an epsilon that moves the receiver changes F");
    Device device({.precision = precisions[p]});
    for (const Question& q : of_receivers("D-near-plane"))
      for (const unsigned elements : {1u, 16u}) ask(verdict, device, q, elements, tolerance[p], horizon[p]);
  }
}

TEST(HardPointFactors, TouchingAPerpendicularLamp) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(fmt::format("Floor points up to the edge of a lamp that stands on the floor, {}",
                                 p ? "double" : "float"),
                     "0/0 at the shared edge; F above 1/2");
    Device device({.precision = precisions[p]});
    for (const Question& q : of_receivers("D-touching-edge"))
      for (const unsigned elements : {1u, 16u}) ask(verdict, device, q, elements, tolerance[p], horizon[p]);
  }
}

// Far from the origin corners 1e-5 apart keep what the file's doubles keep; centring moves a corner by at most 2^-54 of the
// frame, 5.6e-12 of the width 1e-5.
TEST(HardPointFactors, Slivers) {
  const auto data = oracle::reference("d_hard_cases.json");
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(fmt::format("Triangles of aspect 1 : 100000, {}", p ? "double" : "float"),
                     "Dropped as degenerate, or areas and normals from cancelled cross products");
    Device device({.precision = precisions[p]});
    int asked = 0;
    for (const auto& c : data["cases"]) {
      if (c["kind"] != "point_to_polygon") continue;
      const Question q{c["id"],
                       corners_of(c["polygon"]),
                       {{oracle::vec(c["point"]), oracle::vec(c["normal"])}},
                       {c["value"]}};
      ask(verdict, device, q, 1, tolerance[p] + std::ldexp(1.0, -54) / 1e-5, horizon[p]);
      ++asked;
    }
    ASSERT_GE(asked, 4);
  }
}

// The frame is the floor's 2000 m: one unit is 1024 m. The light's corners, 1e-6 m apart and 10 m above the frame's centre,
// round by 2^-53 x 10 m in the file already; centring subtracts 5 m exactly. In float pairs a coordinate near 2^-8 of the frame
// has 48 bits, 2^-57 of the frame: 7.1e-15 m, 7e-9 of the light's side.
TEST(HardPointFactors, ALightOfAMicrometreInTwoKilometres) {
  for (std::size_t p = 0; p < 2; ++p) {
    HardCase verdict(fmt::format("A lamp of 1e-6 m above a floor of 2000 m, as near as 1e-6 m, {}",
                                 p ? "double" : "float"),
                     "The lamp collapses to a point or vanishes in the scene's precision; r^4 underflows");
    Device device({.precision = precisions[p]});
    for (const Question& q : of_receivers("D-size-ratio"))
      ask(verdict, device, q, 1, tolerance[p] + (p ? 0 : 4 * 0x1p-57 * 1024 / 1e-6), 0);
    // The floor shines, too: from 1e-6 m above it fills the hemisphere.
    const auto data = oracle::reference("d_hard_cases.json");
    const auto& c = oracle::reference_case(data, "D-size-ratio");
    const Question floor{"floor",
                         corners_of(c["floor"]),
                         {{{0, 0, 1e-6}, {0, 0, -1}}},
                         {c["floor_factor_from_1e-6_above"]},
                         corners_of(c["light"])};
    ask(verdict, device, floor, 1, tolerance[p], 0);
  }
}

TEST(HardPointFactors, RepeatedAndCollinearCorners) {
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-degenerate-but-valid");
  HardCase verdict("Squares with a repeated corner, with one on an edge",
                   "A zero-length edge divides by zero; a fan makes a triangle without area");
  Device device;
  for (const auto& polygon : c["polygons"])
    ask(verdict, device,
        {polygon["what"],
         corners_of(polygon["vertices"]),
         {{oracle::vec(c["point"]), oracle::vec(c["normal"])}},
         {c["value"]}},
        1, tolerance[0], 0);
}

TEST(HardPointFactors, NonPlanarQuad) {
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-nonplanar");
  HardCase verdict("A quad with one corner lifted by a tenth",
                   "One plane through three corners: the fourth is moved, and neighbours gape");
  Device device;
  Question q{"quad", corners_of(c["quad"]), {}, {}};
  for (const auto& r : c["receivers"]) {
    q.receivers.push_back({oracle::vec(r["point"]), oracle::vec(r["normal"])});
    q.factors.push_back(r["F"]);
  }
  for (const char* as : {"quad", "split_02", "split_13"}) {
    ObjScene scene;
    if (std::string(as) == "quad")
      scene.lamp(q.polygon);
    else
      for (const auto& triangle : c[as]) scene.lamp(corners_of(triangle));
    const auto got = irradiance(device, scene.load(), options_for(q, 1));
    for (std::size_t i = 0; i < got.size(); ++i)
      verdict.relative(got[i], q.factors[i], tolerance[0], fmt::format("{} receiver {}", as, i));
  }
}

TEST(HardPointFactors, CoincidentPolygonsExchangeNothing) {
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-dup-coincident-pair");
  HardCase verdict("Two polygons in the same place, back to back and facing the same way",
                   "0/0 between them: NaN in the solution");
  Device device;
  for (const char* other : {"polygon_b_back_to_back", "polygon_c_same"}) {
    ObjScene scene;
    const int a = scene.material({0.5}, {1}), b = scene.material({0.5}, {0});
    scene.face(corners_of(c["polygon_a"]), a, "a");
    scene.face(corners_of(c[other]), b, "b");
    const SolveOptions options;
    const Solution s = solve(device, scene.load(), options);
    for (const double h : s.vertex_irradiance) verdict.near(h, 0, 0, other);
  }
}

}  // namespace
}  // namespace clrad
