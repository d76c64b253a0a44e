// Closed convex bodies among the surfaces of a scene: to a point outside they hide what their outline encloses, one
// shape instead of a heap of faces.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/scene.hpp"

namespace clrad {

struct ConvexBody {
  struct Corner {
    std::uint32_t polygon, index;
  };
  struct Side {
    std::uint32_t from, to;         ///< corners
    std::uint32_t face, neighbour;  ///< the two polygons that meet there, as places in `face`
  };
  std::vector<std::uint32_t> face;  ///< polygons of the scene
  std::vector<Corner> corner;       ///< one for each position
  std::vector<Side> side;
};

constexpr std::size_t most_body_corners = 12;  ///< so that no outline has more sides than the kernels take

/// Surfaces that are closed, face outward and are convex but for rounding, with few enough corners.
std::vector<ConvexBody> convex_bodies(const Scene& scene);

}  // namespace clrad
