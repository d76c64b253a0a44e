/// `chop`: object-parallel / ray-parallel visibility (Drucker & Schroeder, section 1.3.2): rays are cut into voxels by
/// processor allocation, every (ray, candidates) pair gets a work-item, a segmented min gives the nearest.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "clrad/visibility.hpp"

namespace clrad {

/// Left alone outside tests and benchmarks; the answers do not depend on any of them.
struct ChopOptions {
  std::uint32_t rays_per_batch = 0;                ///< 0: what the caches like, less when memory is short
  std::array<std::uint32_t, 3> cells = {0, 0, 0};  ///< of the grid; 0: by cost
  std::uint32_t slab = 0xffffffffu;                ///< cells in a wave; 0: one wave; 0xffffffff: by the grid's size
};

std::unique_ptr<VisibilityEngine> make_chop(Device& device, std::span<const OccluderTriangle> triangles,
                                            const ChopOptions& options = {});

}  // namespace clrad
