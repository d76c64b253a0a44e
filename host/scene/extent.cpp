#include "scene/extent.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace clrad {

double extent_m(const Scene& scene) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  const glm::dvec3 size = high - low;
  return std::max({size.x, size.y, size.z});
}

}  // namespace clrad
