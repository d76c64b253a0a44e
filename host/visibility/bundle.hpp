/// Occlusion by `chop`: rays are cut into voxels a bundle at a time (kernels/visibility/bundle.cl).
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/primitives.hpp"
#include "clrad/visibility.hpp"
#include "visibility/batch.hpp"
#include "visibility/grid.hpp"
#include "visibility/occluders.hpp"

namespace clrad {

/// What one wave had to do, summed over batches: how much of the work blocked rays were spared.
struct WaveWork {
  std::uint64_t rays = 0;     ///< that are long enough for this wave, blocked or not
  std::uint64_t blocked = 0;  ///< of these, by an earlier wave: they did no more work
  std::uint64_t pieces = 0;   ///< ray/voxel pieces that the others were cut into
};

/// Work-items that count what was done: each goes over its share of all pieces, so a GPU wants thousands of them.
inline std::uint32_t tally_items(const Device& device) {
  return device.info().gpu ? 1u << 14 : 64;
}

/// How many of them make a work-group (0: as many as usual): all 64 in one would keep a CPU's other cores idle.
inline unsigned tally_group(const Device& device) {
  return device.info().gpu ? 0 : 1;
}

class BundleTracer {
 public:
  /// What it reads has to outlive it. slab: cells in the first wave, 0 for one wave. packets: as chop_packets writes them.
  BundleTracer(Device& device, const Occluders& occluders, const Grid& grid, const Array<float>& packets,
               const Array<std::uint32_t>& packet_planes, std::uint32_t slab);

  /// sums: 3 x tally_items() counts of ray/triangle pairs, exact tests and ray/voxel pieces, added to.
  void occluded(const Segments& segments, const Batch& batch, Array<std::uint32_t>& masks,
                Array<std::uint64_t>& sums);

  /// Rays that the scratch it holds is enough for.
  std::uint32_t rays_held() const { return rays_held_; }
  void release();

  /// From now on the work of each wave is counted (each costs the host a read).
  void count_waves() { counts_waves_ = true; }
  const std::vector<WaveWork>& waves() const { return waves_; }

 private:
  /// The pieces of one stage of cutting.
  struct Pieces {
    Array<std::uint32_t> bundle, cell, low, counts;  ///< low: of the last stage, which lanes
    Array<float> t;                                  ///< t0 and t1 of each lane
  };
  struct Scratch {
    Array<std::uint32_t> from, to, windows, needs, blocked, flags, alive;
    Pieces here, there;
    Allocation cut, pairs;
  };

  Device& device_;
  const Occluders& occluders_;
  const Grid& grid_;
  const Array<float>& packets_;
  const Array<std::uint32_t>& packet_planes_;
  std::vector<std::uint32_t> axes_;  ///< that are cut: those with more than one cell
  std::uint32_t slab_;
  Scratch scratch_;
  std::uint32_t rays_held_ = 0;
  std::uint32_t run_ = 1, pairs_ = 0;  ///< how bundle numbers of the batch stand for rays
  bool counts_waves_ = false;
  std::vector<WaveWork> waves_;

  std::uint32_t width() const { return grid_.width; }
  void upload_ends(const Segments& segments, const Batch& batch);
  void start_wave(std::uint32_t count, std::uint32_t wave);
  void need_pieces(Pieces& pieces, std::uint32_t count, bool last);
  std::uint32_t cut(std::uint32_t bundles);
  void test(std::uint32_t pieces, Array<std::uint64_t>& sums);
  void count_wave(std::uint32_t wave, std::uint32_t bundles);
};

}  // namespace clrad
