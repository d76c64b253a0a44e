// Packets of any width (kernels/shared/factor_packet.cl) give the bits of one receiver a work-item: exact factors and visible
// ones, of receivers of every kind and in counts that no width divides.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <random>

#include "solve/form_factor.hpp"

namespace clrad {
namespace {

// Every other undecided receiver sees its tip.
class EveryOther : public VisibilityEngine {
 public:
  std::string name() const override { return "every other"; }
  void occluded(const Segments& segments, Array<std::uint32_t>& masks) override {
    std::vector<std::uint32_t> words(segments.origin_count);
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = i % 2;
    masks.upload(words);
  }
  void intersect_closest(const Segments&, Array<std::uint32_t>&, Array<float>&) override {}
  VisibilityCounts counts() const override { return {}; }
};

struct PacketCase {
  Shooter shooter;
  std::vector<Point> points;
};

// A parallelogram or a triangle; receivers anywhere, far enough for one cell or for quarters, next to the shooter, its plane,
// edges and corners and on them, on the horizon's both sides, in the shooter's plane by name, and without a direction.
PacketCase packet_case(std::mt19937_64& random, std::uint32_t corners) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&](double size) {
    return size * glm::dvec3(number(random), number(random), number(random));
  };
  const auto tiny = [&] { return std::pow(10.0, -5.5 + 4.5 * number(random)); };
  const double nan = std::nan("");
  PacketCase c;
  Shooter& s = c.shooter;
  const glm::dvec3 origin = vector(0.25), a = vector(0.2),
                   b = glm::normalize(glm::cross(a, vector(1))) * (0.2 + 0.1 * number(random));
  s.corners = corners;
  s.corner[0] = origin, s.corner[1] = origin + a;
  s.corner[2] = corners == 3 ? origin + b : origin + a + b, s.corner[3] = origin + b;
  s.normal = glm::normalize(glm::cross(a, b));
  s.area = glm::length(glm::cross(a, b)) * (corners == 3 ? 0.5 : 1);
  s.plane = 5;
  for (int i = 0; i < 200; ++i) {
    const double u = number(random) * 2, v = number(random) * 2;
    glm::dvec3 p = origin + u * a + v * b + s.normal * tiny(), n = glm::normalize(vector(1));
    const int kind = i % 10;
    if (kind < 4) p = vector(0.7), n = glm::normalize(origin - p + vector(kind == 3 ? 2 : 0.5));
    if (kind == 4) n = -s.normal;
    if (kind == 5) n = glm::normalize(glm::cross(a, s.normal));            // horizon along an edge
    if (kind == 6) n = glm::normalize(glm::cross(origin - p, vector(1)));  // corner on the horizon
    if (kind == 7) p = origin + u * a + v * b;                             // in the plane
    if (kind == 8) p = s.corner[i / 10 % int(corners)] + s.normal * (i % 20 ? 0.0 : tiny());  // at a corner
    if (i == 49) n = {nan, nan, nan};
    c.points.push_back({p, n, i % 23 ? 1u : s.plane, 0});
  }
  return c;
}

std::uint64_t bits_of(double x) {
  return std::bit_cast<std::uint64_t>(x);
}

// Factors in order and of a list, dense and not, visible ones and what faces the shooter, as one row; no one may write
// entries beyond the count.
std::vector<double> all_factors(Device& device, const PacketCase& c, std::uint32_t count, std::uint32_t n) {
  const auto size = std::uint32_t(c.points.size());
  const std::vector<double> untouched(size, -1);
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < count; ++i) order.push_back(i * 37 % size);
  const std::uint32_t words = (n + 31) / 32;
  std::mt19937 random(n);
  std::vector<std::uint32_t> bits(std::size_t(count) * words);
  for (std::uint32_t& word : bits) word = random() & random();
  const PointArray receivers(device, c.points, "receivers"),
      samples(device, stratified_samples(c.shooter, n, 3), "samples");
  const Array<std::uint32_t> active(device, order, "active"), masks(device, bits, "masks");
  std::vector<double> result;
  for (const Array<std::uint32_t>* list : {static_cast<const Array<std::uint32_t>*>(nullptr), &active}) {
    RealArray factors(device, untouched, "factors"), column(device, untouched, "column");
    form_factors(device, Estimator::exact, c.shooter, receivers, list, count, receivers, 0, factors);
    EveryOther engine;
    visible_factors(device, engine, Estimator::exact, c.shooter, receivers, list, count, samples, n, masks,
                    factors, column);
    for (const RealArray* each : {&factors, &column})
      for (const double x : each->download()) result.push_back(x);
  }
  const std::uint32_t first = count / 3;
  Array<std::uint32_t> flags(device, std::vector<std::uint32_t>(size, 7), "flags");
  facing(device, c.shooter, receivers, first, count - first, flags);
  for (const std::uint32_t flag : flags.download()) result.push_back(flag);
  RealArray column(device, untouched, "column");
  unoccluded_factors(device, Estimator::exact, c.shooter, receivers, active, count, nullptr, 0, column);
  for (const double x : column.download()) result.push_back(x);
  return result;
}

void same_bits_in_packets(Precision precision) {
  constexpr std::uint64_t seed = 20261126;
  SCOPED_TRACE(seed);
  Device one({.precision = precision, .packet_width = 1});
  std::vector<std::unique_ptr<Device>> others;
  for (const unsigned width : {4u, 8u, 16u})
    others.push_back(std::make_unique<Device>(DeviceOptions{.precision = precision, .packet_width = width}));
  std::mt19937_64 random(seed);
  std::size_t positive = 0, none = 0;
  for (int i = 0; i < 16; ++i) {
    const PacketCase c = packet_case(random, i % 2 ? 3 : 4);
    const std::uint32_t count = i == 0 ? 1 : i == 1 ? 15 : i == 2 ? 17 : 163 + std::uint32_t(i);
    const std::uint32_t n = i % 3 == 0 ? 1 : i % 3 == 1 ? 16 : 45;
    const auto expected = all_factors(one, c, count, n);
    for (const auto& device : others) {
      const auto got = all_factors(*device, c, count, n);
      ASSERT_EQ(got.size(), expected.size());
      for (std::size_t k = 0; k < got.size(); ++k)
        ASSERT_EQ(bits_of(got[k]), bits_of(expected[k]))
            << "case " << i << " entry " << k << " width " << device->options().packet_width << ": " << got[k]
            << " for " << expected[k];
    }
    for (const double x : expected) positive += x > 0, none += x == 0;
  }
  EXPECT_GT(positive, 2000u);
  EXPECT_GT(none, 2000u);
}

TEST(ExactFactorPackets, GiveTheBitsOfSingleReceiversInFloat) {
  same_bits_in_packets(Precision::float32);
}
TEST(ExactFactorPackets, GiveTheBitsOfSingleReceiversInDouble) {
  same_bits_in_packets(Precision::float64);
}

// A plane's normal is no float: what floats leave of it tells the sides of a receiver next to the plane.
TEST(FacingPackets, TellTheSidesOfATiltedPlaneInDouble) {
  for (const unsigned width : {1u, 16u}) {
    Device device({.precision = Precision::float64, .packet_width = width});
    Shooter s;
    const glm::dvec3 origin(0.1, -0.2, 0.3), a(0.5, 0.1, 0.2), b(-0.1, 0.4, 0.3);
    s.corners = 4;
    s.corner[0] = origin, s.corner[1] = origin + a, s.corner[2] = origin + a + b, s.corner[3] = origin + b;
    s.normal = glm::normalize(glm::cross(a, b));
    s.area = glm::length(glm::cross(a, b));
    std::vector<Point> points;
    std::vector<std::uint32_t> expected;
    for (int i = 0; i < 40; ++i) {
      const glm::dvec3 there = origin + (0.3 * (i % 7) - 1.1) * a + (0.4 * (i % 5) - 0.9) * b;
      points.push_back({there + s.normal * (i % 2 ? 1e-12 : -1e-12),
                        glm::normalize(origin + 0.5 * (a + b) - there), 1, 0});
      expected.push_back(i % 2);
    }
    const PointArray receivers(device, points, "receivers");
    Array<std::uint32_t> flags(device, points.size(), "flags");
    facing(device, s, receivers, 0, std::uint32_t(points.size()), flags);
    EXPECT_EQ(flags.download(), expected) << "width " << width;
  }
}

}  // namespace
}  // namespace clrad
