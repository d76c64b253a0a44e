#include "effects/effects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "clrad/error.hpp"

namespace clrad {
namespace {

struct Planner {
  const char* name;
  Effect (*plan)(const Scene&, const SolveOptions&);
};
constexpr Planner planners[] = {
    {"colour", plan_colour},
    {"two_sided", plan_two_sided},
    {"textures", plan_textures},
    {"occlusion", plan_occlusion},
    {"interreflection", plan_interreflection},
    {"subdivision", plan_subdivision},
    {"lights", plan_lights},
    {"near_field", plan_near_field},
    {"transmission", plan_transmission},
    {"specular", plan_specular},
};

bool names(const std::vector<std::string>& list, std::string_view name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

void check_names(const std::vector<std::string>& list, const char* option, bool all_allowed) {
  const std::vector<std::string> known = effect_names();
  for (const std::string& name : list)
    if (!names(known, name) && !(all_allowed && name == "all"))
      throw UsageError(fmt::format("{}: there is no effect \"{}\"; there are {}{}", option, name,
                                   all_allowed ? "all, " : "", fmt::join(known, ", ")));
}

}  // namespace

void check_effect_names(const SolveOptions& options) {
  check_names(options.force_effects, "--force-effects", true);
  check_names(options.without, "--without", false);
}

std::vector<std::string> effect_names() {
  std::vector<std::string> all;
  for (const Planner& planner : planners) all.emplace_back(planner.name);
  return all;
}

std::vector<Effect> plan_effects(const Scene& scene, const SolveOptions& options) {
  check_effect_names(options);
  std::vector<Effect> effects;
  for (const Planner& planner : planners) {
    Effect effect = planner.plan(scene, options);
    effect.name = planner.name;
    const bool forced = names(options.force_effects, "all") || names(options.force_effects, effect.name);
    effect.runs = (effect.needed || forced) && !names(options.without, effect.name);
    effects.push_back(std::move(effect));
  }
  return effects;
}

void charge(std::span<Effect> effects, std::string_view name, std::span<const StageProfile> profile) {
  for (Effect& effect : effects) {
    if (effect.name != name) continue;
    effect.launches = 0, effect.seconds = 0, effect.allocated_bytes = 0;
    for (const StageProfile& stage : profile) {
      if (!names(effect.stages, stage.name)) continue;
      effect.launches += stage.launches;
      effect.seconds += stage.seconds;
      effect.allocated_bytes += stage.bytes;
    }
  }
}

bool runs(std::span<const Effect> effects, std::string_view name) {
  const auto found =
      std::find_if(effects.begin(), effects.end(), [&](const Effect& e) { return e.name == name; });
  return found != effects.end() && found->runs;
}

}  // namespace clrad
