// View factors against the reference's closed forms and tables, and against what must hold of any scene.
//
// Tolerances: what is asked for, target_error x F; references have 12 digits or more. Estimates are sums of errors' sizes
// over cells, so they should cover the error of each entry; one in fifty may be off by up to 3 (kinks that Gauss points
// of a coarse cell see too little of).
#include "clrad/view_factors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "oracle/reference.hpp"

namespace clrad {
namespace {

using oracle::json;

constexpr double targets[] = {1e-4, 1e-6};

Device& double_device() {
  static Device device({.precision = Precision::float64});
  return device;
}

Scene scene_of_polygons(const std::vector<json>& polygons) {
  Scene scene;
  scene.file = "reference";
  scene.bands = {"grey"};
  scene.materials.push_back({"black", {0.0}, {0.0}, {}});
  for (const json& p : polygons)
    scene.polygons.push_back(oracle::polygon(p, 0, fmt::format("p{}", scene.polygons.size())));
  return scene;
}

// Entries seen so far and those whose estimate did not cover the error.
struct Coverage {
  int entries = 0, missed = 0;
  void expect(const std::string& what, double got, double estimate, double want, double target) {
    const double error = std::abs(got - want), rounding = 1e-12 * want;
    EXPECT_LE(error, target * want + rounding) << what << ": " << got << " is not " << want;
    EXPECT_LE(error, 3 * estimate + rounding) << what << ": estimate";
    ++entries;
    missed += error > estimate + rounding;
  }
  ~Coverage() { EXPECT_LE(50 * missed, entries) << missed << " of " << entries << " estimates too low"; }
};

std::string id_of(const json& c) {
  return c.at("id");
}

TEST(ViewFactors, TwoPolygons) {
  const json data = oracle::reference("a_area_factors.json");
  Coverage coverage;
  for (const double target : targets)
    for (const json& c : data.at("cases")) {
      if (!c.contains("polygon_1")) continue;
      const auto f = view_factors(double_device(), scene_of_polygons({c.at("polygon_1"), c.at("polygon_2")}),
                                  {.target_error = target});
      coverage.expect(id_of(c), f.at(0, 1), f.error_at(0, 1), c.at("value"), target);
      coverage.expect(id_of(c) + " back", f.at(1, 0), f.error_at(1, 0), c.at("value_reverse"), target);
      EXPECT_EQ(f.over_target, 0u) << id_of(c);
      EXPECT_EQ(f.reciprocity.pairs, 1u) << id_of(c);
      EXPECT_LE(f.reciprocity.worst, 2 * target) << id_of(c);
    }
  EXPECT_GE(coverage.entries, 100);
}

// Regular polygons of 8 and 16 corners are faces that reading cuts into triangles: one row each.
TEST(ViewFactors, FacesOfManyCornersAreOneRow) {
  const json data = oracle::reference("a_area_factors.json");
  int found = 0;
  for (const json& c : data.at("cases")) {
    if (!c.contains("regular_polygon_versions")) continue;
    for (const json& v : c.at("regular_polygon_versions")) {
      Scene scene = scene_of_polygons({});
      std::uint32_t line = 0;
      for (const char* key : {"polygon_1", "polygon_2"}) {
        const json& corners = v.at(key);
        ++line;
        for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
          Polygon p = oracle::polygon({corners[0], corners[k], corners[k + 1]}, 0, key);
          p.where = {"disks.obj", line, ""};
          scene.polygons.push_back(p);
        }
      }
      const auto f = view_factors(double_device(), scene);
      ASSERT_EQ(f.rows(), 2u);
      const double want = v.at("value");
      EXPECT_NEAR(f.at(0, 1), want, 1e-4 * want) << id_of(c);
      EXPECT_NEAR(f.at(0, 1) * f.area_m2[0], f.at(1, 0) * f.area_m2[1], 1e-14 * f.area_m2[0]);
      ++found;
    }
  }
  EXPECT_GE(found, 4);
}

TEST(ViewFactors, ClosedRoomsAndTheirRowSums) {
  const json data = oracle::reference("a_closure.json");
  Coverage coverage;
  for (const double target : targets)
    for (const json& c : data.at("cases")) {
      if (!c.contains("faces")) continue;
      std::vector<json> faces;
      for (const json& face : c.at("faces")) faces.push_back(face.at("vertices"));
      const auto f = view_factors(double_device(), scene_of_polygons(faces), {.target_error = target});
      EXPECT_TRUE(f.closed) << id_of(c);
      EXPECT_EQ(f.hidden_pairs, 0u) << id_of(c);
      for (std::uint32_t i = 0; i < f.rows(); ++i) {
        EXPECT_NEAR(f.row_sum[i], 1, f.row_error[i] + 1e-12) << id_of(c) << " row " << i;
        EXPECT_LE(f.row_error[i], target * f.row_sum[i]) << id_of(c) << " row " << i;
        for (std::uint32_t j = 0; j < f.rows(); ++j)
          coverage.expect(fmt::format("{} {} {}", id_of(c), i, j), f.at(i, j), f.error_at(i, j),
                          c.at("F")[i][j], target);
      }
    }
}

// The L-shaped room: the reentrant corner hides; floor and ceiling are L-shaped faces of two pieces each.
TEST(ViewFactors, LShapedRoom) {
  const json data = oracle::reference("a_closure.json");
  const json& c = oracle::reference_case(data, "A-closure-lroom-1");
  std::vector<json> polygons;
  for (const json& wall : c.at("walls")) polygons.push_back(wall.at("vertices"));
  const auto walls = std::uint32_t(polygons.size());
  Scene scene = scene_of_polygons(polygons);
  const json& l = c.at("floor_polygon_concave");
  const double height = c.at("ceiling_height");
  // Cut at the reentrant corner (3) and its opposite (0).
  for (const std::uint32_t level : {0u, 1u})
    for (const auto& piece : {std::array{0, 1, 2, 3}, std::array{0, 3, 4, 5}}) {
      Polygon p = oracle::polygon({l[piece[0]], l[piece[1]], l[piece[2]], l[piece[3]]}, 0,
                                  level ? "ceiling" : "floor");
      if (level) std::reverse(p.corner.begin(), p.corner.end());
      for (auto& corner : p.corner) corner.z = level * height;
      p.where = {"room.obj", level + 1, ""};
      scene.polygons.push_back(p);
    }
  for (const double target : targets) {
    const auto f = view_factors(double_device(), scene, {.target_error = target});
    ASSERT_EQ(f.rows(), walls + 2);
    EXPECT_GT(f.hidden_pairs, 0u);
    Coverage coverage;
    const auto check = [&](std::uint32_t i, std::uint32_t j, double want) {
      coverage.expect(fmt::format("{} {}", i, j), f.at(i, j), f.error_at(i, j), want, target);
    };
    for (std::uint32_t i = 0; i < walls; ++i) {
      for (std::uint32_t j = 0; j < walls; ++j) check(i, j, c.at("F_wall_wall")[i][j]);
      check(i, walls, c.at("F_wall_floor")[i]);
      check(walls, i, c.at("F_floor_wall")[i]);
      check(i, walls + 1, c.at("F_wall_ceiling")[i]);
    }
    check(walls, walls + 1, c.at("F_floor_ceiling"));
    for (std::uint32_t i = 0; i < f.rows(); ++i) EXPECT_NEAR(f.row_sum[i], 1, f.row_error[i] + 1e-11) << i;
  }
}

TEST(ViewFactors, WhatStandsBetweenHides) {
  const json data = oracle::reference("b_area_occluded.json");
  Coverage coverage;
  for (const double target : targets)
    for (const json& c : data.at("cases")) {
      if (!c.contains("receiver")) continue;
      std::vector<json> polygons{c.at("receiver"), c.at("light")};
      for (const json& o : c.at("occluders")) polygons.push_back(o);
      const auto f = view_factors(double_device(), scene_of_polygons(polygons), {.target_error = target});
      coverage.expect(id_of(c), f.at(0, 1), f.error_at(0, 1), c.at("value"), target);
    }
  EXPECT_GE(coverage.entries, 14);
}

// Where the stack of pieces is too small, shooters are halved: the same answer, within what both say of themselves.
TEST(ViewFactors, NoRoomForPiecesHalvesTheShooter) {
  const Scene scene = load_scene(CLRAD_SCENES "/block_room.obj");
  const auto roomy = view_factors(double_device(), scene, {.reciprocity_sample = 0});
  const auto tight = view_factors(double_device(), scene, {.reciprocity_sample = 0, .stack_pieces = 2});
  EXPECT_GT(tight.points, roomy.points);
  ASSERT_EQ(roomy.column, tight.column);
  for (std::size_t k = 0; k < roomy.factor.size(); ++k)
    EXPECT_NEAR(roomy.factor[k], tight.factor[k], roomy.error[k] + tight.error[k] + 1e-14);
}

// A block on the floor of a closed room: where it stands the floor is dark (0.75 of 12 m2), every other
// row sums to 1. Faces touch without sharing corners, so that the scene does not count as watertight.
TEST(ViewFactors, RoomWithABlock) {
  const auto f =
      view_factors(double_device(), load_scene(CLRAD_SCENES "/block_room.obj"), {.target_error = 1e-6});
  EXPECT_EQ(f.over_target, 0u);
  EXPECT_LE(f.reciprocity.worst, 2e-6);
  for (std::uint32_t i = 0; i < f.rows(); ++i) {
    const double visible = f.name[i] == "z_min" ? 1 - 0.75 / 12 : 1;
    EXPECT_NEAR(f.row_sum[i], visible, f.row_error[i]) << f.name[i];
  }
}

// A closed box hides by its outline, a box that lacks a face by the faces it has: the same, since what passes through a
// convex body passes through two of its faces. Also where the box stands on the receiver or touches the shooter.
TEST(ViewFactors, ABoxHidesAsItsFacesDo) {
  const auto quad = [](std::array<glm::dvec3, 4> c) {
    json polygon = json::array();
    for (const auto& p : c) polygon.push_back({p.x, p.y, p.z});
    return polygon;
  };
  const json below = quad({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}),
             above = quad({{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}});
  for (const auto& [low, high] : {std::pair{0.3, 0.6}, {0.0, 0.5}, {0.45, 1.0}}) {
    // Turned about z by the angle of the triangle 3, 4, 5.
    const auto at = [](double x, double y, double z) {
      return glm::dvec3(0.55 + 0.8 * x - 0.6 * y, 0.45 + 0.6 * x + 0.8 * y, z);
    };
    const glm::dvec3 c[8] = {at(-.3, -.2, low),  at(.3, -.2, low),  at(.3, .2, low),  at(-.3, .2, low),
                             at(-.3, -.2, high), at(.3, -.2, high), at(.3, .2, high), at(-.3, .2, high)};
    std::vector<json> polygons{below,
                               above,
                               quad({{c[0], c[3], c[2], c[1]}}),
                               quad({{c[0], c[1], c[5], c[4]}}),
                               quad({{c[1], c[2], c[6], c[5]}}),
                               quad({{c[2], c[3], c[7], c[6]}}),
                               quad({{c[3], c[0], c[4], c[7]}}),
                               quad({{c[4], c[5], c[6], c[7]}})};
    const auto body = view_factors(double_device(), scene_of_polygons(polygons), {.reciprocity_sample = 0});
    // What stands on the receiver lacks its foot: under another it would be open.
    polygons.erase(low == 0 ? polygons.begin() + 2 : polygons.end() - 1);
    const auto faces = view_factors(double_device(), scene_of_polygons(polygons), {.reciprocity_sample = 0});
    EXPECT_GT(body.at(0, 1), 0.01);
    EXPECT_LT(body.at(0, 1), 0.18);  // 0.1998 with nothing in between
    EXPECT_NEAR(body.at(0, 1), faces.at(0, 1), body.error_at(0, 1) + faces.error_at(0, 1)) << low;
  }
}

// Moved a million metres (exactly), scaled by a power of two, and a batch cut smaller by less memory: the same bits.
TEST(ViewFactors, SameBitsWhereverItStands) {
  const json data = oracle::reference("b_area_occluded.json");
  const json& c = oracle::reference_case(data, "B-ar-1");
  const Scene scene = scene_of_polygons({c.at("receiver"), c.at("light"), c.at("occluders")[0]});
  const auto f = view_factors(double_device(), scene);
  Scene moved = scene;
  for (Polygon& p : moved.polygons)
    for (glm::dvec3& corner : p.corner) corner = (corner + glm::dvec3(1048576, -2097152, 524288)) * 0.25;
  const auto g = view_factors(double_device(), moved);
  ASSERT_EQ(f.column, g.column);
  // Plane tests know that coordinates are coarser there; the integrals do not depend on it.
  EXPECT_EQ(f.factor, g.factor);
  Device small({.precision = Precision::float64, .memory_bytes = 8u << 20});
  EXPECT_EQ(view_factors(small, scene).factor, f.factor);
}

// Single precision: 24 bits of the contour's terms, whose sum is F; 1e-3 of the entry is what is left of that here.
TEST(ViewFactors, SinglePrecision) {
  Device device;
  const json data = oracle::reference("a_closure.json");
  const json& c = oracle::reference_case(data, "A-closure-box-1");
  std::vector<json> faces;
  for (const json& face : c.at("faces")) faces.push_back(face.at("vertices"));
  const auto f = view_factors(device, scene_of_polygons(faces), {.target_error = 1e-3});
  for (std::uint32_t i = 0; i < 6; ++i)
    for (std::uint32_t j = 0; j < 6; ++j) EXPECT_NEAR(f.at(i, j), double(c.at("F")[i][j]), 1e-3 * f.at(i, j));
}

TEST(ViewFactors, StoppedBeforeItBeginsHasNoEntries) {
  const auto f = view_factors(double_device(), load_scene(CLRAD_SCENES "/block_room.obj"),
                              {.progress = [](const ViewFactorProgress&) { return false; }});
  EXPECT_TRUE(f.stopped);
  EXPECT_EQ(f.column.size(), 0u);
  EXPECT_EQ(f.pairs_done, 0u);
  EXPECT_EQ(f.rows(), 15u);
  EXPECT_EQ(std::count(f.complete.begin(), f.complete.end(), true), 0);
}

// Wherever it stops: what is complete is what the whole run gives, and what has begun says how wrong it still is; also where
// shooters are halved because their pieces have no room.
TEST(ViewFactors, StoppedKeepsWhatIsDone) {
  const Scene scene = load_scene(CLRAD_SCENES "/block_room.obj");
  std::size_t complete = 0, partial = 0;
  for (const std::uint32_t stack : {64u, 2u}) {
    int asked = 0;
    ViewFactorOptions options{.reciprocity_sample = 0, .stack_pieces = stack};
    options.progress = [&](const ViewFactorProgress& p) {
      EXPECT_LE(p.pairs_done, p.pairs);
      ++asked;
      return true;
    };
    const auto whole = view_factors(double_device(), scene, options);
    EXPECT_FALSE(whole.stopped);
    EXPECT_EQ(whole.pairs_done, whole.pairs_asked);
    const int n = int(whole.rows());
    ASSERT_GT(asked, n + 4);  // once a row, once a round
    for (int after = n; after < asked; after += std::max(1, (asked - n) / 6)) {
      int left = after;
      options.progress = [&](const ViewFactorProgress&) { return left-- > 0; };
      const auto f = view_factors(double_device(), scene, options);
      EXPECT_TRUE(f.stopped);
      EXPECT_LT(f.pairs_done, f.pairs_asked);
      for (std::uint32_t i = 0; i < f.rows(); ++i)
        for (std::uint32_t j = 0; j < f.rows(); ++j) {
          if (f.complete[i]) {
            ++complete;
            EXPECT_EQ(f.at(i, j), whole.at(i, j)) << stack << ' ' << after << ' ' << i << ' ' << j;
          } else if (f.at(i, j) > 0) {
            ++partial;
            // As the README says of the estimate: short by a factor of 3 at most.
            EXPECT_NEAR(f.at(i, j), whole.at(i, j), 3 * (f.error_at(i, j) + whole.error_at(i, j)))
                << i << ' ' << j;
          }
        }
    }
  }
  EXPECT_GT(complete, 0u);
  EXPECT_GT(partial, 0u);
}

// All pairs are done by the time that some are integrated the other way round: what is left out then is that alone.
TEST(ViewFactors, StoppedAtReciprocityIsWhole) {
  const Scene scene = load_scene(CLRAD_SCENES "/block_room.obj");
  int asked = 0;
  ViewFactorOptions options;
  options.progress = [&](const ViewFactorProgress&) { return ++asked > 0; };
  const auto whole = view_factors(double_device(), scene, options);
  options.progress = [&](const ViewFactorProgress&) { return --asked > 0; };
  const auto f = view_factors(double_device(), scene, options);
  EXPECT_FALSE(f.stopped);
  EXPECT_EQ(f.reciprocity.pairs, 0u);
  EXPECT_EQ(f.factor, whole.factor);
}

// Kinks where the edges of many boxes line up, and slits between them: each pair integrated both ways, which places cells quite
// differently. What is held is what the README says of the estimate; the room is not one its constants were set on.
TEST(ViewFactors, ErrorEstimateHoldsInAClutteredRoom) {
  Scene scene = oracle::box_scene({4, 4, 3}, {0.5}, {0});
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int k = 0; k < 9; ++k) {
    const glm::dvec3 middle(0.7 + 1.3 * (k % 3), 0.7 + 1.3 * (k / 3), uniform(0.6, 2.4));
    const double half[3] = {uniform(0.1, 0.4), uniform(0.1, 0.4), uniform(0.1, 0.5)}, turn = uniform(0, 1.5);
    const glm::dvec3 axis[3] = {
        {std::cos(turn), std::sin(turn), 0}, {-std::sin(turn), std::cos(turn), 0}, {0, 0, 1}};
    for (int face = 0; face < 6; ++face) {
      const int a = face / 2, b = (a + 1) % 3, c = (a + 2) % 3;
      const double side = face % 2 ? 1 : -1;
      Polygon p = scene.polygons[0];
      p.corners = 4;
      for (int corner = 0; corner < 4; ++corner) {
        double sign[3];
        sign[a] = side, sign[b] = corner == 0 || corner == 3 ? -side : side, sign[c] = corner < 2 ? -1 : 1;
        glm::dvec3 at = middle;  // the same sum for each face: closed to the bit
        for (int i = 0; i < 3; ++i) at += sign[i] * half[i] * axis[i];
        p.corner[std::size_t(corner)] = at;
      }
      scene.polygons.push_back(p);
    }
  }
  const auto f = view_factors(double_device(), scene, {.target_error = 1e-3, .reciprocity_sample = 1000000});
  EXPECT_TRUE(f.closed);
  EXPECT_GT(f.hidden_pairs, 200u);
  EXPECT_GT(f.reciprocity.pairs, 400u);
  std::printf("%zu pairs, %zu beyond their estimates, %zu beyond three times that; rows within %.1e\n",
              std::size_t(f.reciprocity.pairs), std::size_t(f.reciprocity.beyond),
              std::size_t(f.reciprocity.far_beyond), f.worst_row_defect);
  EXPECT_LE(f.reciprocity.beyond, f.reciprocity.pairs / 20);
  EXPECT_LE(f.reciprocity.far_beyond, f.reciprocity.pairs / 50);
  for (std::uint32_t i = 0; i < f.rows(); ++i) EXPECT_NEAR(f.row_sum[i], 1, f.row_error[i]) << i;
}

TEST(ViewFactors, BadTargetsAreRefused) {
  const Scene scene = scene_of_polygons({});
  EXPECT_THROW(view_factors(double_device(), scene, {.target_error = 0}), UsageError);
  EXPECT_THROW(view_factors(double_device(), scene, {.target_error = NAN}), UsageError);
  EXPECT_THROW(view_factors(double_device(), scene, {.target_error = 1}), UsageError);
  EXPECT_EQ(view_factors(double_device(), scene).rows(), 0u);
}

}  // namespace
}  // namespace clrad
