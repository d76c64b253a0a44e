// Which settings `tradeoff` measures.
#pragma once
#include <vector>

#include "clrad/tradeoff.hpp"

namespace clrad {

/// Mesh and samples refined together, coarse to fine: each rung takes some two to four times as long as the one before.
/// `base` has all that no setting changes: sensors, seed.
std::vector<TradeoffSetting> ladder_settings(double extent_m, const SolveOptions& base);

/// One thing at a time different from `middle`.
std::vector<TradeoffSetting> variations_of(const TradeoffSetting& middle, double extent_m);

/// Solves that choose mesh and samples themselves until their estimate is 5 %, 1 %, 0.3 %.
std::vector<TradeoffSetting> target_settings(const SolveOptions& base);

/// A quick solve that tells where irradiance varies.
TradeoffSetting points_setting(double extent_m, const SolveOptions& base);

/// What the reference is solved with; each level halves the elements' edge and takes four times the rays.
TradeoffSetting reference_setting(double extent_m, const SolveOptions& base, int level);

}  // namespace clrad
