#include "visibility/snap.hpp"

#include <fmt/core.h>

#include "clrad/error.hpp"

namespace clrad {

void check_range(const glm::dvec3& p, const char* what) {
  for (int axis = 0; axis < 3; ++axis)
    // Written so that NaN fails.
    if (!(std::abs(p[axis]) <= grid_range))
      throw UsageError(fmt::format(
          "{} at ({}, {}, {}) is outside the frame: visibility takes coordinates within +-4 of it", what, p.x,
          p.y, p.z));
}

}  // namespace clrad
