// The answer is a function of the scene and the options, and of nothing else: not of how the work is divided, nor of how the
// scene is numbered, placed, scaled or turned. Properties on rooms that RapidCheck makes; all coordinates are sixteenths,
// so that turns by 90 degrees, scaling by powers of two and dyadic translations are exact.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <glm/geometric.hpp>
#include <numeric>
#include <sstream>

#include "clrad/clrad.hpp"
#include "device/divided.hpp"
#include "hard/table.hpp"
#include "oracle/reference.hpp"
#include "visibility/chop.hpp"

namespace clrad {
namespace {

using test::HardCase;

int pick(int low, int below) {
  return *rc::gen::inRange(low, below);
}

// rc::check with fewer rounds than its hundred, for properties that solve; ten times as many in the long run.
template <class Property>
void holds_for_any(const char* what, int rounds, const Property& property) {
  rc::detail::TestMetadata metadata;
  metadata.id = metadata.description = what;
  auto params = rc::detail::configuration().testParams;
  params.maxSuccess = test::long_tests() ? 10 * rounds : rounds;
  std::printf("%s: seed %llu\n", what, static_cast<unsigned long long>(params.seed));
  const auto result = rc::detail::checkTestable(property, metadata, params);
  std::ostringstream message;
  rc::detail::printResultMessage(result, message);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << message.str();
}

struct Room {
  Scene scene;
  SolveOptions options;
  double rho_most = 0, smallest_patch = 0;  // [m2], at least
};

// A box room, mostly with a box standing or floating in it; every polygon has its own grey material.
Room any_room() {
  Room room;
  const glm::dvec3 size(pick(8, 33) / 16.0, pick(8, 33) / 16.0, pick(8, 33) / 16.0);
  room.scene = oracle::box_scene(size, {0.5}, {0});
  if (pick(0, 4) > 0) {
    glm::dvec3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const int steps = int(size[axis] * 16);
      const int from = pick(axis == 2 ? 0 : 1, steps - 3);
      low[axis] = from / 16.0, high[axis] = pick(from + 1, steps - 1) / 16.0;
    }
    Scene block = oracle::box_scene(high - low, {0.5}, {0});
    for (std::size_t p = 0; p < 6; ++p) {
      if (p == 4 && low.z == 0) continue;  // it stands on the floor
      Polygon face = block.polygons[p];
      for (auto& c : face.corner) c += low;
      std::reverse(face.corner.begin(), face.corner.end());  // outward
      room.scene.polygons.push_back(face);
    }
  }
  room.scene.materials.clear();
  for (std::size_t p = 0; p < room.scene.polygons.size(); ++p) {
    const double rho = pick(0, 13) / 16.0;
    room.rho_most = std::max(room.rho_most, rho);
    room.scene.materials.push_back({"m", {rho}, {p == 5 ? 4.0 : pick(0, 4) == 0 ? 1.0 : 0.0}, {}});
    room.scene.polygons[p].material = std::uint32_t(p);
  }
  room.options.mesh = {pick(8, 17) / 16.0, pick(3, 8) / 16.0};
  room.options.samples = std::uint32_t(pick(1, 9));
  room.options.light_samples = 16;
  room.options.converge = 1e-4;
  room.options.seed = std::uint64_t(pick(0, 1000));
  room.options.sensors = {{size * 0.5, glm::normalize(glm::dvec3(1, 2, 3))}, {{0.25, 0.25, 0}, {0, 0, 1}}};
  room.options.sensor_rays = 256;
  return room;
}

// All numbers of a solution, as bits.
std::vector<double> numbers(const Solution& s) {
  std::vector<double> all = s.vertex_irradiance;
  all.insert(all.end(), s.patch_irradiance.begin(), s.patch_irradiance.end());
  for (const auto& sensor : s.sensors) {
    all.insert(all.end(), sensor.irradiance.begin(), sensor.irradiance.end());
    all.insert(all.end(), sensor.irradiance_error.begin(), sensor.irradiance_error.end());
  }
  return all;
}

Device& device_with(std::size_t way) {
  static const std::vector<DeviceOptions> ways{{},
                                               {.cores = test::one_core()},
                                               {.work_group_size = 16},
                                               {.packet_width = 4},
                                               {.shape = Shape::trees},
                                               {.memory_bytes = 96u << 20}};
  static std::map<std::size_t, std::unique_ptr<Device>> made;
  auto& device = made[way];
  if (!device) device = std::make_unique<Device>(ways[way]);
  return *device;
}

TEST(HardDeterminism, SameBitsHoweverTheWorkIsDivided) {
  HardCase verdict(
      "Random rooms: cores, work-groups, packets, tree sums, memory, batches, grids, engines: the bits",
      "Float atomics and sums in the order of the threads: no run is like the next");
  holds_for_any("how work is divided", 20, [&] {
    Room room = any_room();
    room.options.engine = "serial";
    const auto first = numbers(solve(device_with(0), room.scene, room.options));
    const auto way = std::size_t(pick(0, 6));
    const auto engine = pick(0, 3);
    if (engine == 2) room.options.engine = "shaft";
    if (engine == 1) {
      room.options.engine = "chop";
      room.options.rays_per_batch = std::uint32_t(pick(0, 4) * 700);
      if (pick(0, 2) == 1)
        for (auto& cells : room.options.grid) cells = std::uint32_t(pick(1, 9));
    }
    const bool same = numbers(solve(device_with(way), room.scene, room.options)) == first;
    verdict.right(same, fmt::format("device {}, {}", way, room.options.engine));
    RC_ASSERT(same);
  });
}

TEST(HardDeterminism, SameBitsScaledByPowersOfTwoAndMoved) {
  HardCase verdict("Random rooms scaled by 2^-20 to 2^20 and moved by up to a million metres: the bits",
                   "Epsilons in metres; single-precision coordinates far from the origin");
  holds_for_any("scale and place", 15, [&] {
    const Room room = any_room();
    const auto first = numbers(solve(device_with(0), room.scene, room.options));
    const double scale = std::ldexp(1.0, pick(-20, 21));
    glm::dvec3 move;
    for (int axis = 0; axis < 3; ++axis) move[axis] = scale * pick(-1000000, 1000001);
    Room other = room;
    for (Polygon& p : other.scene.polygons)
      for (auto& c : p.corner) c = c * scale + move;
    for (Sensor& s : other.options.sensors) s.position_m = s.position_m * scale + move;
    other.options.mesh.patch_edge_m *= scale;
    other.options.mesh.element_edge_m *= scale;
    const bool same = numbers(solve(device_with(0), other.scene, other.options)) == first;
    verdict.right(same, fmt::format("scale {}", scale));
    RC_ASSERT(same);
  });
}

// How far two solves of the same system may be apart at a vertex, in irradiance. Factors from the same corners in another
// order of axes or of sums are both within 1e-5 of the truth; with B up to that of a furnace of the brightest emission and the
// largest rho, and once more per bounce: 2e-5 B_max / (1 - rho). Light that is unshot at the end, at most converge x emitted
// power, may in both be all on the smallest patch and reach the vertex undiminished: 2 converge P / A_min / (1 - rho).
double apart(const Room& room, const Solution& s) {
  double brightest = 0, power = 0, smallest = 1e300;
  for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
    const double e =
        s.scene.materials[s.scene.polygons[s.mesh.patches[p].polygon].material].emitted_exitance[0];
    brightest = std::max(brightest, e), power += e * s.mesh.patches[p].area_m2;
    smallest = std::min(smallest, s.mesh.patches[p].area_m2);
  }
  const double rounds = 1 / (1 - room.rho_most);
  return 2e-5 * brightest * rounds * rounds + 2 * room.options.converge * power / smallest * rounds;
}

// Samples are placed by a patch's number, so a room with something in it would be sampled elsewhere: these are empty.
TEST(HardDeterminism, RelabelledPolygonsWithinRounding) {
  HardCase verdict("Random empty rooms with their polygons in another order: irradiance at every vertex",
                   "Results that depend on the order of a file");
  holds_for_any("relabelling", 12, [&] {
    Room room = any_room();
    room.scene.polygons.resize(6);
    room.options.converge = 1e-6;
    std::vector<std::uint32_t> order(6);
    std::iota(order.begin(), order.end(), 0u);
    for (std::uint32_t k = 5; k > 0; --k) std::swap(order[k], order[std::size_t(pick(0, int(k) + 1))]);
    Scene relabelled = room.scene;
    for (std::size_t k = 0; k < 6; ++k) relabelled.polygons[k] = room.scene.polygons[order[k]];
    const Solution a = solve(device_with(0), room.scene, room.options),
                   b = solve(device_with(0), relabelled, room.options);
    const double allowed = apart(room, a);
    double worst = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      const PolygonMesh &here = b.mesh.polygons[k], &there = a.mesh.polygons[order[k]];
      RC_ASSERT(here.vertices == there.vertices);
      for (std::uint32_t v = 0; v < here.vertices; ++v)
        worst = std::max(worst, std::abs(b.vertex_irradiance[here.first_vertex + v] -
                                         a.vertex_irradiance[there.first_vertex + v]));
    }
    verdict.near(worst, 0, allowed, "a room");
    RC_ASSERT(worst <= allowed);
  });
}

// One of the 24 turns of a cube.
struct Turn {
  int axis[3];
  double sign[3];
  glm::dvec3 operator()(const glm::dvec3& p) const {
    return {sign[0] * p[axis[0]], sign[1] * p[axis[1]], sign[2] * p[axis[2]]};
  }
};
Turn any_turn() {
  Turn turn{{0, 1, 2}, {1, 1, 1}};
  for (int k = pick(0, 6); k > 0; --k) {  // quarter turns about z and x make them all
    const bool z = pick(0, 2) == 1;
    const int a = z ? 0 : 1, b = z ? 1 : 2;
    std::swap(turn.axis[a], turn.axis[b]);
    std::swap(turn.sign[a], turn.sign[b]);
    turn.sign[a] = -turn.sign[a];
  }
  return turn;
}

// Also with a block: samples turn with their patch, and what is visible is exact, so the same.
TEST(HardDeterminism, TurnedBy90DegreesWithinRounding) {
  HardCase verdict("Random rooms, also with a block, turned by right angles: irradiance at every vertex",
                   "Axis x is not as exact as axis z: shadows move when a model is turned");
  holds_for_any("right angles", 12, [&] {
    Room room = any_room();
    room.options.converge = 1e-6;
    const Turn turn = any_turn();
    Room turned = room;
    for (Polygon& p : turned.scene.polygons)
      for (auto& c : p.corner) c = turn(c);
    turned.options.sensors.clear(), room.options.sensors.clear();
    const Solution a = solve(device_with(0), room.scene, room.options),
                   b = solve(device_with(0), turned.scene, turned.options);
    RC_ASSERT(a.vertex_irradiance.size() == b.vertex_irradiance.size());
    RC_ASSERT(a.vertex_covered == b.vertex_covered);
    const double allowed = apart(room, a);
    double worst = 0;
    for (std::size_t v = 0; v < a.vertex_irradiance.size(); ++v)
      worst = std::max(worst, std::abs(a.vertex_irradiance[v] - b.vertex_irradiance[v]));
    verdict.near(worst, 0, allowed, "a room");
    RC_ASSERT(worst <= allowed);
  });
}

// Blocked or not is exact, so there nothing at all changes: triangles in another order, everything turned, in parts.
TEST(HardDeterminism, VisibilityOfRelabelledTurnedAndSplitSegments) {
  HardCase verdict(
      "Random triangles and segments on a lattice: relabelled, turned, split in batches: the bits",
      "The first triangle of a list wins ties; a tie is a hit or a miss by its place");
  holds_for_any("visibility", 40, [&] {
    const Turn turn = any_turn();
    const auto place = [&] { return glm::dvec3(pick(-8, 9) / 16.0, pick(-8, 9) / 16.0, pick(-8, 9) / 16.0); };
    std::vector<OccluderTriangle> triangles, others;
    for (std::uint32_t k = 0; k < 12; ++k) triangles.push_back({{place(), place(), place()}, k / 2, k});
    std::vector<Point> from, to, turned_from, turned_to;
    for (int k = 0; k < 60; ++k) {
      const auto plane = [&] { return pick(0, 3) ? 0xffffffffu : std::uint32_t(pick(0, 6)); };
      from.push_back({place(), {0, 0, 1}, plane()});
      to.push_back({place(), {0, 0, 1}, plane()});
      turned_from.push_back({turn(from.back().position), {0, 0, 1}, from.back().plane});
      turned_to.push_back({turn(to.back().position), {0, 0, 1}, to.back().plane});
    }
    others = triangles;
    for (std::size_t k = others.size() - 1; k > 0; --k)
      std::swap(others[k], others[std::size_t(pick(0, int(k) + 1))]);
    for (auto& t : others)
      for (auto& c : t.corner) c = turn(c);
    Device& device = device_with(0);
    const auto ask = [&](VisibilityEngine& engine, const std::vector<Point>& a, const std::vector<Point>& b) {
      const PointArray origins(device, a, "origins"), targets(device, b, "targets");
      Array<std::uint32_t> masks(device, a.size(), "masks");
      engine.occluded({&origins, nullptr, std::uint32_t(a.size()), &targets, 0}, masks);
      return masks.download();
    };
    const auto first = ask(*make_engine("serial", device, triangles), from, to);
    const auto chop = make_chop(device, others, {.rays_per_batch = 64, .cells = {3, 2, 4}});
    bool same = ask(*make_engine("serial", device, others), turned_from, turned_to) == first;
    same = same && ask(*chop, turned_from, turned_to) == first;
    // In two parts.
    const auto cut = std::ptrdiff_t(pick(1, 60));
    auto parts = ask(*chop, {turned_from.begin(), turned_from.begin() + cut},
                     {turned_to.begin(), turned_to.begin() + cut});
    const auto rest = ask(*chop, {turned_from.begin() + cut, turned_from.end()},
                          {turned_to.begin() + cut, turned_to.end()});
    parts.insert(parts.end(), rest.begin(), rest.end());
    same = same && parts == first;
    verdict.right(same, "a setting");
    RC_ASSERT(same);
  });
}

}  // namespace
}  // namespace clrad
