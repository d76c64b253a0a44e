/// Shafts through a tree of boxes (kernels/visibility/shaft.cl), packets where a shaft is too full.
#pragma once
#include <memory>
#include <span>

#include "clrad/visibility.hpp"
#include "visibility/tree.hpp"

namespace clrad {

struct ShaftOptions {
  std::uint32_t run_length = 32;  ///< samples of one shaft, at most 32
  /// Triangles that a shaft may have to ask sample by sample; beyond it, samples go one by one. 0: they always do.
  /// usual: half as many as it has samples, from 1 to 8.
  std::uint32_t budget = usual;

  static constexpr std::uint32_t usual = 0xffffffffu;
};

/// What became of the segments from receivers to samples so far; a packet is of DeviceOptions::packet_width.
struct ShaftWork {
  std::uint64_t runs = 0,
                given_up = 0;  ///< of samples with a shaft of their own; those that went on as packets
  std::uint64_t nodes = 0, boxes = 0;  ///< visited; children's boxes that were held against each lane
  std::uint64_t shaft_triangles = 0,
                packet_triangles = 0;  ///< asked of a packet and a run, of a packet and a sample
};

/// `shaft`, and what its tests and benchmarks look at.
class ShaftEngine : public VisibilityEngine {
 public:
  virtual const Tree& tree() const = 0;
  virtual ShaftWork work() const = 0;
};

std::unique_ptr<ShaftEngine> make_shaft(Device& device, std::span<const OccluderTriangle> triangles,
                                        const ShaftOptions& options = {});

}  // namespace clrad
