/// Which effects a scene calls for. The scene decides which stages run, never what text the kernels contain: an effect that
/// does not run launches nothing, allocates nothing and adds no pass over data.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/scene.hpp"

namespace clrad {

/// One effect, and what the plan makes of it.
struct Effect {
  std::string name;
  bool needed = true;  ///< the scene calls for it
  bool runs = true;    ///< needed or forced, and not left out by SolveOptions::without
  std::string reason;  ///< why it is needed or not, in a sentence
  /// Error of leaving it out, relative to the scene's mean irradiance: 0 only when proven, else a bound or an estimate;
  /// negative: unknown (null in JSON).
  double skip_error_relative = -1;
  std::vector<std::string> stages;  ///< of the profile: those that are there for this effect alone
  // What it took; 0 in a plan.
  std::uint64_t launches = 0;
  double seconds = 0;                 ///< on the device
  std::uint64_t allocated_bytes = 0;  ///< of all arrays made for it, one after the other
};

/// Names that SolveOptions::force_effects and ::without take, in the order of plan_effects().
std::vector<std::string> effect_names();

/// All effects in the order in which a solve comes to them. A pure function: it looks at the scene and the options, launches
/// nothing, and takes well under a second for 1e5 polygons. Throws UsageError where force_effects or without name an
/// effect that there is not.
std::vector<Effect> plan_effects(const Scene& scene, const SolveOptions& options);

/// Fills in what the effect of that name took: the sums over its stages in the profile.
void charge(std::span<Effect> effects, std::string_view name, std::span<const StageProfile> profile);

/// Whether the effect of that name runs; `effects` are from plan_effects().
bool runs(std::span<const Effect> effects, std::string_view name);

}  // namespace clrad
