#include "scene/backs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <map>

#include "scene/topology.hpp"

namespace clrad {
namespace {

// Corners may stand out of a face's plane by the rounding of coordinates, times this.
constexpr double plane_roundings = 16;

bool is_two_sided(const Material& material) {
  return material.two_sided && !material.is_glass();
}

struct Box {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  void add(const Polygon& p) {
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  }
  bool overlaps(const Box& other) const {  // more than touch
    return glm::all(glm::lessThan(low, other.high)) && glm::all(glm::lessThan(other.low, high));
  }
  bool contains(const glm::dvec3& p) const {
    return glm::all(glm::lessThan(low, p)) && glm::all(glm::lessThan(p, high));
  }
};

// How far `p` is in front of a polygon's plane, within rounding 0.
double height_over(const Polygon& polygon, const glm::dvec3& normal, const glm::dvec3& p) {
  const glm::dvec3& from = polygon.corner[0];
  const glm::dvec3 size = glm::max(glm::abs(p), glm::abs(from));
  const double height = glm::dot(normal, p - from);
  const double rounding = plane_roundings * 0x1p-53 * std::max({size.x, size.y, size.z});
  return std::abs(height) <= rounding ? 0 : height;
}

// A closed surface and where it is.
struct Solid {
  std::vector<std::uint32_t> face;
  std::vector<glm::dvec3> normal;  // of each face
  Box box;
};

bool is_convex_solid(const Scene& scene, const Solid& solid) {
  // Faces x corners: past this, a back more costs less than to find out.
  constexpr std::size_t most_faces = 1024;
  if (solid.face.size() > most_faces) return false;
  for (std::size_t f = 0; f < solid.face.size(); ++f)
    for (const std::uint32_t other : solid.face)
      for (std::uint32_t k = 0; k < scene.polygons[other].corners; ++k)
        if (height_over(scene.polygons[solid.face[f]], solid.normal[f], scene.polygons[other].corner[k]) > 0)
          return false;
  return true;
}

// No face of the convex solid has all of the polygon on its outer side.
bool reaches_into(const Scene& scene, const Solid& solid, const Polygon& polygon) {
  for (std::size_t f = 0; f < solid.face.size(); ++f) {
    bool outside = true;
    for (std::uint32_t k = 0; k < polygon.corners && outside; ++k)
      outside = height_over(scene.polygons[solid.face[f]], solid.normal[f], polygon.corner[k]) >= 0;
    if (outside) return false;
  }
  return true;
}

// Closed convex surfaces with a two-sided face, without glass or light of their own.
std::vector<Solid> dark_solids(const Scene& scene, const std::vector<std::uint32_t>& surface) {
  std::map<std::uint32_t, Solid> by_first;
  for (std::uint32_t p = 0; p < surface.size(); ++p)
    if (surface[p] != 0xffffffffu) by_first[surface[p]].face.push_back(p);
  std::vector<Solid> solids;
  for (auto& [first, solid] : by_first) {
    bool any = false, dark = true;
    for (const std::uint32_t p : solid.face) {
      const Material& m = scene.materials[scene.polygons[p].material];
      any |= is_two_sided(m);
      dark &= !m.is_glass() && std::none_of(m.emitted_exitance.begin(), m.emitted_exitance.end(),
                                            [](double e) { return e > 0; });
    }
    if (!any || !dark) continue;
    for (const std::uint32_t p : solid.face) {
      solid.normal.push_back(scene.polygons[p].normal());
      solid.box.add(scene.polygons[p]);
    }
    const bool eye_inside = std::any_of(scene.cameras.begin(), scene.cameras.end(),
                                        [&box = solid.box](const Camera& c) { return box.contains(c.eye); });
    const bool light_inside =
        std::any_of(scene.lights.begin(), scene.lights.end(), [&box = solid.box](const PunctualLight& l) {
          return l.kind != PunctualLight::Kind::directional && box.contains(l.position_m);
        });
    if (!eye_inside && !light_inside && is_convex_solid(scene, solid)) solids.push_back(std::move(solid));
  }
  return solids;
}

// Per polygon, whether its back would face the inside of a solid that is dark.
std::vector<bool> faces_with_dark_backs(const Scene& scene) {
  std::vector<bool> dark(scene.polygons.size(), false);
  const std::vector<std::uint32_t> surface = closed_surfaces(scene);
  std::vector<Solid> solids = dark_solids(scene, surface);
  if (solids.empty()) return dark;
  // A sweep along x: polygons by where they begin, and the solids that are open there.
  std::vector<Box> box(scene.polygons.size());
  std::vector<std::uint32_t> order(scene.polygons.size());
  for (std::uint32_t p = 0; p < order.size(); ++p) box[p].add(scene.polygons[p]), order[p] = p;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return box[a].low.x < box[b].low.x; });
  std::stable_sort(solids.begin(), solids.end(),
                   [](const Solid& a, const Solid& b) { return a.box.low.x < b.box.low.x; });
  std::vector<bool> entered(solids.size(), false);
  std::vector<std::uint32_t> open_polygons, open_solids;
  const auto meet = [&](std::uint32_t s, std::uint32_t p) {
    if (entered[s] || surface[p] == surface[solids[s].face[0]] || !box[p].overlaps(solids[s].box)) return;
    entered[s] = reaches_into(scene, solids[s], scene.polygons[p]);
  };
  for (std::size_t i = 0, j = 0; i < order.size() || j < solids.size();) {
    if (j == solids.size() || (i < order.size() && box[order[i]].low.x <= solids[j].box.low.x)) {
      const std::uint32_t p = order[i++];
      std::erase_if(open_solids, [&](std::uint32_t s) { return solids[s].box.high.x <= box[p].low.x; });
      for (const std::uint32_t s : open_solids) meet(s, p);
      open_polygons.push_back(p);
    } else {
      const auto s = std::uint32_t(j++);
      std::erase_if(open_polygons, [&](std::uint32_t p) { return box[p].high.x <= solids[s].box.low.x; });
      for (const std::uint32_t p : open_polygons) meet(s, p);
      open_solids.push_back(s);
    }
  }
  for (std::size_t s = 0; s < solids.size(); ++s)
    if (!entered[s])
      for (const std::uint32_t p : solids[s].face) dark[p] = true;
  return dark;
}

Polygon back_of(const Polygon& front) {
  Polygon back = front;
  std::reverse(back.corner.begin() + 1, back.corner.begin() + front.corners);
  back.name += " (back)";
  back.back = true;
  return back;
}

}  // namespace

TwoSided find_two_sided(const Scene& scene) {
  TwoSided result;
  if (std::none_of(scene.materials.begin(), scene.materials.end(), is_two_sided)) return result;
  std::vector<bool> dark;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    if (polygon.back || !is_two_sided(scene.materials[polygon.material])) continue;
    if (has_back(scene, p)) {
      result.backs.push_back(p);
      continue;
    }
    if (dark.empty()) dark = faces_with_dark_backs(scene);
    if (dark[p])
      ++result.dark;
    else
      result.backs.push_back(p);
  }
  return result;
}

void check_two_sided(const Scene& scene, std::vector<Diagnostic>& findings) {
  const TwoSided found = find_two_sided(scene);
  if (found.backs.empty()) return;
  const SourceLocation& where = scene.materials[scene.polygons[found.backs.front()].material].where;
  findings.push_back(
      {Diagnostic::Severity::warning, "two-sided", where,
       fmt::format("{} of {} polygons have two sides, those of this material among them: both sides reflect "
                   "and emit, which takes their patches twice; where fronts are enough, --one-sided has "
                   "these alone",
                   found.backs.size(), scene.polygons.size())});
}

Scene with_backs(Scene scene) {
  const TwoSided two_sided = find_two_sided(scene);
  if (two_sided.backs.empty()) return scene;
  std::vector<Polygon> polygons;
  polygons.reserve(scene.polygons.size() + two_sided.backs.size());
  auto next = two_sided.backs.begin();
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    polygons.push_back(std::move(scene.polygons[p]));
    if (next == two_sided.backs.end() || *next != p) continue;
    ++next;
    const bool there = p + 1 < scene.polygons.size() && scene.polygons[p + 1].back;
    if (!there) polygons.push_back(back_of(polygons.back()));
  }
  scene.polygons = std::move(polygons);
  return scene;
}

}  // namespace clrad
