/// Occluders and segments between points, as the tests of the engines ask about them.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

#include "clrad/visibility.hpp"

namespace clrad::test {

struct Setting {
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> origins, targets;
  std::uint32_t samples = 0;  ///< targets of each origin; 0: origin i to target i
};

inline Point at(glm::dvec3 p, std::uint32_t plane = 0xffffffffu) {
  return {p, {0, 0, 1}, plane, 0xffffffffu};
}

/// Points inside and outside the triangles' box. On a lattice of 1/8, ends, corners and voxel faces coincide all the time.
inline Setting random_setting(std::mt19937_64& random, int triangles, double size, int points, bool lattice) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto value = [&](double range) {
    return lattice ? double(int(random() % 9) - 4) / 8 : range * unit(random);
  };
  Setting s;
  for (int i = 0; i < triangles; ++i) {
    OccluderTriangle t{{}, std::uint32_t(i), std::uint32_t(i)};
    const glm::dvec3 middle(value(0.9), value(0.7), value(0.5));
    for (auto& c : t.corner)
      c = lattice ? glm::dvec3(value(1), value(1), value(1))
                  : middle + glm::dvec3(unit(random), unit(random), unit(random)) * size;
    s.triangles.push_back(t);
  }
  const auto plane = [&] {
    return random() % 4 ? 0xffffffffu : std::uint32_t(random() % std::uint64_t(triangles));
  };
  for (int i = 0; i < points; ++i) {
    s.origins.push_back(at({value(1.2), value(1.2), value(1.2)}, plane()));
    s.targets.push_back(at({value(1.2), value(1.2), value(1.2)}, plane()));
    if (i % 10 == 0) s.targets.back().position = s.origins.back().position;      // no ray at all
    if (i % 10 == 1) s.targets.back().position.x = s.origins.back().position.x;  // along planes of the grid
    if (i % 10 == 2) s.targets.back().position = s.origins[0].position + glm::dvec3(0, 0, 0.3);
  }
  return s;
}

/// The masks that an engine gives, which must not be written beyond.
inline std::vector<std::uint32_t> masks_of(Device& device, VisibilityEngine& engine, const Setting& s,
                                           std::uint32_t samples) {
  const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
  const Segments segments{&origins, nullptr, std::uint32_t(s.origins.size()), &targets, samples};
  const std::size_t words = segments.origin_count * segments.words_per_origin();
  Array<std::uint32_t> masks(device, std::vector<std::uint32_t>(words + 1, 0xabcdef01u), "masks");
  engine.occluded(segments, masks);
  auto bits = masks.download();
  EXPECT_EQ(bits.back(), 0xabcdef01u);
  bits.pop_back();
  return bits;
}

}  // namespace clrad::test
