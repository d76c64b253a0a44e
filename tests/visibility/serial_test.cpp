// The engine `serial` against the exact oracle, the reference cases and closed meshes, on every kind of
// device set-up.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "clrad/error.hpp"
#include "device/divided.hpp"
#include "visibility/pairs.hpp"

namespace clrad {
namespace {

struct Setup {
  unsigned width;
  Precision precision;
  unsigned work_group;
  unsigned cores;
};
const Setup setups[] = {{16, Precision::float32, 64, 0},
                        {1, Precision::float32, 64, 0},
                        {4, Precision::float32, 16, 1},
                        {8, Precision::float64, 16, 0}};

Device& device(std::size_t setup) {
  static std::map<std::size_t, std::unique_ptr<Device>> devices;
  std::unique_ptr<Device>& made = devices[setup];
  if (!made) {
    DeviceOptions options;
    options.packet_width = setups[setup].width;
    options.precision = setups[setup].precision;
    options.work_group_size = setups[setup].work_group;
    if (setups[setup].cores == 1) options.cores = test::one_core();
    made = std::make_unique<Device>(options);
  }
  return *made;
}

std::vector<OccluderTriangle> occluders(const std::vector<oracle::Triangle>& triangles) {
  std::vector<OccluderTriangle> result;
  for (const oracle::Triangle& t : triangles) result.push_back(test::occluder(t));
  return result;
}

struct Scene {
  std::vector<oracle::Triangle> triangles;
  std::vector<Point> origins, targets;
  std::vector<std::uint32_t> active;

  oracle::Segment segment(std::size_t origin, std::size_t target) const {
    return {snap(origins[origin].position), snap(targets[target].position), origins[origin].plane,
            targets[target].plane};
  }
};

/// Everything on a coarse lattice, so that ties are the rule; planes from a few.
Scene lattice_scene(std::uint64_t seed, std::size_t triangles, std::size_t origins, std::size_t targets) {
  std::mt19937_64 random(seed);
  Scene scene;
  const auto place = [&] {
    GridPoint p = test::anywhere(random, 6);
    for (std::int64_t& x : p) x <<= 36;
    return p;
  };
  while (scene.triangles.size() < triangles) {
    oracle::Triangle t{{place(), place(), place()}, static_cast<std::uint32_t>(random() % 8)};
    // Small ones, and now and then one without area.
    const GridPoint step = place();
    for (std::size_t k = 0; k < 3; ++k) {
      t.corner[1][k] = t.corner[0][k] + step[k] / 2;
      t.corner[2][k] = t.corner[0][k] + (t.corner[2][k] - t.corner[0][k]) / 2;
    }
    if (random() % 16 == 0) t.corner[2] = t.corner[0];
    if (t.plane == 7) t.plane = 0xffffffffu;
    scene.triangles.push_back(t);
  }
  const auto points = [&](std::size_t count) {
    std::vector<Point> made;
    for (std::size_t i = 0; i < count; ++i) {
      Point p = test::point(place(), random() % 2 ? 0xffffffffu : static_cast<std::uint32_t>(random() % 16));
      if (random() % 2) p.position += glm::dvec3(1e-7, 3e-8, 1e-3) * (double(random() % 1000) / 1000);
      made.push_back(p);
    }
    return made;
  };
  scene.origins = points(origins);
  scene.targets = points(targets);
  for (std::uint32_t i = 0; i < origins; ++i)
    if (random() % 3) scene.active.push_back(i);
  return scene;
}

struct Answers {
  std::vector<std::uint32_t> masks, pairs, triangle;
  std::vector<float> t;
  VisibilityCounts counts;
};

Answers ask(std::size_t setup, const Scene& scene, bool chosen, std::uint32_t samples) {
  Device& on = device(setup);
  const auto engine = make_engine("serial", on, occluders(scene.triangles));
  const PointArray origins(on, scene.origins, "origins"), targets(on, scene.targets, "targets");
  const Array<std::uint32_t> active(on, scene.active, "active");
  Segments segments;
  segments.origins = &origins;
  segments.targets = &targets;
  segments.active = chosen ? &active : nullptr;
  segments.origin_count = std::uint32_t(chosen ? scene.active.size() : scene.origins.size());
  segments.samples = samples;
  Answers answers;
  const std::uint64_t words = std::uint64_t(segments.origin_count) * segments.words_per_origin();
  // One word more than needed: it must stay as it was.
  Array<std::uint32_t> masks(on, std::vector<std::uint32_t>(words + 1, 0xabcdef01u), "masks");
  engine->occluded(segments, masks);
  answers.masks = masks.download();
  EXPECT_EQ(answers.masks.back(), 0xabcdef01u);
  answers.masks.pop_back();
  Array<std::uint32_t> triangle(on, std::vector<std::uint32_t>(segments.count() + 1, 0xabcdef01u),
                                "triangle");
  Array<float> t(on, std::vector<float>(segments.count() + 1, -7.0f), "t");
  engine->intersect_closest(segments, triangle, t);
  answers.triangle = triangle.download();
  answers.t = t.download();
  EXPECT_EQ(answers.triangle.back(), 0xabcdef01u);
  EXPECT_EQ(answers.t.back(), -7.0f);
  answers.counts = engine->counts();
  return answers;
}

TEST(Serial, EqualsTheOracleBitByBit) {
  const Scene scene = lattice_scene(17, 40, 100, 37);
  const Answers answers = ask(0, scene, true, 37);
  std::size_t blocked = 0;
  for (std::size_t o = 0; o < scene.active.size(); ++o)
    for (std::size_t k = 0; k < 37; ++k) {
      const bool expected = oracle::blocked(scene.segment(scene.active[o], k), scene.triangles);
      blocked += expected;
      ASSERT_EQ((answers.masks[o * 2 + k / 32] >> (k % 32)) & 1u, expected ? 1u : 0u)
          << "origin " << o << " sample " << k;
      ASSERT_EQ(answers.triangle[o * 37 + k] != 0xffffffffu, expected) << "origin " << o << " sample " << k;
    }
  EXPECT_GT(blocked, 37 * scene.active.size() / 20);
  EXPECT_LT(blocked, 37 * scene.active.size() / 20 * 19);
  for (std::size_t o = 0; o < scene.active.size(); ++o)
    EXPECT_EQ(answers.masks[o * 2 + 1] >> 5, 0u) << "unused bits";
  EXPECT_EQ(answers.counts.rays, 2 * 37 * scene.active.size());
  EXPECT_GT(answers.counts.exact, 0u);
}

TEST(Serial, NearestHitIsTheFirstOfThoseThatBlock) {
  const Scene scene = lattice_scene(23, 40, 60, 20);
  const Answers answers = ask(0, scene, false, 20);
  for (std::size_t o = 0; o < scene.origins.size(); ++o)
    for (std::size_t k = 0; k < 20; ++k) {
      const oracle::Segment s = scene.segment(o, k);
      const std::uint32_t found = answers.triangle[o * 20 + k];
      const float t = answers.t[o * 20 + k];
      if (found == 0xffffffffu) {
        EXPECT_EQ(t, 1.0f);
        continue;
      }
      ASSERT_LT(found, scene.triangles.size());
      EXPECT_TRUE(oracle::has_area(scene.triangles[found]) && oracle::blocked(s, scene.triangles[found]));
      // No triangle that blocks is nearer by more than the error of two t: below 1e-5 each on this lattice,
      // where the sides of a plane are large next to their terms.
      for (const oracle::Triangle& other : scene.triangles) {
        if (!oracle::has_area(other) || !oracle::blocked(s, other)) continue;
        const oracle::Vector n = oracle::normal(other);
        const auto side = [&](const GridPoint& p) -> oracle::Integer {
          return oracle::dot(n, oracle::operator-(oracle::vector(p), oracle::vector(other.corner[0])));
        };
        const oracle::Integer a = side(s.from), b = side(s.to);
        if (a == b) continue;  // in the plane: any t
        EXPECT_GE((oracle::Rational(a) / oracle::Rational(oracle::Integer(a - b))).convert_to<double>(),
                  double(t) - 2e-5);
      }
    }
}

TEST(Serial, SameBitsWhateverTheWidthPrecisionWorkGroupAndCores) {
  const Scene scene = lattice_scene(29, 60, 133, 70);
  for (const bool chosen : {false, true})
    for (const std::uint32_t samples : {70u, 16u, 1u, 0u}) {
      Scene use = scene;
      if (samples == 0) {  // pairs: as many targets as origins
        use.targets.resize(use.origins.size(), use.targets.back());
        for (std::size_t i = 0; i < use.origins.size(); ++i)
          use.targets[i] = scene.targets[i % scene.targets.size()];
      }
      const Answers first = ask(0, use, chosen, samples);
      for (std::size_t setup = 1; setup < std::size(setups); ++setup) {
        SCOPED_TRACE("width " + std::to_string(setups[setup].width) + ", samples " + std::to_string(samples));
        const Answers other = ask(setup, use, chosen, samples);
        EXPECT_EQ(first.masks, other.masks);
        EXPECT_EQ(first.triangle, other.triangle);
        EXPECT_EQ(0, std::memcmp(first.t.data(), other.t.data(), first.t.size() * sizeof(float)));
        EXPECT_EQ(first.counts.exact, other.counts.exact);
      }
      if (samples != 0) continue;
      for (std::size_t i = 0; i < first.masks.size(); ++i) {
        const std::size_t o = chosen ? use.active[i] : i;
        EXPECT_EQ(first.masks[i], oracle::blocked(use.segment(o, o), use.triangles) ? 1u : 0u);
      }
    }
}

TEST(Serial, VisibilityIsSymmetric) {
  Scene scene = lattice_scene(31, 60, 128, 128);
  const Answers forth = ask(0, scene, false, 128);
  std::swap(scene.origins, scene.targets);
  const Answers back = ask(0, scene, false, 128);
  for (std::size_t o = 0; o < 128; ++o)
    for (std::size_t k = 0; k < 128; ++k)
      ASSERT_EQ((forth.masks[o * 4 + k / 32] >> (k % 32)) & 1u,
                (back.masks[k * 4 + o / 32] >> (o % 32)) & 1u);
}

nlohmann::json cases_of(const char* file) {
  std::ifstream in(std::string(CLRAD_TEST_DATA) + "/reference/" + file);
  return nlohmann::json::parse(in).at("cases");
}

glm::dvec3 position(const nlohmann::json& p, double scale) {
  return glm::dvec3(p[0].get<double>(), p[1].get<double>(), p[2].get<double>()) * scale;
}

/// A power of two that brings everything into the frame; it changes no digit.
double scale_of(double farthest) {
  return farthest <= 4 ? 1 : std::exp2(-std::ceil(std::log2(farthest / 4)));
}

// The visible fraction of a light's area by one jittered sample in each of N x N cells. Only cells that a
// shadow's border crosses can err, each by less than 1 and independently, with mean 0; a line crosses fewer
// than 2N cells. With m such cells Hoeffding's inequality bounds the error by sqrt(m ln(2/delta) / 2) / N^2,
// delta = 1e-9.
TEST(Serial, VisibleFractionOfReferenceLights) {
  const std::uint32_t n = 128;
  std::mt19937_64 random(41);
  std::uniform_real_distribution<double> jitter(0, 1);
  std::size_t receivers = 0;
  for (const auto& c : cases_of("b_visible_light.json")) {
    double farthest = 0;
    for (const auto& polygon : c["occluders"])
      for (const auto& p : polygon)
        for (const auto& x : p) farthest = std::max(farthest, std::abs(x.get<double>()));
    const double scale = scale_of(std::max(farthest, 4.0));
    Scene scene;
    std::size_t edges = 0;
    for (const auto& polygon : c["occluders"]) {
      edges += polygon.size();
      for (std::size_t i = 2; i < polygon.size(); ++i)
        scene.triangles.push_back({{snap(position(polygon[0], scale)), snap(position(polygon[i - 1], scale)),
                                    snap(position(polygon[i], scale))}});
    }
    const auto& light = c["light"];
    const bool triangular = light.size() == 3;
    const glm::dvec3 corner = position(light[0], scale), along = position(light[1], scale) - corner,
                     across = position(light.back(), scale) - corner;
    for (std::uint32_t i = 0; i < n * n; ++i) {
      double u = (i % n + jitter(random)) / n, v = (i / n + jitter(random)) / n;
      if (triangular && u + v > 1) u = 1 - u, v = 1 - v;  // the parallelogram's other half, folded back
      scene.targets.push_back({corner + along * u + across * v});
    }
    for (const auto& r : c["receivers"]) scene.origins.push_back({position(r["point"], scale)});
    const Answers answers = ask(0, scene, false, n * n);
    // A folded light shows every border twice and the fold once.
    const double crossed = 2.0 * n * double(triangular ? 2 * edges + 1 : edges);
    const double allowed = std::sqrt(crossed * std::log(2 / 1e-9) / 2) / (double(n) * n);
    for (std::size_t r = 0; r < scene.origins.size(); ++r) {
      std::uint64_t occluded = 0;
      for (std::uint32_t w = 0; w < n * n / 32; ++w)
        occluded += std::uint64_t(__builtin_popcount(answers.masks[r * (n * n / 32) + w]));
      EXPECT_NEAR(1 - double(occluded) / (n * n), c["receivers"][r]["visible_area_fraction"].get<double>(),
                  allowed)
          << c["id"] << " receiver " << r << ' ' << c["receivers"][r]["class"];
      ++receivers;
    }
  }
  EXPECT_GT(receivers, 70u);
}

TEST(Serial, NoTrianglesAndNoSegments) {
  Scene scene = lattice_scene(3, 1, 5, 3);
  scene.triangles.clear();
  const Answers open = ask(0, scene, false, 3);
  EXPECT_EQ(open.masks, std::vector<std::uint32_t>(5, 0));
  scene = lattice_scene(3, 4, 5, 3);
  scene.active.clear();
  EXPECT_TRUE(ask(0, scene, true, 3).masks.empty());
}

TEST(Serial, WrongUseIsRefused) {
  Device& on = device(0);
  const auto engine = make_engine("serial", on, {});
  const std::vector<Point> two(2);
  const PointArray points(on, two, "points");
  Array<std::uint32_t> masks(on, 1, "masks");
  Segments segments{&points, nullptr, 2, &points, 1};
  EXPECT_THROW(engine->occluded(segments, masks), UsageError) << "masks too small";
  segments.origin_count = 3;
  EXPECT_THROW(engine->occluded(segments, masks), UsageError) << "more origins than there are";
  segments.origin_count = 1;
  segments.samples = 3;
  EXPECT_THROW(engine->occluded(segments, masks), UsageError) << "more targets than there are";
  EXPECT_THROW(make_engine("none such", on, {}), UsageError);
}

}  // namespace
}  // namespace clrad
