#include <ctime>
#include <map>
#include <random>

#include "effects/rooms.hpp"
#include "effects/support.hpp"

namespace clrad {
namespace {

using test::effect_of;
using test::make_room;
using test::Room;

// Twenty rooms of all kinds: what each calls for is known, since it was put there. Every effect is called for by some of them
// and not by others.
TEST(Effects, ReasonsAreRight) {
  std::mt19937 random(7);
  const auto one_in = [&](unsigned n) { return random() % n == 0; };
  std::map<std::string, int> called_for;
  for (int k = 0; k < 20; ++k) {
    Room room;
    room.coloured_wall = one_in(4), room.coloured_light = one_in(3), room.second_lamp = one_in(4);
    room.block = one_in(3), room.black = one_in(4), room.mirror = one_in(3), room.uniform = one_in(4);
    room.turned = one_in(2), room.light = one_in(4), room.texture = one_in(4), room.pane = one_in(4);
    room.sheet = one_in(4);
    SolveOptions options;
    if (one_in(2)) options.adaptive.tolerance = 0.1;
    SCOPED_TRACE(k);
    const std::vector<Effect> plan = plan_effects(make_room(room), options);
    // Panes, textures and lights make a room that is otherwise alike everywhere differ from place to place; with a sheet in it,
    // which has no back yet, it is not proven closed.
    const bool alike = room.uniform && !room.light && !room.texture && !room.pane && !room.sheet;
    const bool reflects = !room.black || room.uniform || room.coloured_wall;
    const auto expect = [&](const char* name, bool needed) {
      const Effect& effect = effect_of(plan, name);
      EXPECT_EQ(effect.needed, needed) << name << ": " << effect.reason;
      EXPECT_EQ(effect.runs, needed) << name;
      EXPECT_FALSE(effect.reason.empty());
      called_for[name] += needed;
    };
    expect("colour",
           !room.uniform && (room.coloured_wall || room.second_lamp || (room.light && room.coloured_light)));
    expect("two_sided", room.sheet);
    expect("textures", room.texture);
    expect("occlusion", room.block || room.pane || room.sheet);
    expect("interreflection", reflects);
    expect("subdivision", options.adaptive.tolerance > 0 && !alike);
    expect("lights", room.light);
    expect("near_field", !alike);
    expect("transmission", room.pane);
    expect("specular", room.mirror || room.pane);
    // 0 only where it is proven.
    EXPECT_EQ(effect_of(plan, "occlusion").skip_error_relative,
              room.block || room.pane || room.sheet ? -1 : 0);
  }
  EXPECT_EQ(called_for.size(), effect_names().size());
  for (const auto& [name, times] : called_for) {
    EXPECT_GT(times, 0) << name;
    EXPECT_LT(times, 20) << name;
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
