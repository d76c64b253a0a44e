// What of a shooter is visible, by clipping it instead of samples (kernels/solve/clip.cl).
#pragma once
#include <memory>
#include <span>
#include <string>

#include "solve/form_factor.hpp"
#include "visibility/tree.hpp"

namespace clrad {

class Clip {
 public:
  /// Uses the tree of `engine` if it has one, else makes one of `triangles`.
  Clip(Device& device, const VisibilityEngine& engine, std::span<const OccluderTriangle> triangles);

  /// column[r] = form factor of the visible part of the shooter, for the chosen receivers r = active[i], i < count, but where too
  /// many triangles stand between: those are listed in `left`, and their entries stay as they are. Returns how many.
  /// factors[i]: of the whole shooter. Errors: rounding alone, some 1e-5 of a factor in float and 1e-9 in double.
  std::uint32_t visible_factors(const Shooter& shooter, const PointArray& receivers,
                                const Array<std::uint32_t>& active, std::uint32_t count,
                                const RealArray& factors, RealArray& column, Array<std::uint32_t>& left);

  /// How much was clipped and how much left to samples, in a sentence.
  std::string account() const;

 private:
  Device& device_;
  std::unique_ptr<Tree> own_;
  const Tree& tree_;
  Array<std::uint32_t> ends_, corners_, list_, lanes_, many_, hidden_, sampled_;
  std::uint64_t asked_ = 0, left_ = 0;

  const Tree& tree_of(const VisibilityEngine& engine, std::span<const OccluderTriangle> triangles);
};

}  // namespace clrad
