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

/// `shaft`, and what its tests and benchmarks look at.
class ShaftEngine : public VisibilityEngine {
 public:
  virtual const Tree& tree() const = 0;
};

std::unique_ptr<ShaftEngine> make_shaft(Device& device, std::span<const OccluderTriangle> triangles,
                                        const ShaftOptions& options = {});

}  // namespace clrad
