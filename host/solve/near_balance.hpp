// Light that the near field moves is neither lost nor made.
#pragma once
#include "solve/state.hpp"

namespace clrad {

/// False where nothing is reflected, or so much (reflects_much) that no bound of what rounding does to it would say anything.
bool settles_near_field(const SolveState& state);

/// A patch sends what it has: where the vertices next to it get less of that than its average said (near_field.hpp), others get
/// more, and reflect it. A room's walls are dark along its edges, where each mostly sees the next one: left out, this took a hundredth of
/// all light from rooms of patches a quarter as long as they are.
class NearBalance {
 public:
  explicit NearBalance(SolveState& state);

  /// Gains at the vertices, [band][vertex], that `slot` is about to have: all 0.
  RealArray& gains() { return gains_; }
  /// touched[v / block()] = stamp_of(slot) where it has any.
  Array<std::uint32_t>& touched() { return touched_; }
  static constexpr std::uint32_t block() { return 256; }
  static std::uint32_t stamp_of(std::uint32_t slot) { return slot + 1; }
  /// Takes in the gains of `slot`.
  void take(std::uint32_t slot);

  /// What all that has been taken in moves: patches send on y = A^-1 (owed + rho near), A the balance form of the system
  /// (kernels/solve/balance.cl), `near` at patches the mean over their vertices; irradiance of the vertices += columns x y. `near` is
  /// all gains, [band][vertex]. Columns that are not kept are traced again.
  void settle(const RealArray& near);

 private:
  static constexpr std::uint32_t strips = 64;
  SolveState& state_;
  RealArray gains_, area_, in_strips_;
  Array<std::uint32_t> touched_;
};

}  // namespace clrad
