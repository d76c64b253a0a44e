// A scene whose polygons all face one convex room from its walls has nothing that could stand between two of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <optional>
#include <span>

#include "clrad/frame.hpp"
#include "effects/effects.hpp"

namespace clrad {
namespace {

// Corners may be this far behind a plane [frame]: what scene/planes.hpp takes for being in it.
constexpr double in_plane = 0x1p-36;
// Tests of a corner against a plane, at most: some tenths of a second.
constexpr double most_tests = 3e7;

struct Side {
  glm::dvec3 normal, point;  // frame
  std::uint32_t polygon;
  bool behind(const glm::dvec3& p) const { return glm::dot(p - point, normal) < -in_plane; }
};

// The planes of the polygons, those of neighbours in the file once: a wall that is cut up comes in runs.
std::vector<Side> sides_of(const Scene& scene, const Frame& frame) {
  constexpr std::size_t neighbours = 8;
  std::vector<Side> sides;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    const Side side{polygon.normal(), frame.to_frame(polygon.corner[0]), p};
    const auto holds = [&](const Side& other) {
      if (!(glm::dot(other.normal, side.normal) > 0)) return false;
      for (std::uint32_t k = 0; k < polygon.corners; ++k)
        if (!(std::abs(glm::dot(frame.to_frame(polygon.corner[k]) - other.point, other.normal)) <= in_plane))
          return false;
      return true;
    };
    const auto first = sides.end() - std::ptrdiff_t(std::min(sides.size(), neighbours));
    if (std::none_of(first, sides.end(), holds)) sides.push_back(side);
  }
  return sides;
}

// Corners of all polygons, then sensors, then lights [frame].
std::vector<glm::dvec3> points_of(const Scene& scene, const SolveOptions& options, const Frame& frame) {
  std::vector<glm::dvec3> points;
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k) points.push_back(frame.to_frame(p.corner[k]));
  for (const Sensor& s : options.sensors) points.push_back(frame.to_frame(s.position_m));
  for (const PunctualLight& l : scene.lights)
    if (l.kind != PunctualLight::Kind::directional) points.push_back(frame.to_frame(l.position_m));
  return points;
}

struct Obstacle {
  std::uint32_t polygon;
  std::size_t point;
};

// The first of the sides that has a point behind it. Each takes a pass over the points, of which at most `most` tests are done;
// `done` is false where that was not enough.
std::optional<Obstacle> find_obstacle(std::span<const Side> sides, const std::vector<glm::dvec3>& points,
                                      double most, bool& done) {
  std::size_t suspect = 0;  // what is behind one plane is often behind many: it is asked first
  double tests = 0;
  done = true;
  for (const Side& side : sides) {
    if (side.behind(points[suspect])) return Obstacle{side.polygon, suspect};
    for (std::size_t i = 0; i < points.size(); ++i)
      if (side.behind(points[i])) return Obstacle{side.polygon, i};
    tests += double(points.size());
    done = tests <= most || &side == &sides.back();
    if (!done) break;
  }
  return {};
}

// Why it cannot be proven that nothing stands between; empty where it is proven.
std::string obstacle(const Scene& scene, const SolveOptions& options) {
  const Frame frame = frame_of(scene);
  const std::vector<glm::dvec3> points = points_of(scene, options, frame);
  // Light that comes in through a wall's back.
  for (const PunctualLight& l : scene.lights)
    for (const Polygon& p : scene.polygons)
      if (l.kind == PunctualLight::Kind::directional && glm::dot(l.direction, p.normal()) > 0)
        return fmt::format("the polygon at {} turns its back to a directional light: it may throw a shadow",
                           p.where.text());
  bool done = false;
  const auto found = find_obstacle(sides_of(scene, frame), points, most_tests, done);
  if (!found && !done)
    return "it has too many planes to prove that nothing stands between two of its surfaces";
  if (!found) return {};
  const std::string where = scene.polygons[found->polygon].where.text();
  const auto corners =
      std::size_t(std::accumulate(scene.polygons.begin(), scene.polygons.end(), 0u,
                                  [](std::uint32_t n, const Polygon& p) { return n + p.corners; }));
  if (found->point >= corners + options.sensors.size())
    return fmt::format("a light is behind the polygon at {}, which may hide it", where);
  if (found->point >= corners)
    return fmt::format("sensor {} is behind the polygon at {}, which may hide light from it",
                       found->point - corners + 1, where);
  return fmt::format("not all of the scene is in front of the polygon at {}: it may stand between two others",
                     where);
}

}  // namespace

Effect plan_occlusion(const Scene& scene, const SolveOptions& options) {
  Effect effect;
  effect.stages = {"build the grid",
                   "build the tree of occluders",
                   "move vertices off what they touch",
                   "find which rays are occluded",
                   "clip shooters to what is visible",
                   "clip rays to the grid",
                   "chop rays along x",
                   "chop rays along y",
                   "chop rays along z",
                   "allocate candidates",
                   "intersect rays with candidates",
                   "decide close candidates exactly",
                   "nearest hit of each ray",
                   "drop blocked rays",
                   "pack visibility masks",
                   "find vertices that something covers"};
  const std::string why = obstacle(scene, options);
  effect.needed = !why.empty();
  effect.reason = why.empty()
                      ? "every polygon has all others in front of it or in its plane, as in a convex room: "
                        "nothing can stand between two surfaces"
                      : why;
  if (!effect.needed) effect.skip_error_relative = 0;
  return effect;
}

}  // namespace clrad
