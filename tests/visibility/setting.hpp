/// Occluders and segments between points, as the tests of the engines ask about them.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/visibility.hpp"

namespace clrad::test {

struct Setting {
  std::vector<OccluderTriangle> triangles;
  std::vector<Point> origins, targets;
  std::uint32_t samples = 0;  ///< targets of each origin; 0: origin i to target i
};

inline Point at(glm::dvec3 p, std::uint32_t plane = 0xffffffffu) {
  return {p, {0, 0, 1}, plane, 0xffffffffu};
}

}  // namespace clrad::test
