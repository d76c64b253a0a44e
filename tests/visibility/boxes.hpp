#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "clrad/visibility.hpp"

namespace clrad::test {

/// Twelve triangles of an axis-parallel box, facing outward; a plane and a polygon a side.
inline void add_box(std::vector<OccluderTriangle>& all, const glm::dvec3& low, const glm::dvec3& high) {
  const auto corner = [&](int k) {
    return glm::dvec3(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z);
  };
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    const auto plane = std::uint32_t(all.size() / 2);
    all.push_back({{corner(f[0]), corner(f[1]), corner(f[2])}, plane, plane});
    all.push_back({{corner(f[0]), corner(f[2]), corner(f[3])}, plane, plane});
  }
}

}  // namespace clrad::test
