/// `chop`: object-parallel / ray-parallel visibility (Drucker & Schroeder, section 1.3.2): rays are cut into
/// voxels by processor allocation, every (ray, candidates) pair gets a work-item, a segmented min gives the
/// nearest.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "clrad/visibility.hpp"
#include "visibility/bundle.hpp"
#include "visibility/grid.hpp"

namespace clrad {

/// Left alone outside tests and benchmarks; the answers do not depend on any of them.
struct ChopOptions {
  std::uint32_t rays_per_batch = 0;                ///< 0: what the caches like, less when memory is short
  std::array<std::uint32_t, 3> cells = {0, 0, 0};  ///< of the grid; 0: by cost
  std::uint32_t slab =
      0xffffffffu;  ///< cells in the first wave of occluded(), twice as many in each next; 0: one wave;
                    ///< 0xffffffff: by the grid's size
};

/// One ray/voxel piece: what the paper's figure 1.2 shows.
struct RayPiece {
  std::uint32_t segment;
  std::array<std::uint32_t, 3> cell;
  float t0, t1;  ///< part of the segment inside
};

class ChopEngine : public VisibilityEngine {
 public:
  /// All pieces of the segments, those in empty voxels too, in the order made: for tests.
  virtual std::vector<RayPiece> pieces(const Segments& segments) = 0;
  virtual const Grid& grid() const = 0;
  /// From now on occluded() counts the work of each wave, which costs a read a wave: for benchmarks.
  virtual void count_waves() = 0;
  virtual const std::vector<WaveWork>& waves() const = 0;
};

std::unique_ptr<ChopEngine> make_chop(Device& device, std::span<const OccluderTriangle> triangles,
                                      const ChopOptions& options = {});

}  // namespace clrad
