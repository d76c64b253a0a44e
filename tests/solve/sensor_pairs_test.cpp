// Pairs of sensor and patch (kernels/solve/sensor_pairs.cl): none that brings light is left out, none that brings nothing is kept, factors are
// those of the solve to the bit at any width, and rays are shared out by what pairs may bring.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "clrad/primitives.hpp"
#include "solve/form_factor.hpp"

namespace clrad {
namespace {

constexpr const char* pair_kernels = "solve/sensor_pairs.cl";
constexpr std::uint32_t patch_count = 7, dark_patch = 4;  // the one that has no light
constexpr std::uint32_t first_sensor = 3,
                        sensor_count = 45;  // of the sensors; packets of 4 and more do not come out even

struct Places {
  std::vector<Shooter> patch;
  std::vector<Point> corners, sensors;
};

Places places() {
  std::mt19937_64 random(4711);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&](double size) {
    return size * glm::dvec3(number(random), number(random), number(random));
  };
  Places p;
  for (std::uint32_t k = 0; k < patch_count; ++k) {
    Shooter s;
    const glm::dvec3 at = vector(0.5), a = vector(0.3),
                     b = glm::normalize(glm::cross(a, vector(1))) * (0.2 + 0.1 * number(random));
    s.corners = k % 3 == 0 ? 3 : 4;
    s.corner[0] = at, s.corner[1] = at + a;
    s.corner[2] = s.corners == 3 ? at + b : at + a + b, s.corner[3] = at + b;
    s.normal = glm::normalize(glm::cross(a, b));
    s.area = glm::length(glm::cross(a, b)) * (s.corners == 3 ? 0.5 : 1);
    s.plane = k;
    for (std::uint32_t c = 0; c < 4; ++c)
      p.corners.push_back({s.corner[std::min(c, s.corners - 1)], s.normal, k, k});
    p.patch.push_back(s);
  }
  for (std::uint32_t i = 0; i < first_sensor + sensor_count; ++i) {
    const Shooter& near = p.patch[i % patch_count];  // some next to a patch, some in its plane
    const glm::dvec3 on = near.corner[0] + (near.corner[1] - near.corner[0]) * 0.5;
    const glm::dvec3 at = i % 4 == 0 ? vector(0.8) : i % 4 == 1 ? on + near.normal * 0.01 : on + vector(0.3);
    p.sensors.push_back({at, glm::normalize(vector(1)),
                         i % 5 == 0 ? std::uint32_t(i % patch_count) : 0xffffffffu, 0xffffffffu});
  }
  return p;
}

void expect_pairs(const DeviceOptions& on) {
  SCOPED_TRACE(testing::Message() << "width " << on.packet_width);
  Device device(on);
  const Places p = places();
  const PointArray sensors(device, p.sensors, "sensors"), corners(device, p.corners, "corners");
  std::vector<double> bright(patch_count, 0.5), records;
  bright[1] = 2, bright[dark_patch] = 0;
  for (const Shooter& s : p.patch) {
    const auto record = shooter_record(s);
    records.insert(records.end(), record.begin(), record.end());
  }
  const RealArray brightness(device, bright, "brightness"), shooters(device, records, "shooters");
  const Array<std::uint32_t> asked(device, std::uint64_t(sensor_count) * patch_count, "pairs"),
      segments(device, sensor_count + 1, "segments");
  device.run(pair_kernels, "sensor_pairs", std::uint64_t(sensor_count) * patch_count, sensors, corners,
             brightness, asked, first_sensor, sensor_count, patch_count);
  const std::vector<std::uint32_t> is_pair = asked.download();
  const Allocation pairs = allocate(device, asked.buffer(), is_pair.size());
  const RealArray factor(device, pairs.total, "factors");
  const Array<float> weight(device, pairs.total, "weights"), total(device, sensor_count, "totals");
  const std::uint32_t packets =
      (sensor_count + device.options().packet_width - 1) / device.options().packet_width;
  device.run(pair_kernels, "sensor_factors", std::uint64_t(packets) * patch_count, sensors, shooters,
             pairs.offsets, brightness, factor, weight, first_sensor, sensor_count, patch_count);
  device.run(pair_kernels, "sensor_segments", sensor_count + 1, pairs.offsets, segments, sensor_count,
             patch_count);
  segmented_reduce_sum(device, weight.buffer(), segments.buffer(), total.buffer(), sensor_count);
  constexpr float rays = 100;
  constexpr std::uint32_t least = 2;
  const Array<std::uint32_t> ray_counts(device, pairs.total, "rays");
  device.run(pair_kernels, "sensor_ray_counts", pairs.total, pairs.owner, weight, total, rays, least,
             ray_counts, pairs.total, patch_count);

  const auto factors = factor.download();
  const auto weights = weight.download(), totals = total.download();
  const auto offsets = pairs.offsets.download(), counts = ray_counts.download(), begin = segments.download();
  std::uint32_t kept = 0, zero = 0;
  RealArray exact(device, p.sensors.size(), "factors of the solve");
  for (std::uint32_t k = 0; k < patch_count; ++k) {
    form_factors(device, Estimator::exact, p.patch[k], sensors, nullptr, std::uint32_t(p.sensors.size()),
                 sensors, 0, exact);
    const auto of_solve = exact.download();
    for (std::uint32_t s = 0; s < sensor_count; ++s) {
      const std::uint32_t i = s * patch_count + k, pair = offsets[i];
      const double f = of_solve[first_sensor + s];
      SCOPED_TRACE(testing::Message() << "sensor " << s << ", patch " << k);
      if (!is_pair[i]) {
        EXPECT_TRUE(k == dark_patch || f == 0) << f;
        continue;
      }
      EXPECT_NE(k, dark_patch);
      EXPECT_EQ(factors[pair], f > 1e-30 ? f : 0);
      EXPECT_EQ(weights[pair], float(factors[pair] * bright[k]));
      // What rounds is that product and the quotient: the count is off by one at most.
      const double share =
          weights[pair] > 0 ? least + double(rays) * double(weights[pair]) / double(totals[s]) : 0;
      EXPECT_NEAR(counts[pair], std::floor(share), 1) << share;
      EXPECT_TRUE(weights[pair] > 0 || counts[pair] == 0);
      ++kept, zero += weights[pair] == 0;
    }
  }
  for (std::uint32_t s = 0; s <= sensor_count; ++s) EXPECT_EQ(begin[s], offsets[s * patch_count]);
  EXPECT_EQ(kept, pairs.total);
  EXPECT_LT(zero, kept / 4);                            // what lies behind is left out, not kept for nothing
  EXPECT_LT(kept, sensor_count * patch_count * 2 / 3);  // half of the patches look away
}

TEST(SensorPairs, AreThoseThatBringLightWithTheFactorsOfTheSolve) {
  for (const unsigned width : {1u, 4u, 8u, 16u})
    for (const Precision precision : {Precision::float32, Precision::float64}) {
      DeviceOptions on;
      on.packet_width = width, on.precision = precision;
      expect_pairs(on);
    }
}

}  // namespace
}  // namespace clrad
