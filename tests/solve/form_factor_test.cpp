// Form factors on the device against reference answers, against 34-digit oracles on what the device was
// given, and against closure. Tolerances: 1e-5 relative in float and 1e-12 in double
// (kernels/shared/factor.cl accepts a formula only when its own bound is half of that).
#include "solve/form_factor.hpp"

#include <gtest/gtest.h>

#include <functional>
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
  form_factors(device, Estimator::exact, shooter, receivers, nullptr, std::uint32_t(points.size()), receivers,
               0, factors);
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
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    normal += glm::cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]);
  std::vector<std::pair<Polygon3, double>> parts;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    const double turn = glm::dot(normal, glm::cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]));
    if (turn > 0) parts.push_back({{polygon[0], polygon[k], polygon[k + 1]}, 1.0});
    if (turn < 0) parts.push_back({{polygon[0], polygon[k + 1], polygon[k]}, -1.0});
  }
  return parts;
}

struct Answer {
  double device;
  double oracle;  // 34 digits, at the coordinates that the device was given
};

Answer answer(Device& device, const Question& q) {
  Polygon3 all = q.polygon;
  all.push_back(q.point);
  all.insert(all.end(), q.scene.begin(), q.scene.end());
  const CaseFrame frame(all);
  Polygon3 corners;
  for (const auto& c : q.polygon) corners.push_back(frame(c));
  const glm::dvec3 point = frame(q.point), normal = glm::normalize(q.normal);
  Answer sum{0, 0};
  for (const auto& [part, sign] : parts_of(corners)) {
    sum.device += sign * exact_factors(device, shooter_of(part), {{point, normal, 1, 0}})[0];
    sum.oracle += sign * double(oracle::point_factor<Quad>(point, normal, part));
  }
  return sum;
}

std::vector<Question> questions() {
  std::vector<Question> all;
  const auto add = [&](const std::string& id, const oracle::json& polygon, const oracle::json& point,
                       const oracle::json& normal, double factor, const Polygon3& scene = {}) {
    all.push_back({id, polygon_of(polygon), vec(point), vec(normal), factor, scene});
  };
  const auto plain = oracle::reference("a_point_factors.json"), hard = oracle::reference("d_hard_cases.json");
  for (const auto& c : plain["cases"])
    add(c["id"], c["polygon"], c["element"]["point"], c["element"]["normal"], c["value"]);
  for (const auto& c : hard["cases"]) {
    const std::string id = c["id"];
    if (c["kind"] == "point_to_polygon") add(id, c["polygon"], c["point"], c["normal"], c["value"]);
    if (id == "D-near-plane" || id == "D-touching-edge")
      for (const auto& r : c["receivers"])
        add(id + " " + std::string(r["where"]), c["polygon"], r["point"], r["normal"], r["F"]);
    if (id == "D-size-ratio") {
      for (const auto& r : c["receivers"])
        add(id, c["light"], r["point"], r["normal"], r["F"], polygon_of(c["floor"]));
      all.push_back({id + " floor",
                     polygon_of(c["floor"]),
                     {0, 0, 1e-6},
                     {0, 0, -1},
                     c["floor_factor_from_1e-6_above"],
                     polygon_of(c["light"])});
    }
    if (c["kind"] == "invariance")
      for (const auto& v : c["variants"])
        add(id + " " + std::string(v["transform"]), v["polygon_2"], v["point"], c["normal"], c["F_point"],
            polygon_of(v["polygon_1"]));
    if (id == "D-tjunction")
      for (std::size_t k = 0; k < 3; ++k)
        add(id, c["polygons"][5 + k], c["point"], c["normal"], c["F_to_floor_parts"][k],
            polygon_of(c["polygons"][1]));
  }
  return all;
}

TEST(ExactFactor, MeetsTheReferenceInFloat) {
  Device device;
  const auto all = questions();
  ASSERT_GE(all.size(), 90u);
  for (const auto& q : all) EXPECT_NEAR(answer(device, q).device, q.factor, 1e-5 * q.factor) << q.id;
}

// Centring a sliver 1e-5 wide moves its corners by up to 2^-54 (half an ulp of 1/2), 5.6e-12 of its width:
// its factor from the reference is met to that, and to 1e-12 at the moved corners, as all others are at both.
TEST(ExactFactor, MeetsTheReferenceInDouble) {
  Device device({.precision = Precision::float64});
  for (const auto& q : questions()) {
    const Answer a = answer(device, q);
    const double moved = q.id.starts_with("D-sliver") ? std::ldexp(1.0, -54) / 1e-5 : 0;
    EXPECT_NEAR(a.device, q.factor, (1e-12 + moved) * q.factor) << q.id;
    EXPECT_NEAR(a.device, a.oracle, 1e-12 * a.oracle) << q.id;
  }
}

// ---- random hard cases
// ------------------------------------------------------------------------------------------------

struct RandomCase {
  Shooter shooter;
  Polygon3 corners;
  std::vector<Point> points;
};

// Multiples of 2^-26 below 1 are exact in a float pair, and so are sums and products of a few of them in
// double.
double dyadic(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> number(-size, size);
  return std::ldexp(std::round(std::ldexp(number(random), 26)), -26);
}

// A parallelogram or triangle of any size and aspect, exactly planar; receivers near and far, next to its
// plane, edges and corners, with any normal (rounded to float, so that both precisions see the same).
RandomCase random_case(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto pick = [&] { return std::pow(10.0, -4 * unit(random)); };
  const auto vector = [&](double size) {
    return glm::dvec3(dyadic(random, size), dyadic(random, size), dyadic(random, size));
  };
  RandomCase c;
  glm::dvec3 a, b;
  do {
    a = vector(0.5 * pick()), b = vector(0.5 * pick());
  } while (glm::length(glm::cross(a, b)) <= 1e-4 * glm::length(a) * glm::length(b) || glm::length(a) < 1e-5 ||
           glm::length(b) < 1e-5);
  const glm::dvec3 origin = vector(0.25);
  c.corners = unit(random) < 0.5 ? Polygon3{origin, origin + a, origin + a + b, origin + b}
                                 : Polygon3{origin, origin + a, origin + b};
  c.shooter = shooter_of(c.corners);
  for (int i = 0; i < 40; ++i) {
    glm::dvec3 p = vector(0.5);
    const double u = i % 4 == 1 ? 1 + 1e-3 * pick() : 3 * unit(random) - 1,
                 v = i % 4 == 2 ? 1e-3 * pick() : 3 * unit(random) - 1;
    if (i % 4) p = origin + u * a + v * b + c.shooter.normal * (0.3 * pick());
    for (int k = 0; k < 3; ++k) p[k] = std::ldexp(std::round(std::ldexp(p[k], 40)), -40);
    glm::dvec3 n = glm::normalize(vector(1));
    if (i % 8 == 7) n = -c.shooter.normal;
    if (i % 8 == 6) n = glm::normalize(glm::cross(a, c.shooter.normal));
    c.points.push_back({p, glm::dvec3(glm::vec3(n)), 1, 0});
  }
  return c;
}

// On what the device was given. The smallest plane distances are 3e-5: 2^-46 of rounding in pairs is below
// 1e-9 of them. Where the visible part is a last 1e-6 of the sphere at the horizon, heights above it
// (absolute error 2^-46) may be off by more than the tolerance: a term of 2^-44 / pi in float and 2^-100 in
// double covers it.
// scale: a power of two, about the origin of the frame, where positions are as exact at any size.
void meets_the_oracle(Precision precision, double tolerance, double absolute, double scale = 1) {
  constexpr std::uint64_t seed = 20261123;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  Device device({.precision = precision});
  int seen = 0;
  for (int i = 0; i < 60; ++i) {
    RandomCase c = random_case(random);
    for (auto& corner : c.corners) corner *= scale;
    for (auto& point : c.points) point.position *= scale;
    c.shooter = shooter_of(c.corners);
    const auto factors = exact_factors(device, c.shooter, c.points);
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const double exact =
          double(oracle::point_factor<Quad>(c.points[k].position, c.points[k].normal, c.corners));
      EXPECT_NEAR(factors[k], exact, tolerance * exact + absolute) << "case " << i << " receiver " << k;
      seen += exact > 0;
    }
  }
  EXPECT_GT(seen, 600);
}

TEST(ExactFactor, MeetsTheOracleOnRandomCasesInFloat) {
  meets_the_oracle(Precision::float32, 1e-5, std::ldexp(1.0, -46));
}
TEST(ExactFactor, MeetsTheOracleOnTheSameAMilliardthAsLarge) {
  meets_the_oracle(Precision::float32, 1e-5, std::ldexp(1.0, -46), std::ldexp(1.0, -30));
  meets_the_oracle(Precision::float64, 1e-12, std::ldexp(1.0, -100), std::ldexp(1.0, -30));
}
TEST(ExactFactor, MeetsTheOracleOnRandomCasesInDouble) {
  meets_the_oracle(Precision::float64, 1e-12, std::ldexp(1.0, -100));
}

// ---- closure
// ----------------------------------------------------------------------------------------------------------

// Faces of a closed convex solid sum to 1 from a receiver on one of them (its own face gives 0 by the plane
// rule). Each factor is within 1e-5 (1e-12) of itself, so the sum is within the same of 1; planes tilted at
// random are exact to 2^-48 (2^-53) of the frame, which at the nearest receiver, d = 1e-3 / 32 of an edge of
// at least 0.4, moves a face's directions by 2^-48 / 1e-5.
void closes(const std::vector<Polygon3>& faces, std::mt19937_64& random, Device& device, double tolerance) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double inset = 1e-3 / 32;
  std::vector<Point> points;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const Polygon3& c = faces[f];
    const glm::dvec3 normal = shooter_of(c).normal, a = c[1] - c[0], b = c.back() - c[0];
    const double most = c.size() == 3 ? 0.5 : 1.0;
    for (const double u : {inset, unit(random) * most})
      for (const double v : {inset, unit(random) * most, most - inset})
        if (c.size() == 4 || u + v < 1 - inset) points.push_back({c[0] + u * a + v * b, normal, f, f});
  }
  const PointArray receivers(device, points, "receivers");
  std::vector<double> sum(points.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    Shooter shooter = shooter_of(faces[f]);
    shooter.plane = f;
    RealArray factors(device, points.size(), "factors");
    form_factors(device, Estimator::exact, shooter, receivers, nullptr, std::uint32_t(points.size()),
                 receivers, 0, factors);
    const auto values = factors.download();
    for (std::size_t i = 0; i < sum.size(); ++i) {
      EXPECT_GE(values[i], 0);
      sum[i] += values[i];
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_NEAR(sum[i], 1, tolerance) << "receiver " << i;
}

void closes_everywhere(Precision precision, double tolerance) {
  constexpr std::uint64_t seed = 5;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> side(0.4, 1.0), number(-1, 1);
  Device device({.precision = precision});
  for (int i = 0; i < 12; ++i) {
    // A box turned at random, inward; then the tetrahedron at one of its corners.
    const glm::dvec3 x = glm::normalize(glm::dvec3(number(random), number(random), number(random)));
    const glm::dvec3 y =
        glm::normalize(glm::cross(x, glm::dvec3(number(random), number(random), number(random))));
    const glm::dvec3 z = glm::cross(x, y), a = x * side(random), b = y * side(random), c = z * side(random);
    const glm::dvec3 o = -0.5 * (a + b + c);
    closes({{o, o + b, o + b + c, o + c},
            {o + a, o + a + c, o + a + b + c, o + a + b},
            {o, o + c, o + a + c, o + a},
            {o + b, o + a + b, o + a + b + c, o + b + c},
            {o, o + a, o + a + b, o + b},
            {o + c, o + b + c, o + a + b + c, o + a + c}},
           random, device, tolerance);
    closes({{o, o + b, o + c}, {o, o + c, o + a}, {o, o + a, o + b}, {o + a, o + c, o + b}}, random, device,
           tolerance);
  }
}

TEST(ExactFactor, FacesOfClosedSolidsSumToOneInFloat) {
  closes_everywhere(Precision::float32, 1e-5);
}
TEST(ExactFactor, FacesOfClosedSolidsSumToOneInDouble) {
  closes_everywhere(Precision::float64, 1e-12 + std::ldexp(1.0, -53) / 1e-5);
}

// ---- ties and bad input
// -----------------------------------------------------------------------------------------------

TEST(ExactFactor, InTheShootersPlaneOnItsEdgesAndBehindIsZero) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const Shooter shooter =
        shooter_of({{0, 0, 0.25}, {0.5, 0, 0.25}, {0.5, 0.5, 0.25}, {0, 0.5, 0.25}});  // faces up
    const glm::dvec3 down(0, 0, -1), side(1, 0, 0);
    const double nan = std::nan("");
    const auto f = exact_factors(device, shooter,
                                 {{{0.25, 0, 0.25}, down, 1, 0},
                                  {{0, 0, 0.25}, side, 1, 0},
                                  {{0.25, 0.25, 0.25}, down, 1, 0},
                                  {{0.25, 0.25, 0.125}, down, 1, 0},
                                  {{0.25, 0.25, 0.125}, -down, 1, 0},
                                  {{0.25, 0.25, 0.5}, -down, 1, 0},
                                  {{0.25, 0.25, 0.5}, {nan, nan, nan}, 1, 0},
                                  {{0.25, 0.25, 0.5}, down, 0, 0},
                                  {{0.25, 0.25, 0.5}, down, 1, 0}});
    for (std::size_t i = 0; i + 1 < f.size(); ++i) EXPECT_EQ(f[i], 0) << i;
    EXPECT_GT(f.back(), 0.2);
  }
}

TEST(ExactFactor, SameBitsForTwoWorkGroupSizesAndOnTheHost) {
  constexpr std::uint64_t seed = 3;
  RecordProperty("seed", int(seed));
  Device device, other({.work_group_size = 16});
  std::mt19937_64 random(seed);
  for (int i = 0; i < 20; ++i) {
    const RandomCase c = random_case(random);
    const auto factors = exact_factors(device, c.shooter, c.points);
    EXPECT_EQ(factors, exact_factors(other, c.shooter, c.points));
    const auto record = shooter_record(c.shooter);
    std::array<float, shooter_record_size> shooter;
    std::copy(record.begin(), record.end(), shooter.begin());
    for (std::size_t k = 0; k < factors.size(); ++k) {
      const Point& p = c.points[k];
      const glm::vec3 hi(p.position), lo(p.position - glm::dvec3(hi)), n(p.normal);
      EXPECT_EQ(factors[k], kernel32::clrad_exact_factor(
                                shooter.data(), kernel32::clrad_make(hi.x, hi.y, hi.z),
                                kernel32::clrad_make(lo.x, lo.y, lo.z), kernel32::clrad_make(n.x, n.y, n.z)))
          << "case " << i << " receiver " << k;
    }
  }
}

// ---- sampled estimators
// -----------------------------------------------------------------------------------------------

// The sums of the paper and of Wallace, in double.
double disk_oracle(const Shooter& shooter, const Point& p, const std::vector<Point>& samples, bool whole_area,
                   const std::function<bool(std::size_t)>& visible) {
  const double n = double(samples.size()), disk = whole_area ? shooter.area : shooter.area / n;
  double sum = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const glm::dvec3 r = samples[k].position - p.position;
    const double r2 = glm::dot(r, r), here = glm::dot(p.normal, r), there = -glm::dot(shooter.normal, r);
    if (visible(k) && here > 0 && there > 0) sum += here * there / (r2 * (M_PI * r2 + disk));
  }
  return sum * shooter.area / n;
}

// Answers as a function of (origin, sample) stand in for an engine.
class AnswersBy : public VisibilityEngine {
 public:
  std::function<bool(std::size_t segment)> blocked;
  std::vector<Point> ends;
  std::string name() const override { return "test"; }
  void occluded(const Segments& segments, Array<std::uint32_t>& masks) override {
    ends = segments.targets->download();
    std::vector<std::uint32_t> words(segments.origin_count);
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = blocked(i);
    masks.upload(words);
  }
  void intersect_closest(const Segments&, Array<std::uint32_t>&, Array<float>&) override {}
  VisibilityCounts counts() const override { return {}; }
};

// Positive terms, each off by some 20 roundings and a receiver's cosine 3 eps / cos more; receivers keep cos
// above 0.01.
constexpr double sum_tolerance = (20 + 3 / 0.01) * 6e-8;

TEST(SampledFactors, MatchTheOracleWithAndWithoutMasks) {
  Device device;
  const Shooter shooter =
      shooter_of({{-0.3, 0.2, 0.5}, {0.3, 0.25, 0.5}, {0.25, -0.2, 0.5}, {-0.25, -0.3, 0.5}});
  const std::vector<Point> chosen_from = {{{0, 0, -0.5}, {0, 0, 1}, 1, 0},
                                          {{0.4, 0.4, 0.25}, {0.6, 0, 0.8}, 1, 0},
                                          {{0.1, -0.5, 0}, {0, 0.6, 0.8}, 1, 0},
                                          {{0, 0, 0}, {0, 0, 1}, 0, 0},
                                          {{0, 0, 0.75}, {0, 0, -1}, 1, 0}};
  const std::vector<std::uint32_t> order = {2, 0, 3, 4, 1};
  const PointArray receivers(device, chosen_from, "receivers");
  const Array<std::uint32_t> active(device, order, "active");
  for (const std::uint32_t n : {1u, 16u, 33u, 64u}) {
    const auto points = stratified_samples(shooter, n, 42);
    const PointArray samples(device, points, "samples");
    const std::uint32_t words = (n + 31) / 32;
    std::vector<std::uint32_t> bits(order.size() * words);
    std::mt19937 random(n);
    for (std::size_t w = 0; w < bits.size(); ++w)
      bits[w] = random() & (n % 32 && w % words == words - 1 ? (1u << n % 32) - 1 : 0xffffffffu);
    const Array<std::uint32_t> masks(device, bits, "masks");
    AnswersBy engine;
    engine.blocked = [](std::size_t) { return true; };
    for (const Estimator estimator : {Estimator::disk, Estimator::subdisk, Estimator::exact}) {
      RealArray factors(device, order.size(), "factors"), column(device, chosen_from.size(), "column");
      column.fill_zero();
      form_factors(device, estimator, shooter, receivers, &active, std::uint32_t(order.size()), samples, n,
                   factors);
      visible_factors(device, engine, estimator, shooter, receivers, &active, std::uint32_t(order.size()),
                      samples, n, masks, factors, column);
      const auto plain = factors.download(), visible = column.download();
      for (std::size_t i = 0; i < order.size(); ++i) {
        const Point& p = chosen_from[order[i]];
        const auto seen = [&](std::size_t k) { return !(bits[i * words + k / 32] >> k % 32 & 1); };
        double all = 0, some = 0;
        if (estimator == Estimator::exact) {
          double weights = 0, kept = 0;
          for (std::size_t k = 0; k < n; ++k) {
            const glm::dvec3 r = points[k].position - p.position;
            const double w = std::max(0.0, glm::dot(p.normal, r)) / std::pow(glm::dot(r, r), 2);
            weights += w, kept += seen(k) ? w : 0;
          }
          all = p.plane == shooter.plane ? 0
                                         : oracle::point_factor<double>(p.position, p.normal,
                                                                        {shooter.corner, shooter.corner + 4});
          some = weights > 0 ? all * kept / weights : 0;
        } else if (p.plane != shooter.plane) {
          all =
              disk_oracle(shooter, p, points, estimator == Estimator::disk, [](std::size_t) { return true; });
          some = disk_oracle(shooter, p, points, estimator == Estimator::disk, seen);
        }
        EXPECT_NEAR(plain[i], all, sum_tolerance * all)
            << "estimator " << int(estimator) << " n " << n << " receiver " << order[i];
        EXPECT_NEAR(visible[order[i]], some, sum_tolerance * all)
            << "estimator " << int(estimator) << " n " << n << " receiver " << order[i];
      }
      EXPECT_GT(plain[1], 0);
      EXPECT_EQ(plain[2], 0);
      EXPECT_EQ(plain[3], 0);
    }
  }
}

// A tall shooter of which only a tip is above the horizon; its one sample is below. The centroid of the tip
// decides.
TEST(VisibleFactors, TheCentroidOfTheVisibleTipDecidesWhereNoSampleDoes) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const Shooter shooter = shooter_of({{0.5, 0, 0.01}, {0.5, 0.5, -0.9}, {0.5, -0.5, -0.9}});  // faces -x
    const std::vector<Point> points = {{{-0.5, 0, 0}, {0, 0, 1}, 1, 0}, {{-0.25, 0, 0}, {0, 0, 1}, 1, 0}};
    const PointArray receivers(device, points, "receivers");
    const std::vector<Point> low = {{{0.5, 0, -0.5}, shooter.normal, 0, 0}};
    const PointArray samples(device, low, "samples");
    const Array<std::uint32_t> masks(device, std::vector<std::uint32_t>{1, 1}, "masks");
    RealArray factors(device, 2, "factors"), column(device, 2, "column");
    form_factors(device, Estimator::exact, shooter, receivers, nullptr, 2, samples, 1, factors);
    const auto f = factors.download();
    ASSERT_GT(f[0], 0);
    AnswersBy engine;
    engine.blocked = [](std::size_t i) { return i == 1; };
    visible_factors(device, engine, Estimator::exact, shooter, receivers, nullptr, 2, samples, 1, masks,
                    factors, column);
    EXPECT_EQ(column.download(), (std::vector<double>{f[0], 0}));
    // The tip is a triangle with its base at z = 0: the centroid is at a third of its height.
    ASSERT_EQ(engine.ends.size(), 2u);
    for (const Point& end : engine.ends) {
      EXPECT_NEAR(glm::length(end.position - glm::dvec3(0.5, 0, 0.01 / 3)), 0, 1e-11);
      EXPECT_EQ(end.plane, 0u);
    }
  }
}

// A receiver straight below a sample, as near as floats can say: 1 / r^4 is beyond them, shares of it must not be.
TEST(VisibleFactors, AreFiniteHoweverNearTheReceiverIsToASample) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const Shooter shooter =
        shooter_of({{-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}});  // faces -z
    std::vector<Point> points;
    for (int exponent = -2; exponent >= -36; --exponent)
      points.push_back({{0, 0, -std::pow(10.0, exponent)}, {0, 0, 1}, 1, 0});
    const auto count = std::uint32_t(points.size());
    const PointArray receivers(device, points, "receivers");
    const std::vector<Point> near_and_far = {{{0, 0, 0}, shooter.normal, 0, 0},
                                             {{0.25, 0.25, 0}, shooter.normal, 0, 0}};
    const PointArray samples(device, near_and_far, "samples");
    AnswersBy engine;
    engine.blocked = [](std::size_t) { return true; };
    for (const std::uint32_t mask : {0u, 1u, 2u})
      for (const Estimator estimator : {Estimator::disk, Estimator::subdisk, Estimator::exact}) {
        const Array<std::uint32_t> masks(device, std::vector<std::uint32_t>(count, mask), "masks");
        RealArray factors(device, count, "factors"), column(device, count, "column");
        form_factors(device, estimator, shooter, receivers, nullptr, count, samples, 2, factors);
        visible_factors(device, engine, estimator, shooter, receivers, nullptr, count, samples, 2, masks,
                        factors, column);
        const auto all = factors.download(), visible = column.download();
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_TRUE(std::isfinite(all[i]) && visible[i] >= 0 && visible[i] <= all[i] * (1 + 1e-6))
              << "estimator " << int(estimator) << " mask " << mask << " at " << points[i].position.z << ": "
              << visible[i] << " of " << all[i];
          // Next to the sample above it, the other one's share is about (r / 0.35)^4.
          if (estimator != Estimator::exact || mask == 0 || i < 3) continue;
          EXPECT_NEAR(visible[i], mask == 1 ? 0 : all[i], 1e-6) << points[i].position.z;
        }
      }
  }
}

// Both printed denominators of the reference study: the same sums, at the study's own error after averaging
// over 64 sample sets.
TEST(SampledFactors, TheDiskEstimatorKeepsItsBiasAndSubdiskDoesNot) {
  Device device;
  const auto study = oracle::reference("e_disk_estimator_study.json");
  int checked = 0;
  for (const auto& c : study["cases"]) {
    Polygon3 all = polygon_of(c["polygon"]);
    const std::size_t corners = all.size();
    all.push_back(vec(c["point"]));
    const CaseFrame frame(all);
    for (auto& p : all) p = frame(p);
    const Shooter shooter = shooter_of({all.begin(), all.begin() + std::ptrdiff_t(corners)});
    const PointArray receivers(device, std::vector<Point>{{all.back(), vec(c["normal"]), 1, 0}}, "receiver");
    constexpr std::uint32_t n = 4096;
    const PointArray samples(device, stratified_samples(shooter, n, 1), "samples");
    RealArray factor(device, 1, "factor");
    const double exact = c["exact_F"], limit = c["whole_area_disk_limit_n_to_infinity"];
    // 64 x 64 jittered cells: the error of a smooth integrand is about its change over a cell / sqrt(n):
    // below (1/64) x (variation of the kernel over the square, at most 1 / height^2 relative) / 64.
    const double height = std::abs(vec(c["point"]).z - vec(c["polygon"][0]).z);
    const double sampling = 5.0 / (64 * 64) / std::min(1.0, height * height);
    form_factors(device, Estimator::disk, shooter, receivers, nullptr, 1, samples, n, factor);
    EXPECT_NEAR(factor.download()[0], limit, sampling * limit) << c["id"];
    form_factors(device, Estimator::subdisk, shooter, receivers, nullptr, 1, samples, n, factor);
    // Wallace's own bias is A/n / (pi r^2) at the nearest point.
    EXPECT_NEAR(factor.download()[0], exact, (sampling + 1 / (n * M_PI * height * height)) * exact)
        << c["id"];
    ++checked;
  }
  EXPECT_EQ(checked, 12);
}

TEST(StratifiedSamples, AreUniformByAreaAndStratified) {
  const glm::dvec3 a(0, 0, 0), b(0.8, 0, 0), c(0.5, 0.6, 0.3), d(0.1, 0.6, 0.3);
  for (const Shooter& shooter : {shooter_of({a, b, c, d}), shooter_of({a, b, c})}) {
    glm::dvec3 centroid(0);  // of the fan of triangles
    double area = 0;
    for (std::uint32_t k = 1; k + 1 < shooter.corners; ++k) {
      const double t = 0.5 * glm::length(glm::cross(shooter.corner[k] - a, shooter.corner[k + 1] - a));
      centroid += t * (a + shooter.corner[k] + shooter.corner[k + 1]) / 3.0, area += t;
    }
    centroid /= area;
    for (const std::uint32_t n : {1u, 4u, 7u, 16u, 36u, 64u, 1000u, 4096u}) {
      const auto points = stratified_samples(shooter, n, 9);
      ASSERT_EQ(points.size(), n);
      glm::dvec3 mean(0);
      for (const Point& p : points) {
        mean += p.position / double(n);
        EXPECT_NEAR(glm::dot(p.position - a, shooter.normal), 0, 1e-15);
        for (std::uint32_t k = 0; k < shooter.corners; ++k) {
          const glm::dvec3 from = shooter.corner[k], edge = shooter.corner[(k + 1) % shooter.corners] - from;
          EXPECT_GE(glm::dot(glm::cross(edge, p.position - from), shooter.normal), 0);
        }
        EXPECT_EQ(p.plane, shooter.plane);
      }
      // Mean of stratified points: each cell's own spread, 0.8 / sqrt(n), over sqrt(n); five standard
      // deviations.
      EXPECT_LE(glm::length(mean - centroid), 5 * 0.8 / n) << n;
      const auto again = stratified_samples(shooter, n, 9), other = stratified_samples(shooter, n, 10);
      for (std::uint32_t k = 0; k < n; ++k) EXPECT_EQ(points[k].position, again[k].position);
      EXPECT_NE(points[0].position, other[0].position);
    }
  }
}

TEST(Facing, IsDecidedByCornersAndPlanes) {
  for (const Precision precision : {Precision::float32, Precision::float64}) {
    Device device({.precision = precision});
    const Shooter shooter =
        shooter_of({{-0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.5, -0.5, 0.5}, {-0.5, -0.5, 0.5}});  // faces down
    const double tiny = std::ldexp(1.0, -40);
    const std::vector<Point> points = {
        {{0, 0, 0}, {0, 0, 1}, 1, 0},          {{0, 0, 0}, {0, 0, -1}, 1, 0},
        {{0, 0, 0}, {0, 0, 1}, 0, 0},          {{0, 0, 0.75}, {0, 0, -1}, 1, 0},
        {{0, 0, 0.5}, {0, 0, -1}, 1, 0},       {{0, 0, 0.5 - tiny}, {0, 0, 1}, 1, 0},
        {{0.5 - tiny, 0, 0}, {1, 0, 0}, 1, 0}, {{0.5, 0, 0}, {1, 0, 0}, 1, 0},
        {{0, 0, 0.5 + tiny}, {0, 0, 1}, 1, 0}, {{0.75, 0, 0}, {-1, 0, 0}, 1, 0}};
    const PointArray receivers(device, points, "receivers");
    Array<std::uint32_t> flags(device, points.size(), "flags");
    facing(device, shooter, receivers, 0, std::uint32_t(points.size()), flags);
    EXPECT_EQ(flags.download(), (std::vector<std::uint32_t>{1, 0, 0, 0, 0, 1, 1, 0, 0, 1}));
  }
}

}  // namespace
}  // namespace clrad
