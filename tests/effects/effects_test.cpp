#include <ctime>

#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::effect_of;
using test::make_room;
using test::Room;

// Twenty rooms of all kinds: what each calls for is known, since it was put there.
TEST(Effects, ReasonsAreRight) {
  for (unsigned k = 0; k < 20; ++k) {
    const unsigned bits = k * 2654435761u >> 20;  // a mix of all features
    const Room room{bool(bits & 1),  bool(bits & 2),  bool(bits & 4),      bool(bits & 8),
                    bool(bits & 16), bool(bits & 32), (bits & 448) == 448, bool(bits & 512)};
    SolveOptions options;
    if (bits & 1024) options.adaptive.tolerance = 0.1;
    SCOPED_TRACE(k);
    const std::vector<Effect> plan = plan_effects(make_room(room), options);
    const bool black = room.black && !room.uniform;
    const auto expect = [&](const char* name, bool needed) {
      const Effect& effect = effect_of(plan, name);
      EXPECT_EQ(effect.needed, needed) << name << ": " << effect.reason;
      EXPECT_EQ(effect.runs, needed) << name;
      EXPECT_FALSE(effect.reason.empty());
    };
    expect("colour", !room.uniform && (room.coloured_wall || room.second_lamp));
    expect("occlusion", room.block);
    expect("interreflection", !black || (room.coloured_wall && !room.uniform));
    expect("subdivision", options.adaptive.tolerance > 0 && !room.uniform);
    expect("near_field", !room.uniform);
    expect("specular", room.mirror);
    // 0 only where it is proven.
    EXPECT_EQ(effect_of(plan, "occlusion").skip_error_relative, room.block ? -1 : 0);
  }
}

TEST(Effects, NamesThatDoNotExistAreRefused) {
  SolveOptions options;
  options.without = {"all"};
  EXPECT_THROW(plan_effects(make_room({}), options), UsageError);
  options.without = {}, options.force_effects = {"occlusion", "radiosity"};
  try {
    plan_effects(make_room({}), options);
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("there is no effect \"radiosity\""), std::string::npos) << e.what();
  }
}

TEST(Effects, WhatIsAskedForWins) {
  SolveOptions options;
  options.force_effects = {"all"};
  options.without = {"colour"};
  for (const Effect& e : plan_effects(make_room({}), options))
    EXPECT_EQ(e.runs, e.name != "colour") << e.name;
}

// Time of the processor, so that other work does not count: a room with 1e5 polygons, and 1e5 that each are a part of a dome,
// where no two are in one plane and nothing is in front of anything.
TEST(Effects, AHundredThousandPolygonsTakeLessThanASecond) {
  const auto seconds = [](const Scene& scene) {
    const std::clock_t start = std::clock();
    plan_effects(scene, {});
    return double(std::clock() - start) / CLOCKS_PER_SEC;
  };
  Scene room = make_room({.block = true});
  const auto block = std::vector<Polygon>(room.polygons.begin() + 6, room.polygons.end());
  while (room.polygons.size() < 100'000)
    for (Polygon p : block) {
      const double step = 1e-5 * double(room.polygons.size());
      for (auto& c : p.corner) c += glm::dvec3(step, 0, 0);
      room.polygons.push_back(p);
    }
  EXPECT_LT(seconds(room), 1);

  Scene dome = make_room({});
  dome.polygons.clear();
  constexpr int rings = 160, sectors = 320;
  const auto on_sphere = [](int i, int j) {
    const double theta = 3.141592653589793 * i / rings, phi = 2 * 3.141592653589793 * j / sectors;
    return glm::dvec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sectors; ++j)
      for (const bool second : {false, true}) {
        Polygon p;
        p.corners = 3;
        p.corner = {on_sphere(i, j), on_sphere(i, j + 1), on_sphere(i + 1, j + 1)};
        if (second) p.corner = {on_sphere(i, j), on_sphere(i + 1, j + 1), on_sphere(i + 1, j)};
        if (p.area_m2() > 1e-9) dome.polygons.push_back(p);
      }
  ASSERT_GT(dome.polygons.size(), 100'000u);
  EXPECT_LT(seconds(dome), 1);
}

}  // namespace
}  // namespace clrad
