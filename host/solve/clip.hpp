// What of a shooter is visible, by clipping it instead of samples (kernels/solve/clip.cl).
#pragma once
#include <string>

#include "solve/form_factor.hpp"
#include "visibility/tree.hpp"

namespace clrad {

class Clip {
 public:
  Clip(Device& device, const Tree& tree) : device_(device), tree_(tree) {}

  /// column[r] = form factor of the visible part of the shooter, for the chosen receivers r = active[i], i < count, but where it
  /// cannot be clipped (kernels/solve/clip.cl): sampled[i] is 1 for those and 0 for others, and their entries stay as they are.
  /// factors[i]: of the whole shooter. Errors: rounding alone, 5e-5 of a factor in float and 1e-9 in double; more,
  /// as positions are rounded, of shooters that look small or are seen at a grazing angle.
  void visible_factors(const Shooter& shooter, const PointArray& receivers,
                       const Array<std::uint32_t>& active, std::uint32_t count, const RealArray& factors,
                       RealArray& column, Array<std::uint32_t>& sampled);

  /// For the account: of so many pairs so many were left to samples.
  void note(std::uint64_t asked, std::uint64_t left) { asked_ += asked, left_ += left; }
  /// Of all pairs so far, the share that was left to samples.
  double share_left() const { return asked_ ? double(left_) / double(asked_) : 0; }
  std::uint64_t asked() const { return asked_; }
  std::uint64_t left() const { return left_; }
  /// How much was clipped and how much left to samples, in a sentence.
  std::string account() const;

 private:
  Device& device_;
  const Tree& tree_;
  Array<std::uint32_t> ends_, corners_, list_, lanes_, many_, hidden_;
  std::uint64_t asked_ = 0, left_ = 0;
};

}  // namespace clrad
