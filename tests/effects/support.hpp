// What the tests of effects share: what a solve took, and whether an effect left any trace in it.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>

#include "clrad/clrad.hpp"

namespace clrad::test {

inline const Effect& effect_of(const std::vector<Effect>& effects, const std::string& name) {
  const auto found =
      std::find_if(effects.begin(), effects.end(), [&](const Effect& e) { return e.name == name; });
  if (found == effects.end()) throw std::runtime_error("no effect " + name);
  return *found;
}

/// With a profile of its own. Devices are kept: opening one takes a second.
inline Solution solve_alone(const Scene& scene, const SolveOptions& options,
                            Precision precision = Precision::float32) {
  static std::map<Precision, std::unique_ptr<Device>> devices;
  auto& device = devices[precision];
  if (!device) {
    DeviceOptions device_options;
    device_options.precision = precision;
    device = std::make_unique<Device>(device_options);
  }
  device->reset_profile();
  return solve(*device, scene, options);
}

/// Nothing launched, nothing allocated; and the profile has none of its stages.
inline void expect_no_trace(const Solution& solution, const std::string& name) {
  const Effect& effect = effect_of(solution.report.effects, name);
  EXPECT_FALSE(effect.needed) << effect.reason;
  EXPECT_FALSE(effect.runs);
  EXPECT_EQ(effect.launches, 0u);
  EXPECT_EQ(effect.allocated_bytes, 0u);
  ASSERT_FALSE(effect.stages.empty());
  for (const StageProfile& stage : solution.report.stages)
    EXPECT_EQ(std::count(effect.stages.begin(), effect.stages.end(), stage.name), 0) << stage.name;
}

inline void expect_trace(const Solution& solution, const std::string& name) {
  const Effect& effect = effect_of(solution.report.effects, name);
  EXPECT_TRUE(effect.runs) << effect.reason;
  EXPECT_GT(effect.launches, 0u);
}

/// A coarse mesh of the rooms of effects/rooms.hpp.
inline SolveOptions coarse(double converge = 1e-3) {
  SolveOptions options;
  options.mesh = {1, 0.25};
  options.converge = converge;
  return options;
}

inline SolveOptions forced(SolveOptions options, const std::string& name) {
  options.force_effects = {name};
  return options;
}
inline SolveOptions without(SolveOptions options, const std::string& name) {
  options.without = {name};
  return options;
}

inline void expect_same_bits(const Solution& a, const Solution& b) {
  EXPECT_EQ(a.vertex_irradiance, b.vertex_irradiance);
  EXPECT_EQ(a.patch_irradiance, b.patch_irradiance);
  EXPECT_EQ(a.vertex_covered, b.vertex_covered);
}

/// The largest difference of vertex irradiance, relative to the mean of `a`.
inline double difference(const Solution& a, const Solution& b) {
  EXPECT_EQ(a.vertex_irradiance.size(), b.vertex_irradiance.size());
  double sum = 0, worst = 0;
  for (std::size_t i = 0; i < a.vertex_irradiance.size(); ++i) {
    sum += a.vertex_irradiance[i];
    worst = std::max(worst, std::abs(a.vertex_irradiance[i] - b.vertex_irradiance[i]));
  }
  return sum > 0 ? worst / (sum / double(a.vertex_irradiance.size())) : worst;
}

}  // namespace clrad::test
