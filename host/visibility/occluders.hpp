/// Occluder triangles as the engines want them: snapped to the visibility grid, those without area dropped.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/visibility.hpp"
#include "shared/types.h"

namespace clrad {

struct Occluders {
  /// Throws UsageError when a corner is not finite or outside +-4 of the frame.
  Occluders(Device& device, std::span<const OccluderTriangle> input);

  std::uint32_t count = 0;          ///< triangles kept, in the order of the input
  Array<clrad_triangle> triangles;  ///< count (at least one element is allocated)
  Array<clrad_facet> facets;        ///< count: edges and normal of each, for the fast test
  Array<std::uint32_t>
      input_index;  ///< count: which input triangle it is; ascending. Results index the input
  glm::dvec3 box_low{0, 0, 0}, box_high{0, 0, 0};  ///< bounds of the kept triangles' snapped corners [frame]
};

/// One triangle snapped, with its edges and normal; false when its area on the grid is zero.
bool snap_triangle(const OccluderTriangle& input, clrad_triangle& triangle, clrad_facet& facet);

}  // namespace clrad
