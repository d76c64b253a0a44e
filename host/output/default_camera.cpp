#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/output.hpp"

namespace clrad {
namespace {

struct Box {
  glm::dvec3 low{INFINITY}, high{-INFINITY};
  glm::dvec3 centre() const { return 0.5 * (low + high); }
  glm::dvec3 size() const { return high - low; }
};

Box bounds(const Scene& scene) {
  Box box;
  for (const auto& polygon : scene.polygons)
    for (std::uint32_t k = 0; k < polygon.corners; ++k)
      box.low = glm::min(box.low, polygon.corner[k]), box.high = glm::max(box.high, polygon.corner[k]);
  return box;
}

// OBJ does not say which way is up, but lamps do: they shine down. What shines along z into a room that is longer that way than it is
// high along y is a window. Light from the side, or from everywhere, tells nothing, and up is y, which glTF prescribes.
bool z_is_up(const Scene& scene, const Box& box) {
  if (scene.file.ends_with(".gltf") || scene.file.ends_with(".glb") || box.size().z > box.size().y)
    return false;
  glm::dvec3 sum(0);
  double all = 0;
  for (const auto& polygon : scene.polygons) {
    double exitance = 0;
    for (const double e : scene.materials[polygon.material].emitted_exitance) exitance += e;
    const double power = exitance * polygon.area_m2();
    sum += power * polygon.normal(), all += power;
  }
  constexpr double mostly = 0.7;
  return all > 0 && -sum.z > mostly * all;
}

// A direction that is given for y up.
glm::dvec3 turned(const glm::dvec3& v, bool z_up) {
  return z_up ? glm::dvec3(v.x, -v.z, v.y) : v;
}

// One side of the box to look in through.
struct Side {
  glm::dvec3 direction;  // of the view
  glm::dvec3 up;
};
std::array<Side, 5> sides_of(bool z_up) {
  std::array<Side, 5> sides{{{{0, 0, -1}, {0, 1, 0}},
                             {{0, 0, 1}, {0, 1, 0}},
                             {{-1, 0, 0}, {0, 1, 0}},
                             {{1, 0, 0}, {0, 1, 0}},
                             {{0, -1, 0}, {0, 0, -1}}}};
  for (Side& side : sides) side = {turned(side.direction, z_up), turned(side.up, z_up)};
  return sides;
}

struct SideView {
  double closed = 0;  // share of the side covered by polygons that lie near it and turn their backs
  double shown = 0;   // area of fronts projected on the side [m^2]
};

SideView look(const Scene& scene, const Box& box, const Side& side) {
  int axis = 0;
  for (int c = 1; c < 3; ++c)
    if (side.direction[c] != 0) axis = c;
  const glm::dvec3 size = box.size();
  const double side_area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
  const double near = side.direction[axis] < 0 ? box.high[axis] : box.low[axis];
  SideView view;
  for (const auto& polygon : scene.polygons) {
    const double projected = -glm::dot(polygon.normal(), side.direction) * polygon.area_m2();
    double farthest = 0;
    for (std::uint32_t k = 0; k < polygon.corners; ++k)
      farthest = std::max(farthest, std::abs(polygon.corner[k][axis] - near));
    if (projected > 0)
      view.shown += projected;
    else if (farthest <= 0.1 * size[axis] && side_area > 0)
      view.closed -= projected / side_area;
  }
  return view;
}

// Where the segment from + t (to - from), 0 < t < 1, first meets a polygon; 1 when it meets none.
double free_part(const Scene& scene, const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 d = to - from;
  double nearest = 1;
  for (const auto& polygon : scene.polygons) {
    const glm::dvec3 n = polygon.normal();
    const double along = glm::dot(d, n);
    if (along == 0) continue;
    const double t = glm::dot(polygon.corner[0] - from, n) / along;
    if (!(t > 0 && t < nearest)) continue;
    const glm::dvec3 p = from + t * d;
    bool inside = true;
    for (std::uint32_t k = 0; k < polygon.corners && inside; ++k) {
      const glm::dvec3 &a = polygon.corner[k], &b = polygon.corner[(k + 1) % polygon.corners];
      inside = glm::dot(glm::cross(b - a, p - a), n) >= 0;
    }
    if (inside) nearest = t;
  }
  return nearest;
}

Camera from_outside(const Box& box, const Side& side) {
  Camera camera;
  camera.name = "default, from outside";
  camera.up = side.up;
  const glm::dvec3 size = box.size(), right = glm::cross(side.direction, side.up);
  const double depth = std::abs(glm::dot(size, side.direction));
  const double half = 0.5 * std::max(std::abs(glm::dot(size, right)), std::abs(glm::dot(size, side.up)));
  constexpr double margin = 1.02;
  const double distance = 0.5 * depth + margin * half / std::tan(camera.vertical_field_of_view_rad / 2);
  camera.target = box.centre();
  camera.eye = camera.target - distance * side.direction;
  return camera;
}

Camera from_inside(const Scene& scene, const Box& box, bool z_up) {
  Camera camera;
  camera.name = "default, from inside";
  camera.vertical_field_of_view_rad = 1.3;
  camera.up = turned({0, 1, 0}, z_up);
  const glm::dvec3 half = 0.5 * box.size(), centre = box.centre();
  double best = -1;
  for (const auto& [x, z] : {std::pair{1, 1}, {-1, 1}, {1, -1}, {-1, -1}}) {
    const glm::dvec3 eye = centre + turned({0.9 * x, 0.3, 0.9 * z}, z_up) * half;
    const glm::dvec3 target = centre - turned({0, 0.1, 0}, z_up) * half;
    const double part = free_part(scene, eye, target);
    if (part > best) best = part, camera.eye = eye, camera.target = target;
  }
  return camera;
}

}  // namespace

Camera default_camera(const Scene& scene) {
  const Box box = bounds(scene);
  const bool z_up = z_is_up(scene, box);
  const std::array<Side, 5> sides = sides_of(z_up);
  constexpr double open = 0.5;
  const SideView top = look(scene, box, sides[4]);
  const Side* best = nullptr;
  double most = 0;
  for (std::size_t s = 0; s < 4; ++s) {
    const SideView view = look(scene, box, sides[s]);
    // 1e-9: sides that show the same up to rounding are taken in their order.
    if (view.closed < open && view.shown > most * (1 + 1e-9)) best = &sides[s], most = view.shown;
  }
  if (top.closed < open && most < 0.25 * top.shown) best = &sides[4];
  if (best) return from_outside(box, *best);
  if (glm::length(box.size()) > 0) return from_inside(scene, box, z_up);
  return Camera{};
}

}  // namespace clrad
