// Scenes that break grids: everything in one voxel, one polygon in all of them, gaps thinner than any epsilon; NaN and
// signed zeros where numbers should be; cameras where no camera should be.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "clrad/clrad.hpp"
#include "hard/table.hpp"
#include "oracle/reference.hpp"
#include "visibility/boxes.hpp"
#include "visibility/chop.hpp"
#include "visibility/snap.hpp"

namespace clrad {
namespace {

using test::HardCase;

struct Setting {
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> from, to;
};

std::vector<std::uint32_t> ask(Device& device, VisibilityEngine& engine, const Setting& s) {
  const PointArray from(device, s.from, "origins"), to(device, s.to, "targets");
  Array<std::uint32_t> masks(device, s.from.size(), "masks");
  engine.occluded({&from, nullptr, std::uint32_t(s.from.size()), &to, 0}, masks);
  return masks.download();
}

std::uint64_t differences(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

// A hundred thousand triangles of 1e-5 in a cube of 1e-3, in the corner of a room of 1: with some 40 voxels a side at most,
// all of them are in one.
TEST(HardCrowded, AHundredThousandTinyObjectsInOneVoxel) {
  HardCase verdict("100,000 triangles of 1e-5 in one voxel of a room's grid, rays past and through them",
                   "A teapot in a stadium: one list of all objects, ever deeper trees, or memory runs out");
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto place = [&](double size) { return glm::dvec3(unit(random), unit(random), unit(random)) * size; };
  Setting s;
  test::add_box(s.triangles, {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  const glm::dvec3 corner(-0.49, -0.49, -0.49);
  for (std::uint32_t k = 0; k < 100000; ++k) {
    const glm::dvec3 at = corner + place(1e-3);
    s.triangles.push_back({{at, at + place(1e-5), at + place(1e-5)}, 6 + k, 6 + k});
  }
  for (int k = 0; k < 3000; ++k) {
    const bool through = k % 3 > 0;
    s.from.push_back({through ? corner + place(1e-3) : place(0.9) - 0.45});
    s.to.push_back({k % 3 == 1 ? place(0.9) - 0.45 : through ? corner + place(1e-3) : place(0.9) - 0.45});
  }
  Device device({.memory_bytes = 512u << 20});
  const auto expected = ask(device, *make_engine("serial", device, s.triangles), s);
  const auto hits = std::uint64_t(std::count(expected.begin(), expected.end(), 1u));
  EXPECT_GT(hits, 100u);
  EXPECT_LT(hits, 2900u);
  auto chop = make_chop(device, s.triangles, {});
  verdict.count(expected.size(), differences(ask(device, *chop, s), expected), "its own grid");
  const auto cells = chop->grid().cells;
  verdict.note(fmt::format("grid of {} x {} x {}, {:.1f} triangles tested a ray", cells[0], cells[1],
                           cells[2], double(chop->counts().candidates) / double(chop->counts().rays)));
  chop.reset();  // so that its scratch does not take of the other's 512 MiB
  verdict.count(expected.size(),
                differences(ask(device, *make_chop(device, s.triangles, {.cells = {8, 8, 8}}), s), expected),
                "8 x 8 x 8");
}

TEST(HardCrowded, PolygonsThatSpanTheWholeGrid) {
  HardCase verdict("Walls through the whole scene, slanted and in voxel faces, among 2000 small triangles",
                   "Large polygons are listed by their box, or missed where they only graze a voxel");
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto place = [&](double size) { return glm::dvec3(unit(random), unit(random), unit(random)) * size; };
  Setting s;
  s.triangles = {{{{-1, -1, -1}, {1, -1, -0.9}, {-1, 1, 1}}, 0, 0},
                 {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}}, 1, 1},
                 {{{-1, -1, 1}, {1, -1, -1}, {1, -1 + 0x1p-30, 1}}, 2, 2},  // a needle's breadth
                 {{{0.25, -1, -1}, {0.25, 1, -1}, {0.25, 0, -0.75}}, 3, 3}};
  for (std::uint32_t k = 4; k < 2000; ++k) {
    const glm::dvec3 at = place(0.98);
    s.triangles.push_back({{at, at + place(0.02), at + place(0.02)}, k, k});
  }
  for (int k = 0; k < 20000; ++k) {
    glm::dvec3 a = place(1), b = place(1);
    if (k % 4 == 0) b = a, b[k % 3] = -b[k % 3];          // along an axis
    if (k % 4 == 1) a.z = 0, b.z = k % 8 == 1 ? 0 : b.z;  // from, or in, the wall at z = 0
    s.from.push_back({a}), s.to.push_back({b});
  }
  Device device;
  const auto expected = ask(device, *make_engine("serial", device, s.triangles), s);
  for (const ChopOptions& options :
       {ChopOptions{}, ChopOptions{.cells = {16, 16, 16}}, ChopOptions{.cells = {1, 64, 1}},
        ChopOptions{.cells = {40, 40, 40}, .slab = 3}}) {
    auto chop = make_chop(device, s.triangles, options);
    verdict.count(expected.size(), differences(ask(device, *chop, s), expected),
                  fmt::format("{} cells along y", chop->grid().cells[1]));
  }
  verdict.count(expected.size(),
                differences(ask(device, *make_engine("shaft", device, s.triangles), s), expected), "shaft");
}

// Two boxes side by side, a gap between them; straight down through it there is nothing in the way for any gap of a few grid
// steps (2^-38 of the frame), and everything where they touch. Beside the gap both boxes block.
TEST(HardCrowded, NeedleThinGapsBetweenBoxes) {
  HardCase verdict(
      "Boxes that touch, and with gaps of 1.5e-11 to 1e-3 of the scene, rays in the gap and beside it",
      "An epsilon closes thin gaps, or opens touching faces");
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double half : {0.0, 2 * 0x1p-38, 0x1p-31, 1e-6, 1e-3})
    for (const std::string& engine : engine_names()) {
      Setting s;
      test::add_box(s.triangles, {-0.5, -0.5, -0.25}, {-half, 0.5, 0.25});
      test::add_box(s.triangles, {half, -0.5, -0.25}, {0.5, 0.5, 0.25});
      std::vector<std::uint32_t> expected;
      const auto push = [&](double x0, double x1, bool is_blocked) {
        s.from.push_back({{x0, 0.4 * (2 * unit(random) - 1), 0.5}});
        s.to.push_back({{x1, 0.4 * (2 * unit(random) - 1), -0.5}});
        if (random() % 2) std::swap(s.from.back(), s.to.back());
        expected.push_back(is_blocked);
      };
      const double step = 0x1p-38;
      for (int k = 0; k < 500; ++k) {
        // In the plane between: open unless they touch; touching faces count as hits.
        push(0, 0, half == 0);
        // In the faces themselves, which blocks; a step inside a box; a step inside the gap.
        push(half, half, true), push(-half, -half, true);
        push(half + step, half + step, true), push(-half - step, -half - step, true);
        if (half > 2 * step) push(half - step, half - step, false);
        // Across the gap on the way down: through a box's inner face.
        if (half > 0) push(-3 * half, 3 * half, true);
      }
      Device device;
      const auto got = ask(device, *make_engine(engine, device, s.triangles), s);
      verdict.count(got.size(), differences(got, expected), fmt::format("gap {}, {}", 2 * half, engine));
    }
}

// N copies of a triangle: blocked or not as by one, and the nearest hit is the lowest index.
TEST(HardCrowded, CoplanarDuplicates) {
  HardCase verdict("A wall 1, 2, 17 and 1000 times: what it blocks, and which copy is hit first",
                   "Which of several coincident surfaces is seen changes from run to run");
  std::mt19937_64 random(14);
  std::uniform_real_distribution<double> unit(-1, 1);
  Setting s;
  const OccluderTriangle wall{{{-0.5, -0.5, 0.125}, {0.75, -0.5, 0.25}, {0, 0.75, 0.25}}, 0, 0};
  for (int k = 0; k < 2000; ++k) {
    s.from.push_back({{unit(random), unit(random), 0.5 + 0.4 * unit(random)}});
    s.to.push_back({{unit(random), unit(random), -0.5 + 0.4 * unit(random)}});
  }
  Device device;
  std::vector<std::uint32_t> first;
  std::vector<float> first_t;
  for (const int copies : {1, 2, 17, 1000})
    for (const std::string& name : engine_names()) {
      s.triangles.assign(std::size_t(copies), wall);
      const auto engine = make_engine(name, device, s.triangles);
      const PointArray from(device, s.from, "origins"), to(device, s.to, "targets");
      Array<std::uint32_t> nearest(device, s.from.size(), "triangles");
      Array<float> t(device, s.from.size(), "t");
      engine->intersect_closest({&from, nullptr, std::uint32_t(s.from.size()), &to, 0}, nearest, t);
      const auto which = nearest.download(), masks = ask(device, *engine, s);
      if (first.empty()) first = masks, first_t = t.download();
      std::uint64_t wrong = differences(masks, first);
      for (std::size_t i = 0; i < which.size(); ++i) wrong += which[i] != (first[i] ? 0u : 0xffffffffu);
      verdict.count(2 * which.size(), wrong, fmt::format("{} copies, {}", copies, name));
      verdict.right(t.download() == first_t, "where it is hit");
    }
}

// Whatever is no number is refused by name, or has a defined result; a negative zero is a zero.
TEST(HardCrowded, NotANumberInfinityAndMinusZeroInEveryField) {
  HardCase verdict("NaN, infinity and -0 in every coordinate of points, triangles, sensors and materials",
                   "The program survives, and the picture is black; NaN spreads through all sums");
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  Device device;
  const auto refused = [&](const auto& run, const std::string& where) {
    bool thrown = false;
    try {
      run();
    } catch (const Error&) {
      thrown = true;
    }
    verdict.right(thrown, where);
  };
  for (const double bad : {nan, inf, -inf})
    for (int axis = 0; axis < 3; ++axis) {
      const std::string where = fmt::format("{} at axis {}", bad, axis);
      Point point{{0.1, 0.2, 0.3}};
      point.position[axis] = bad;
      refused([&] { PointArray(device, std::vector<Point>{point}, "points"); }, "a point, " + where);
      for (int corner = 0; corner < 3; ++corner) {
        OccluderTriangle t{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 0, 0};
        t.corner[corner][axis] = bad;
        for (const std::string& name : engine_names())
          refused([&] { make_engine(name, device, std::vector<OccluderTriangle>{t}); },
                  "a triangle, " + name + ", " + where);
      }
      SolveOptions options;
      options.mesh = {1, 1};
      options.sensors = {{{0.5, 0.5, 0.5}, {0, 0, 1}}};
      options.sensors[0].position_m[axis] = bad;
      const Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
      refused([&] { solve(device, scene, options); }, "a sensor, " + where);
    }
  // -0: the bits of +0, in every coordinate of a scene and of segments.
  std::mt19937_64 random(15);
  Setting s;
  const auto place = [&] {
    const auto value = [&] { return double(int(random() % 5) - 2) / 4; };
    return glm::dvec3(value(), value(), value());
  };
  for (std::uint32_t k = 0; k < 30; ++k) s.triangles.push_back({{place(), place(), place()}, k, k});
  for (int k = 0; k < 3000; ++k) s.from.push_back({place()}), s.to.push_back({place()});
  Setting minus = s;
  const auto negate = [](glm::dvec3& p) {
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] == 0) p[axis] = -0.0;
  };
  for (auto& t : minus.triangles)
    for (auto& c : t.corner) negate(c);
  for (auto& p : minus.from) negate(p.position);
  for (auto& p : minus.to) negate(p.position);
  for (const std::string& name : engine_names()) {
    const auto a = ask(device, *make_engine(name, device, s.triangles), s),
               b = ask(device, *make_engine(name, device, minus.triangles), minus);
    verdict.count(a.size(), differences(a, b), "-0, " + name);
  }
  Scene zeros = oracle::box_scene({1, 1, 1}, {0.5}, {1}), others = zeros;
  for (auto& polygon : others.polygons)
    for (auto& c : polygon.corner) negate(c);
  SolveOptions options;
  options.mesh = {0.5, 0.25};
  verdict.right(
      solve(device, zeros, options).vertex_irradiance == solve(device, others, options).vertex_irradiance,
      "-0 in a scene");
}

// The eye in a wall's plane, in a corner of the room, inside a solid block, in the middle of a lamp: pictures are made of
// numbers. In the wall's plane the wall itself is not seen, so what is seen is what an eye just in front of it sees; from
// within a block there are only backs, which are black.
TEST(HardCrowded, CamerasInsideWalls) {
  HardCase numbers("Pictures with the eye in a wall, in a corner, inside a block, with the target behind it",
                   "NaN pixels; the wall fills the picture or vanishes, by rounding"),
      same("The eye in the wall against the eye 1e-9 m in front of it", "As above"),
      black("The eye inside a block", "Its faces are seen from behind, lit");
  Scene scene = oracle::box_scene({1, 1, 1}, {0.5}, {1});
  Scene block = oracle::box_scene({0.25, 0.25, 0.25}, {0.5}, {0});
  scene.materials.push_back(block.materials[0]);
  for (Polygon p : block.polygons) {
    for (auto& c : p.corner) c += glm::dvec3(0.5, 0.5, 0.25);
    std::reverse(p.corner.begin(), p.corner.end());
    p.material = 1;
    scene.polygons.push_back(p);
  }
  SolveOptions options;
  options.mesh = {0.5, 0.125};
  Device device;
  const Solution s = solve(device, scene, options);
  ImageOptions picture;
  picture.width = 40, picture.height = 40, picture.samples_per_pixel = 1;
  const auto draw = [&](const glm::dvec3& eye, const glm::dvec3& target) {
    Camera camera;
    camera.eye = eye, camera.target = target, camera.up = {0.1, 0.2, 1};
    const Image image = render(device, s, camera, picture);
    std::uint64_t wrong = 0;
    for (const float x : image.radiance) wrong += !(std::isfinite(x) && x >= 0);
    numbers.count(image.radiance.size(), wrong, fmt::format("eye {} {} {}", eye.x, eye.y, eye.z));
    return image.radiance;
  };
  draw({0, 0, 0}, {1, 1, 1});
  draw({1, 1, 1}, {0, 0, 0});
  draw({0, 0.5, 0.5}, {-1, 0.5, 0.5});
  draw({0.5, 0.5, 0.25}, {0.5, 0.5, 1});  // a corner of the block
  const auto in = draw({0, 0.375, 0.625}, {1, 0.375, 0.625}),
             before = draw({1e-9, 0.375, 0.625}, {1, 0.375, 0.625});
  // A pixel at an outline may fall on either side of it; elsewhere 1e-9 m changes nothing that a float shows 100 times.
  std::uint64_t apart = 0;
  for (std::size_t i = 0; i < in.size(); ++i)
    apart += !(std::abs(in[i] - before[i]) <= 1e-5 * before[i] + 1e-7);
  same.near(double(apart), 0, 2, "pixels that differ");
  for (const float x : draw({0.625, 0.625, 0.375}, {0.9, 0.7, 0.5})) black.near(x, 0, 0, "inside the block");
}

}  // namespace
}  // namespace clrad
