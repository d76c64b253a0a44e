#pragma once
#include <memory>
#include <span>

#include "clrad/visibility.hpp"
#include "visibility/tree.hpp"

namespace clrad {

struct ShaftOptions {
  std::uint32_t run_length = 32;  ///< samples of one shaft, at most 32
};

/// `shaft`, and what its tests and benchmarks look at.
class ShaftEngine : public VisibilityEngine {
 public:
  virtual const Tree& tree() const = 0;
};

std::unique_ptr<ShaftEngine> make_shaft(Device& device, std::span<const OccluderTriangle> triangles,
                                        const ShaftOptions& options = {});

}  // namespace clrad
