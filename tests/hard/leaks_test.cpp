// Visibility that can be trusted: segments against closed meshes, from a point that is inside to one that is outside. Every
// one of them has to be blocked, most are aimed exactly at corners and edges, and all engines, packet widths, precisions
// and directions have to give the same bits, those of rational arithmetic on the snapped coordinates.
//
// A million segments; a hundred million with CLRAD_LONG_TESTS=1.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <memory>

#include "clrad/clrad.hpp"
#include "device/divided.hpp"
#include "hard/table.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"
#include "visibility/chop.hpp"
#include "visibility/meshes.hpp"

namespace clrad {
namespace {

using test::HardCase;

// Who answers: on which device, by which engine, in which grid (0: its own).
struct Witness {
  const char* name;
  DeviceOptions device;
  const char* engine;
  std::array<std::uint32_t, 3> grid{};
};
const std::vector<Witness>& witnesses() {
  static const std::vector<Witness> all{
      {"serial, 16 rays, float", {.packet_width = 16}, "serial"},
      {"serial, 1 ray, float", {.packet_width = 1}, "serial"},
      {"serial, 4 rays, 1 core",
       {.cores = test::one_core(), .work_group_size = 16, .packet_width = 4},
       "serial"},
      {"serial, 8 rays, double", {.precision = Precision::float64, .packet_width = 8}, "serial"},
      {"chop, 16 rays, float", {.packet_width = 16}, "chop"},
      {"chop 5 x 4 x 3, 1 ray, float", {.packet_width = 1}, "chop", {5, 4, 3}},
      {"chop 8 x 8 x 8, 8 rays, double",
       {.precision = Precision::float64, .packet_width = 8},
       "chop",
       {8, 8, 8}},
      {"shaft, 16 rays, float", {.packet_width = 16}, "shaft"},
      {"shaft, 1 ray, float", {.packet_width = 1}, "shaft"},
      {"shaft, 8 rays, double", {.precision = Precision::float64, .packet_width = 8}, "shaft"}};
  return all;
}
Device& device_of(std::size_t witness) {
  static std::map<std::size_t, std::unique_ptr<Device>> devices;
  auto& made = devices[witness];
  if (!made) made = std::make_unique<Device>(witnesses()[witness].device);
  return *made;
}

struct Batch {
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> from, to;
};

std::vector<std::uint32_t> blocked(std::size_t witness, const Batch& batch, bool backwards,
                                   VisibilityCounts* counts = nullptr) {
  Device& device = device_of(witness);
  const Witness& w = witnesses()[witness];
  const auto engine =
      std::string(w.engine) == "chop"
          ? std::unique_ptr<VisibilityEngine>(make_chop(device, batch.triangles, {.cells = w.grid}))
          : make_engine(w.engine, device, batch.triangles);
  const PointArray from(device, batch.from, "origins"), to(device, batch.to, "targets");
  Array<std::uint32_t> masks(device, batch.from.size(), "masks");
  engine->occluded(
      {backwards ? &to : &from, nullptr, std::uint32_t(batch.from.size()), backwards ? &from : &to, 0},
      masks);
  if (counts != nullptr) *counts = engine->counts();
  return masks.download();
}

struct Exactness {
  std::uint64_t pairs = 0, exact = 0;
  void add(const VisibilityCounts& c) { pairs += c.candidates, exact += c.exact; }
  std::string text() const {
    return fmt::format("{:.3g} % of the pairs of segment and triangle needed the exact predicate",
                       100.0 * double(exact) / double(pairs));
  }
};

// All witnesses agree, also backwards, and a sample agrees with the oracle. Returns the common answer.
std::vector<std::uint32_t> agreed(HardCase& agreement, HardCase& oracle_says, Exactness& exactness,
                                  const Batch& batch, std::size_t sample) {
  VisibilityCounts counts;
  const auto first = blocked(0, batch, false, &counts);
  exactness.add(counts);
  for (std::size_t w = 0; w < witnesses().size(); ++w)
    for (const bool backwards : {false, true}) {
      if (w == 0 && !backwards) continue;
      // Backwards by four of them is enough: one of each kernel.
      if (backwards && w != 0 && w != 3 && w != 4 && w != 7) continue;
      const auto other = blocked(w, batch, backwards);
      std::uint64_t wrong = 0;
      for (std::size_t i = 0; i < first.size(); ++i) wrong += other[i] != first[i];
      agreement.count(first.size(), wrong,
                      std::string(witnesses()[w].name) + (backwards ? ", backwards" : ""));
    }
  std::vector<oracle::Triangle> triangles;
  for (const auto& t : batch.triangles)
    triangles.push_back({{snap(t.corner[0]), snap(t.corner[1]), snap(t.corner[2])}, t.plane});
  std::uint64_t wrong = 0;
  sample = std::min(sample, first.size());
  for (std::size_t i = 0; i < sample; ++i) {
    const oracle::Segment s{snap(batch.from[i].position), snap(batch.to[i].position), batch.from[i].plane,
                            batch.to[i].plane};
    wrong += oracle::blocked(s, triangles) != (first[i] != 0);
  }
  oracle_says.count(sample, wrong, "rational arithmetic");
  return first;
}

std::uint64_t open_ones(const std::vector<std::uint32_t>& masks) {
  return std::uint64_t(std::count(masks.begin(), masks.end(), 0u));
}

// ---- on the grid itself: exactly through corners and edges

TEST(HardLeaks, ClosedMeshesHitExactlyAtCornersAndEdges) {
  HardCase leaks("Segments out of closed meshes, exactly through corners and edges and one grid step beside",
                 "Rays slip between two triangles at the edge they share (Moeller-Trumbore with floats; "
                 "switched off in others' tests)"),
      agreement("Engines, packet widths, precisions and directions on these segments",
                "Each has an epsilon of its own; V(a, b) differs from V(b, a)"),
      oracle_says("A sample of these against rational arithmetic", "Nobody asks");
  Exactness exactness;
  const std::int64_t one = std::int64_t(1) << 38;
  struct Case {
    std::vector<oracle::Triangle> mesh;
    GridPoint middle;
    std::int64_t inside, outside;
    std::size_t count;
  };
  const GridPoint off{one * 3 + 12345, -one * 3 + 777, one * 2 + 1};
  const std::vector<Case> cases{
      {test::box({0, 0, 0}, {one, one / 2, one / 3}), {0, 0, 0}, one / 4, one, 150000},
      {test::box(off, {one / 1000 + 1, one / 900, one / 800}), off, one / 2000, one / 799, 100000},
      {test::icosphere({0, 0, 0}, double(one), 2), {0, 0, 0}, one / 2, one + 1, 120000},
      {test::icosphere(off, double(one) / 700, 2), off, one / 1500, one / 699, 80000},
      {test::icosphere(off, 1000, 1), off, 300, 1001, 50000}};
  const std::uint64_t seed = 5, rounds = test::long_tests() ? 100 : 1;
  std::mt19937_64 random(seed);
  for (std::uint64_t round = 0; round < rounds; ++round)
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const Case& with = cases[c];
      Batch batch;
      for (const auto& t : with.mesh) batch.triangles.push_back(test::occluder(t));
      for (const auto& s :
           test::escapes(random, with.mesh, with.middle, with.inside, with.outside, with.count)) {
        batch.from.push_back(test::point(s.from, s.from_plane));
        batch.to.push_back(test::point(s.to, s.to_plane));
      }
      const auto answer = agreed(agreement, oracle_says, exactness, batch, 300);
      leaks.count(answer.size(), open_ones(answer), fmt::format("mesh {}, seed {}", c, seed));
    }
  leaks.note(exactness.text());
}

// ---- in metres: at the origin and a million metres from it

using Triangle3 = std::array<glm::dvec3, 3>;

// An icosahedron cut in four `times` times, or a box turned by no simple angle.
std::vector<Triangle3> sphere(int times) {
  std::vector<Triangle3> all;
  for (const auto& t : test::icosphere({0, 0, 0}, 0x1p38, times))
    all.push_back({unsnap(t.corner[0]), unsnap(t.corner[1]), unsnap(t.corner[2])});
  return all;
}
std::vector<Triangle3> turned_box(const glm::dvec3& half) {
  const glm::dvec3 x = glm::normalize(glm::dvec3(3, 1, -2)), y = glm::normalize(glm::dvec3(1, 3, 3)),
                   z = glm::cross(x, y);
  const std::int64_t one = std::int64_t(1) << 38;
  std::vector<Triangle3> all;
  for (const auto& t : test::box({0, 0, 0}, {one, one, one})) {
    Triangle3 made;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 p = unsnap(t.corner[k]) * half;
      made[k] = x * p.x + y * p.y + z * p.z;
    }
    all.push_back(made);
  }
  return all;
}

struct Placed {
  Scene scene;
  Frame frame;
  std::vector<std::uint32_t> planes;
};
Placed placed(const std::vector<Triangle3>& mesh, const glm::dvec3& at) {
  Placed p;
  p.scene.bands = {"grey"};
  p.scene.materials.push_back({"all", {0.5}, {1}, {}});
  for (const auto& t : mesh) {
    Polygon polygon;
    polygon.corners = 3;
    for (std::size_t k = 0; k < 3; ++k) polygon.corner[k] = t[k] + at;
    p.scene.polygons.push_back(polygon);
  }
  p.frame = frame_of(p.scene);
  p.planes = plane_ids(p.scene);
  return p;
}

glm::dvec3 direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  for (;;) {
    const glm::dvec3 v(unit(random), unit(random), unit(random));
    const double length = glm::length(v);
    if (length > 0.1 && length < 1) return v / length;
  }
}

// A place on the surface: a corner, on an edge, or within a face; mostly exactly there, else up to 1e-3 beside.
glm::dvec3 aim(std::mt19937_64& random, const Polygon& t) {
  std::uniform_real_distribution<double> unit(0, 1);
  const std::size_t i = random() % 3;
  glm::dvec3 p = t.corner[i];
  if (random() % 3) p += (t.corner[(i + 1) % 3] - p) * unit(random);
  if (random() % 4 == 0) p += (t.corner[(i + 2) % 3] - p) * unit(random);
  if (random() % 3 == 0) p += direction(random) * std::pow(10.0, -13 + 10 * unit(random));
  return p;
}

// pre: all within `inside` of the middle is inside, all beyond `outside` outside, with room for the rounding of corners.
Batch escapes(const Placed& mesh, const glm::dvec3& middle, double inside, double outside, std::size_t count,
              std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  Batch batch;
  batch.triangles = occluder_triangles(mesh.scene, mesh.frame, mesh.planes);
  for (std::size_t i = 0; i < count; ++i) {
    const Polygon& t = mesh.scene.polygons[random() % mesh.scene.polygons.size()];
    const glm::dvec3 from = middle + direction(random) * (inside * unit(random)), through = aim(random, t);
    const glm::dvec3 d = glm::normalize(through - from);
    const glm::dvec3 to = from + d * (inside + outside + 0.5 * outside * unit(random));
    batch.from.push_back({mesh.frame.to_frame(from), {0, 0, 1}});
    batch.to.push_back({mesh.frame.to_frame(to), {0, 0, 1}});
    if (random() % 2) std::swap(batch.from.back(), batch.to.back());
  }
  return batch;
}

void escapes_in_metres(const glm::dvec3& at, const std::string& where) {
  HardCase leaks("The same in metres, " + where,
                 "Single precision coordinates: a metre is 16 steps of a float there, and walls gape"),
      agreement("Engines, packet widths, precisions and directions, " + where, "As above"),
      oracle_says("A sample against rational arithmetic, " + where, "As above");
  Exactness exactness;
  const std::uint64_t seed = 20261126, rounds = test::long_tests() ? 100 : 1;
  std::mt19937_64 random(seed);
  // Inscribed and circumscribed radii: a sphere of 320 faces keeps 0.95 of its radius inside, the box its least half
  // edge; both have all corners within the outer one.
  struct Case {
    std::vector<Triangle3> mesh;
    double inside, outside;
  };
  const std::vector<Case> cases{{sphere(2), 0.9, 1.001}, {turned_box({1, 0.5, 0.3}), 0.29, 1.17}};
  for (std::uint64_t round = 0; round < rounds; ++round)
    for (std::size_t c = 0; c < cases.size(); ++c) {
      const Placed mesh = placed(cases[c].mesh, at);
      const Batch batch = escapes(mesh, at, cases[c].inside, cases[c].outside, 125000, random);
      const auto answer = agreed(agreement, oracle_says, exactness, batch, 150);
      leaks.count(answer.size(), open_ones(answer), fmt::format("mesh {}, seed {}", c, seed));
    }
  leaks.note(exactness.text());
}

TEST(HardLeaks, ClosedMeshesAtTheOrigin) {
  escapes_in_metres({0, 0, 0}, "at the origin");
}
TEST(HardLeaks, ClosedMeshesAMillionMetresAway) {
  escapes_in_metres({1e6, -1e6, 1e6}, "a million metres from it");
}

// ---- rays that leave the surface they start on

// Points on the walls of a convex room see each other: nothing is between them, and the walls they lie on, however rounding
// has put the points before or behind these, do not count. Points keep 1e-6 of a wall away from its edges, where
// rounding (2^-38 of the frame) could put them behind the neighbour. Sizes from 1e-8 to 1e8 m.
TEST(HardLeaks, RaysLeaveTheSurfaceTheyStartOn) {
  HardCase verdict(
      "1000 rays from hits on each of 17 turned rooms, 1e-8 to 1e8 m in size, also far out",
      "Self-intersection: a fixed epsilon is too small for large coordinates and a leak in small "
      "ones");
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(1e-6, 1 - 1e-6);
  for (int power = -8; power <= 8; ++power) {
    const double size = std::pow(10.0, power);
    std::vector<Triangle3> mesh = turned_box({1, 0.5, 0.3});
    for (auto& t : mesh)
      for (auto& p : t) p *= size;
    const Placed room = placed(mesh, power % 2 ? glm::dvec3(0) : glm::dvec3(1000 * size, 500 * size, 0));
    Batch batch;
    batch.triangles = occluder_triangles(room.scene, room.frame, room.planes);
    const auto on = [&](std::size_t face) {
      // Both triangles of a face share the diagonal from corner 0.
      const std::size_t half = 2 * face + random() % 2;
      const Polygon& t = room.scene.polygons[half];
      double u = unit(random), v = unit(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const glm::dvec3 p = t.corner[0] + (t.corner[1] - t.corner[0]) * u + (t.corner[2] - t.corner[0]) * v;
      return Point{room.frame.to_frame(p), t.normal(), room.planes[half]};
    };
    for (int i = 0; i < 1000; ++i) {
      const std::size_t a = random() % 6, b = (a + 1 + random() % 5) % 6;
      batch.from.push_back(on(a));
      batch.to.push_back(on(b));
    }
    for (const std::size_t w : {0, 3, 4}) {
      const auto masks = blocked(w, batch, false);
      verdict.count(masks.size(), masks.size() - open_ones(masks), fmt::format("size 1e{}", power));
    }
  }
}

// Also from a wall's very edges and corners nothing gets out: into the room and through another wall.
TEST(HardLeaks, NothingGetsOutFromPointsOnTheWalls) {
  HardCase verdict("Segments from points on walls, their edges and corners, through the room to the outside",
                   "The wall is ignored for starting on it, and its neighbour missed at the edge they share");
  std::mt19937_64 random(4);
  for (const glm::dvec3& at : {glm::dvec3(0), glm::dvec3(-1e6, 1e6, 1e6)}) {
    const Placed room = placed(turned_box({1, 0.5, 0.3}), at);
    Batch batch;
    batch.triangles = occluder_triangles(room.scene, room.frame, room.planes);
    for (int i = 0; i < 20000; ++i) {
      const std::size_t t = random() % 12;
      const Polygon& wall = room.scene.polygons[t];
      const std::size_t k = random() % 3;
      std::uniform_real_distribution<double> unit(0, 1);
      glm::dvec3 p = wall.corner[k];
      if (random() % 3) p += (wall.corner[(k + 1) % 3] - p) * unit(random);
      if (random() % 3 == 0) p += (wall.corner[(k + 2) % 3] - p) * unit(random);
      // Through a point of the middle to the outside: all corners are within 1.17 of it.
      const glm::dvec3 through = at + direction(random) * (0.25 * unit(random));
      batch.from.push_back({room.frame.to_frame(p), -wall.normal(), room.planes[t]});
      batch.to.push_back(
          {room.frame.to_frame(p + glm::normalize(through - p) * (3 + unit(random))), {0, 0, 1}});
    }
    for (const std::size_t w : {0, 3, 4}) {
      const auto masks = blocked(w, batch, false);
      verdict.count(masks.size(), open_ones(masks), witnesses()[w].name);
    }
  }
}

// ---- T-junctions

// A cube whose floor is three rectangles that meet in a T. On dyadic coordinates the pieces meet exactly, and nothing gets
// out. Turned, the T's corner is rounded off the long edge, by 1 grid step (0.5 sqrt 3 of snapping, and of the file's
// doubles): a slit of that width may let a segment through that is aimed at it, but none that passes 3 steps beside.
TEST(HardLeaks, TJunctions) {
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-tjunction");
  HardCase exact("A floor in three pieces that meet in a T, segments aimed at the seams",
                 "Cracks of a pixel's width along the T, and light on the wrong side"),
      turned(
          "The same floor turned by no simple angle, segments 3 grid steps (1e-11 of the scene) and more "
          "beside the seams",
          "As above"),
      slit("Aimed exactly at the turned seams", "As above");
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  const glm::dvec3 x = glm::normalize(glm::dvec3(3, 1, -2)), y = glm::normalize(glm::dvec3(1, 3, 3)),
                   z = glm::cross(x, y);
  for (const bool is_turned : {false, true}) {
    const auto place = [&](const glm::dvec3& p) { return is_turned ? x * p.x + y * p.y + z * p.z : p; };
    Scene scene;
    for (const auto& vertices : c["polygons"]) {
      Polygon p = oracle::polygon(vertices, 0, "");
      for (std::uint32_t k = 0; k < p.corners; ++k) p.corner[k] = place(p.corner[k]);
      scene.polygons.push_back(p);
    }
    const Frame frame = frame_of(scene);
    const auto planes = plane_ids(scene);
    Batch on_seam, beside;
    on_seam.triangles = beside.triangles = occluder_triangles(scene, frame, planes);
    for (int i = 0; i < 100000; ++i) {
      // The seams x = 0.375 and, right of it, y = 0.625; the T's corner every tenth time.
      glm::dvec3 through = random() % 2 ? glm::dvec3(0.375, unit(random), 0)
                                        : glm::dvec3(0.375 + 0.625 * unit(random), 0.625, 0);
      if (random() % 10 == 0) through = {0.375, 0.625, 0};
      const glm::dvec3 inside(0.1 + 0.8 * unit(random), 0.1 + 0.8 * unit(random), 0.1 + 0.8 * unit(random));
      for (const bool away : {false, true}) {
        const double side = random() % 2 ? 1 : -1;
        const glm::dvec3 p =
            through + (away ? glm::dvec3(side, side * (random() % 2 ? 1 : -1), 0) *
                                  (3 * 0x1p-38 * frame.metres() * std::pow(10.0, 6 * unit(random)))
                            : glm::dvec3(0));
        const glm::dvec3 outside = inside + (p - inside) * (1.1 + unit(random));
        // Outside by the floor alone: the walls go down to it.
        Batch& batch = away ? beside : on_seam;
        batch.from.push_back({frame.to_frame(place(inside)), {0, 0, 1}});
        batch.to.push_back({frame.to_frame(place(outside)), {0, 0, 1}});
      }
    }
    for (const std::size_t w : {0, 3, 4}) {
      const auto a = blocked(w, on_seam, false), b = blocked(w, beside, false);
      if (!is_turned) {
        exact.count(a.size(), open_ones(a), witnesses()[w].name);
        exact.count(b.size(), open_ones(b), witnesses()[w].name);
        continue;
      }
      turned.count(b.size(), open_ones(b), witnesses()[w].name);
      // What may get through there is what the slit's width allows, not a share of the floor: a thousandth of segments
      // that all hit a seam to within one rounding.
      slit.near(double(open_ones(a)) / double(a.size()), 0, 1e-3, witnesses()[w].name);
    }
  }
}

// ---- rays of the reference

TEST(HardLeaks, ReferenceRaysThroughCornersEdgesAndAlongPlanes) {
  HardCase verdict("Segments through vertices, edges, face diagonals, along axes and grid planes",
                   "Axis-parallel rays divide by zero; a ray in a voxel's face visits neither or both");
  std::size_t found = 0;
  const auto data = oracle::reference("d_hard_cases.json");
  for (const auto& c : data["cases"]) {
    if (c["kind"] != "segment_visibility") continue;
    ++found;
    const double scale = 1.0 / 8;  // brings 16.5 into the frame; changes no digit
    Batch batch;
    for (const auto& t : c["triangles"])
      batch.triangles.push_back(
          {{oracle::vec(t[0]) * scale, oracle::vec(t[1]) * scale, oracle::vec(t[2]) * scale},
           0xffffffffu,
           0});
    for (const auto& s : c["segments"]) {
      batch.from.push_back({oracle::vec(s["from"]) * scale, {0, 0, 1}});
      batch.to.push_back({oracle::vec(s["to"]) * scale, {0, 0, 1}});
    }
    for (std::size_t w = 0; w < witnesses().size(); ++w)
      for (const bool backwards : {false, true}) {
        const auto answer = blocked(w, batch, backwards);
        for (std::size_t i = 0; i < answer.size(); ++i)
          verdict.right((answer[i] != 0) == c["segments"][i]["blocked"].get<bool>(),
                        fmt::format("{} segment {}, {}", c["id"].get<std::string>(), i, witnesses()[w].name));
      }
  }
  EXPECT_EQ(found, 2u);
}

}  // namespace
}  // namespace clrad
