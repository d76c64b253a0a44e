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
  glm::dvec3 low{INFINITY}, high{-INFINITY}, normal{0};
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

Layers overlapping_layers(std::span<const OccluderTriangle> triangles, std::size_t polygons) {
  std::vector<Flat> flats(polygons);
  std::vector<bool> present(polygons, false);
  for (const auto& t : triangles) {
    Flat& flat = flats[t.polygon];
    present[t.polygon] = true;
    flat.polygon = t.polygon, flat.plane = t.plane;
    for (const auto& c : t.corner) flat.low = glm::min(flat.low, c), flat.high = glm::max(flat.high, c);
    flat.normal += glm::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
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

  struct Overlapping {
    std::vector<std::uint32_t> same, turned;
  };
  std::vector<Overlapping> overlapping(polygons);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      if (order[j].plane != order[i].plane || key(order[j].low) > key(order[i].high)) break;
      if (!boxes_overlap(order[i], order[j])) continue;
      const auto kind =
          glm::dot(order[i].normal, order[j].normal) > 0 ? &Overlapping::same : &Overlapping::turned;
      (overlapping[order[i].polygon].*kind).push_back(order[j].polygon);
      (overlapping[order[j].polygon].*kind).push_back(order[i].polygon);
    }

  Layers layers;
  layers.start.push_back(0);
  for (auto& of : overlapping)
    for (std::vector<std::uint32_t>* list : {&of.same, &of.turned}) {
      std::sort(list->begin(), list->end());
      layers.polygon.insert(layers.polygon.end(), list->begin(), list->end());
      layers.start.push_back(std::uint32_t(layers.polygon.size()));
    }
  return layers;
}

}  // namespace clrad
