// How much of a lamp a point sees past what stands in between: family B's points and family D's closed boxes, as OBJ files
// with sensors, through the public API and the command line.
#include <gtest/gtest.h>

#include <cmath>

#include "hard/obj_scene.hpp"
#include "hard/table.hpp"
#include "oracle/point_factor.hpp"

namespace clrad {
namespace {

using test::Corners;
using test::corners_of;
using test::HardCase;
using test::irradiance;
using test::ObjScene;

constexpr double exact_tolerance = 1e-5;  // of a factor in float, see point_factors_test.cpp

struct OccludedQuestion {
  std::string id;
  ObjScene scene;
  Corners lamp;
  SolveOptions options;
  unsigned elements = 1;         // along a side of the lamp
  std::size_t border_edges = 0;  // straight lines that can be a shadow's border on the lamp
};

OccludedQuestion question_of(const oracle::json& c, std::uint32_t rays) {
  OccludedQuestion q;
  q.id = c["id"];
  q.lamp = corners_of(c["light"]);
  q.scene.lamp(q.lamp);
  double longest = test::longest_edge(q.lamp);
  for (const auto& polygon : c["occluders"]) {
    q.scene.occluder(corners_of(polygon));
    q.border_edges += polygon.size();
    longest = std::max(longest, test::longest_edge(corners_of(polygon)));
  }
  std::vector<Sensor> sensors;
  for (const auto& r : c["receivers"]) sensors.push_back({oracle::vec(r["point"]), oracle::vec(r["normal"])});
  // A lamp next to a wall of 2 km stays one element, or the wall would be millions.
  q.elements = longest <= 4 * test::longest_edge(q.lamp) ? 64 : 1;
  q.options = test::lamp_options(q.elements > 1 ? test::longest_edge(q.lamp) : longest, q.elements, sensors);
  q.options.sensor_rays = rays;
  return q;
}

// Sampling error of the visible factor at a sensor. Every element k of the lamp gets m = 1 + rays f_k / F rays, shifted at
// random and independently of the others', and only elements that a shadow's border crosses can err. A straight border
// crosses fewer than 2 N of N x N elements. Each of the m rays to such an element errs by at most f_k / m x its own weight
// over the mean weight in the element, for which 2 is allowed (elements are small next to their distance; checked: the
// largest ratio of neighbours' factors). Evenly spread rays err less than independent ones, and for these Hoeffding's
// inequality bounds the error by sqrt(ln(2 / delta) / 2 x sum (2 f_k / m)^2 x m), delta = 1e-9.
double allowed_by_sampling(const OccludedQuestion& q, const Sensor& at) {
  const unsigned n = q.elements;
  const bool triangle = q.lamp.size() == 3;
  const glm::dvec3 o = q.lamp[0], u = q.lamp[1] - o, v = q.lamp.back() - o;
  std::vector<double> f;
  double total = 0;
  for (unsigned i = 0; i < n; ++i)
    for (unsigned j = 0; j < n; ++j) {
      if (triangle && i + j >= n) continue;
      const glm::dvec3 a = o + u * (double(i) / n) + v * (double(j) / n), du = u / double(n),
                       dv = v / double(n);
      const Corners element =
          triangle && i + j == n - 1 ? Corners{a, a + du, a + dv} : Corners{a, a + du, a + du + dv, a + dv};
      f.push_back(oracle::point_factor<double>(at.position_m, at.normal, element));
      total += f.back();
    }
  if (!(total > 0)) return 0;
  std::sort(f.rbegin(), f.rend());
  const std::size_t crossed = n == 1 ? 1 : std::min<std::size_t>(f.size(), 2 * n * q.border_edges);
  double squares = 0;
  for (std::size_t k = 0; k < crossed; ++k) {
    const double rays = 1 + std::floor(q.options.sensor_rays * f[k] / total);
    squares += 4 * f[k] * f[k] / rays;
  }
  return std::sqrt(0.5 * std::log(2 / 1e-9) * squares);
}

void judge(HardCase& sampled, HardCase& exact, const oracle::json& c, const OccludedQuestion& q,
           const std::vector<double>& got, const std::string& how) {
  ASSERT_EQ(got.size(), c["receivers"].size()) << q.id;
  for (std::size_t i = 0; i < got.size(); ++i) {
    const auto& r = c["receivers"][i];
    const std::string where = fmt::format("{} receiver {}{}", q.id, i, how);
    const double visible = r["F_visible"], whole = r["F_unoccluded"];
    // All or nothing has no sampling error.
    if (visible == 0)
      exact.near(got[i], 0, 0, where);
    else if (std::abs(visible - whole) <= 1e-12 * whole)
      exact.relative(got[i], whole, exact_tolerance, where);
    else
      sampled.near(got[i], visible, exact_tolerance * visible + allowed_by_sampling(q, q.options.sensors[i]),
                   where);
  }
}

TEST(HardVisibleLight, PenumbraUmbraContactAndPartition) {
  HardCase sampled("Penumbra behind squares, knife edges, strips, slats, tilted triangles, pentagons, boxes",
                   "Four shadow rays a lamp: steps in penumbras, holes between slats"),
      exact("Umbra, full light, behind a partition, at the foot of a wall and of a box",
            "Light leaks under a wall that stands on the floor; a receiver in a wall's plane is dark or NaN");
  Device device;
  for (const auto& c : test::cases_of("b_visible_light.json")) {
    const OccludedQuestion q = question_of(c, 65536);
    judge(sampled, exact, c, q, irradiance(device, q.scene.load(), q.options), "");
  }
}

TEST(HardVisibleLight, ThroughTheCommandLine) {
  HardCase sampled("Penumbra by `clrad solve --sensors`, all engines",
                   "The program's defaults differ from what was tested"),
      exact("Umbra, full light and contact by the same", "As above");
  std::size_t number = 0;
  for (const auto& c : test::cases_of("b_visible_light.json")) {
    ++number;
    if (!test::long_tests() && number != 3 && number != 8) continue;  // the 2 km knife edge; contact
    const OccludedQuestion q = question_of(c, 8192);
    for (const char* engine : {"serial", "chop", "shaft"})
      judge(sampled, exact, c, q, test::command_line_irradiance(q.scene, q.options, {"--engine", engine}),
            fmt::format(", {}", engine));
  }
}

TEST(HardVisibleLight, NothingLeavesOrEntersAClosedBox) {
  HardCase verdict("Receivers around a closed box with a lamp in it, and inside next to its edges",
                   "Light leaks through edges and corners of a closed box");
  const auto data = oracle::reference("d_hard_cases.json");
  for (const char* id : {"D-leak-box-around-light", "D-leak-light-outside"})
    for (const char* engine : {"serial", "chop", "shaft"})
      for (const Precision precision : {Precision::float32, Precision::float64}) {
        const auto& c = oracle::reference_case(data, id);
        ObjScene scene;
        scene.lamp(corners_of(c["light"]));
        for (const auto& t : c["triangles"]) scene.occluder(corners_of(t));
        std::vector<Sensor> sensors;
        for (const auto& r : c["receivers"])
          sensors.push_back({oracle::vec(r["point"]), oracle::vec(r["normal"])});
        SolveOptions options = test::lamp_options(4, 16, sensors);
        options.engine = engine;
        Device device({.precision = precision});
        for (const double h : irradiance(device, scene.load(), options)) verdict.near(h, 0, 0, id);
      }
}

TEST(HardVisibleLight, DuplicateOccluders) {
  // The bits of visibility are the same (crowded_test.cpp). Here rays are placed by the numbers of the lamp's elements, which
  // more polygons change, so that it is the factor that is compared.
  HardCase right("A square once, twice, back to back and 300 times: the factor past it",
                 "Coincident surfaces fight for each ray; more copies, more leaks");
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-dup-occluder");
  const Corners occluder = corners_of(c["occluder"]);
  OccludedQuestion q;
  q.id = "duplicates", q.lamp = corners_of(c["light"]), q.border_edges = 4, q.elements = 16;
  const Sensor sensor{oracle::vec(c["point"]), oracle::vec(c["normal"])};
  q.options = test::lamp_options(1, 16, {sensor});
  q.options.sensor_rays = 65536;
  for (const char* engine : {"serial", "chop", "shaft"})
    for (const int copies : {1, 2, -2, 300}) {
      ObjScene scene;
      scene.lamp(q.lamp);
      scene.occluder(occluder);
      for (int k = 1; k < std::abs(copies); ++k)
        scene.occluder(copies < 0 || k % 2 ? test::reversed(occluder) : occluder);
      q.options.engine = engine;
      Device device;
      Scene loaded = scene.load();
      // Copies neither emit nor reflect: what they are cut into is of no matter here.
      const auto got = irradiance(device, loaded, q.options);
      right.near(got.at(0), c["value"], exact_tolerance + allowed_by_sampling(q, sensor), engine);
    }
}

// A square that lies on the receiving square, in its plane and later in the file: what it covers gets nothing, the rest
// the light. The mean over the receiver is the integral over the rest. Elements of 1/32: the reference's edges lie on
// element edges or not, and an element that the outline crosses is off by at most its corners' light, so the mean by at
// most perimeter x h x the largest point factor / area.
TEST(HardVisibleLight, ASquareInContactWithTheReceiver) {
  HardCase verdict("A square lying on the receiving square, mean over the receiver",
                   "Coplanar: z-fighting, or the covered part shines through");
  const auto data = oracle::reference("b_area_occluded.json");
  const auto& c = oracle::reference_case(data, "B-ar-contact");
  const Corners receiver = corners_of(c["receiver"]), lamp = corners_of(c["light"]);
  ObjScene scene;
  const int grey = scene.material({0.5}, {0});
  scene.face(receiver, grey, "receiver");
  double perimeter = 0;
  for (const auto& o : c["occluders"]) {
    const Corners corners = corners_of(o);
    // It faces the same way, so that it lies on top.
    scene.face(glm::dot(glm::cross(corners[1] - corners[0], corners[2] - corners[0]),
                        glm::cross(receiver[1] - receiver[0], receiver[2] - receiver[0])) > 0
                   ? corners
                   : test::reversed(corners),
               scene.material({0}, {0}), "occluder");
    for (std::size_t k = 0; k < corners.size(); ++k)
      perimeter += glm::distance(corners[k], corners[(k + 1) % corners.size()]);
  }
  scene.lamp(lamp);
  double largest = 0;
  for (double u = 0.05; u < 1; u += 0.1)
    for (double v = 0.05; v < 1; v += 0.1)
      largest = std::max(
          largest,
          oracle::point_factor<double>(
              receiver[0] + (receiver[1] - receiver[0]) * u + (receiver.back() - receiver[0]) * v,
              glm::normalize(glm::cross(receiver[1] - receiver[0], receiver.back() - receiver[0])), lamp));
  for (const double h : {1.0 / 32, 1.0 / 64, 1.0 / 128}) {
    SolveOptions options;
    options.mesh = {0.25, h};
    Device device;
    const Solution s = solve(device, scene.load(), options);
    verdict.near(polygon_means(s).at(0).irradiance.at(0), c["value"], perimeter * h * largest,
                 fmt::format("elements of {}", h));
  }
}

}  // namespace
}  // namespace clrad
