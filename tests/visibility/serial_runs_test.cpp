// Few rays: `serial` splits the triangles into runs, and gives its lanes to them where origins are few. The bits
// are those of the same rays among many, which are taken tile by tile against all triangles.
#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "device/divided.hpp"

#include "clrad/visibility.hpp"
#include "visibility/setting.hpp"

namespace {

using clrad::Array;
using clrad::Device;
using clrad::DeviceOptions;
using clrad::OccluderTriangle;
using clrad::Point;
using clrad::PointArray;
using clrad::Segments;
using clrad::test::Setting;

constexpr std::uint32_t many = 17000;

// A third of the ends are corners of triangles, so that the exact predicate has its say.
Setting setting(std::uint32_t count) {
  std::mt19937_64 random(20291);
  std::uniform_real_distribution<double> unit(-1, 1);
  Setting s;
  for (std::uint32_t i = 0; i < count; ++i) {
    OccluderTriangle t{{}, i, i};
    const glm::dvec3 middle(unit(random), unit(random), unit(random));
    for (auto& c : t.corner) c = (middle + glm::dvec3(unit(random), unit(random), unit(random)) * 0.03) * 0.9;
    s.triangles.push_back(t);
  }
  const auto end = [&] {
    const auto& t = s.triangles[random() % count];
    const bool corner = random() % 3 == 0;
    return Point{corner ? t.corner[0] : glm::dvec3(unit(random), unit(random), unit(random)),
                 {0, 0, 1},
                 random() % 2 && corner ? t.plane : 0xffffffffu,
                 0xffffffffu};
  };
  for (std::uint32_t i = 0; i < many; ++i) s.origins.push_back(end());
  for (std::uint32_t i = 0; i < many; ++i) s.targets.push_back(end());
  return s;
}

struct RunAnswer {
  std::vector<std::uint32_t> masks;
  clrad::VisibilityCounts counts;
};

RunAnswer ask(Device& device, const Setting& s, const std::vector<std::uint32_t>& active,
              std::uint32_t samples) {
  auto engine = clrad::make_engine("serial", device, s.triangles);
  const PointArray origins(device, s.origins, "origins"), targets(device, s.targets, "targets");
  const Array<std::uint32_t> chosen(device, active.empty() ? std::vector<std::uint32_t>{0} : active,
                                    "active");
  const Segments segments{&origins, active.empty() ? nullptr : &chosen,
                          std::uint32_t(active.empty() ? s.origins.size() : active.size()), &targets,
                          samples};
  const std::size_t words = segments.origin_count * segments.words_per_origin();
  Array<std::uint32_t> masks(device, std::vector<std::uint32_t>(words + 1, 0xabcdef01u), "masks");
  engine->occluded(segments, masks);
  RunAnswer answer{masks.download(), engine->counts()};
  EXPECT_EQ(answer.masks.back(), 0xabcdef01u);
  answer.masks.pop_back();
  EXPECT_EQ(answer.counts.rays, segments.count());
  EXPECT_EQ(answer.counts.candidates, segments.count() * s.triangles.size());
  return answer;
}

void few_rays_get_the_bits_that_they_get_among_many(std::uint32_t triangles,
                                                    const std::vector<std::uint32_t>& counts) {
  const Setting s = setting(triangles);
  Device device;
  for (const std::uint32_t samples : {0u, 1u, 16u, 40u}) {
    const RunAnswer all = ask(device, s, {}, samples);
    const std::uint32_t words = samples ? (samples + 31) / 32 : 1;
    std::size_t blocked = 0;
    for (const auto word : all.masks) blocked += std::size_t(std::popcount(word));
    const std::size_t rays = std::size_t(many) * std::max(samples, 1u);
    EXPECT_GT(blocked, rays / 20);
    EXPECT_LT(blocked, rays - rays / 20);
    for (const std::uint32_t few : counts) {
      SCOPED_TRACE(std::to_string(few) + " origins, " + std::to_string(samples) + " samples");
      std::vector<std::uint32_t> active, expected;
      for (std::uint32_t i = 0; i < few; ++i) active.push_back((i * 7919 + 13) % many);
      for (const auto o : active)
        expected.insert(expected.end(), all.masks.begin() + o * words, all.masks.begin() + (o + 1) * words);
      const RunAnswer first = ask(device, s, active, samples);
      EXPECT_EQ(first.masks, expected);
      for (const DeviceOptions& on : {DeviceOptions{.cores = clrad::test::one_core(), .work_group_size = 16},
                                      DeviceOptions{.packet_width = 1}, DeviceOptions{.packet_width = 4}}) {
        Device other(on);
        const RunAnswer again = ask(other, s, active, samples);
        EXPECT_EQ(again.masks, expected) << "width " << on.packet_width;
        EXPECT_EQ(again.counts.exact, first.counts.exact) << "width " << on.packet_width;
      }
    }
  }
}

TEST(SerialRuns, FewRaysGetTheBitsThatTheyGetAmongMany) {
  few_rays_get_the_bits_that_they_get_among_many(2000, {1, 2, 15, 16, 33, 300});
}

// Some tiles of origins, of which the last is not full; triangles that do not fill the last packet.
TEST(SerialRuns, SomeRaysAmongManyTrianglesGetTheBitsThatTheyGetAmongMany) {
  few_rays_get_the_bits_that_they_get_among_many(4099, {6, 17, 63, 64});
}

}  // namespace
