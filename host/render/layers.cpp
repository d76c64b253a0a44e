// Overlapping polygons of one plane: an engine may name any of them, the picture shows the one on top.
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/render.hpp"

namespace clrad {
namespace {

struct Flat {
  std::uint32_t polygon = 0, plane = 0;
  bool front = false;
  glm::dvec3 low{INFINITY}, high{-INFINITY};
};

// False for polygons that only touch: depth of a few grid cells on two axes is needed to overlap.
bool boxes_overlap(const Flat& a, const Flat& b) {
  constexpr double touch = 1e-9;
  int deep = 0;
  for (int c = 0; c < 3; ++c) {
    const double depth = std::min(a.high[c], b.high[c]) - std::max(a.low[c], b.low[c]);
    if (depth < -touch) return false;
    deep += depth > touch;
  }
  return deep >= 2;
}

}  // namespace

Layers visible_layers(std::span<const OccluderTriangle> triangles, std::size_t polygons,
                      const glm::dvec3& eye) {
  std::vector<Flat> flats(polygons);
  std::vector<bool> present(polygons, false);
  for (const auto& t : triangles) {
    Flat& flat = flats[t.polygon];
    present[t.polygon] = true;
    flat.polygon = t.polygon, flat.plane = t.plane;
    for (const auto& c : t.corner) flat.low = glm::min(flat.low, c), flat.high = glm::max(flat.high, c);
    // A convex polygon's triangles face the same way.
    const glm::dvec3 normal = glm::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
    flat.front = flat.front || glm::dot(normal, eye - t.corner[0]) > 0;
  }
  std::vector<Flat> order;
  for (std::size_t p = 0; p < polygons; ++p)
    if (present[p]) order.push_back(flats[p]);
  // Along the diagonal of the coordinates: one sweep per plane, whichever way it is tilted.
  const auto key = [](const glm::dvec3& v) { return v.x + v.y + v.z; };
  std::sort(order.begin(), order.end(), [&](const Flat& a, const Flat& b) {
    if (a.plane != b.plane) return a.plane < b.plane;
    if (key(a.low) != key(b.low)) return key(a.low) < key(b.low);
    return a.polygon < b.polygon;
  });

  std::vector<std::vector<std::uint32_t>> above(polygons);
  const auto add = [&](const Flat& under, const Flat& top) {
    if (top.front && (!under.front || top.polygon > under.polygon))
      above[under.polygon].push_back(top.polygon);
  };
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      if (order[j].plane != order[i].plane || key(order[j].low) > key(order[i].high)) break;
      if (!boxes_overlap(order[i], order[j])) continue;
      add(order[i], order[j]);
      add(order[j], order[i]);
    }

  Layers layers;
  layers.start.push_back(0);
  for (auto& list : above) {
    std::sort(list.begin(), list.end());
    layers.polygon.insert(layers.polygon.end(), list.begin(), list.end());
    layers.start.push_back(std::uint32_t(layers.polygon.size()));
  }
  return layers;
}

}  // namespace clrad
