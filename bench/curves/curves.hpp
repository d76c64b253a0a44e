// What bench_curves measures; each prints a table and writes its plot into options.folder.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "../boxes_scene.hpp"
#include "../plot.hpp"
#include "../timing.hpp"
#include "clrad/clrad.hpp"
#include "visibility/chop.hpp"

namespace clrad::bench {

constexpr std::uint32_t n = 16;  // samples of each shooter, where a curve is not about them

struct CurveOptions {
  bool quick = false;
  ChopOptions chop;  ///< of the curves over occluders and units
  std::string folder;
};

nlohmann::json occluders_curve(const CurveOptions& options);
nlohmann::json pairs_curve(const CurveOptions& options);
nlohmann::json units_curve(const CurveOptions& options);
nlohmann::json waves_curve(const CurveOptions& options);
nlohmann::json patches_curve(const CurveOptions& options);

/// Visibility steps on a device: their points, and room for the masks.
struct StepsOnDevice {
  struct One {
    PointArray origins, targets;
    Array<std::uint32_t> masks;
    Segments segments;
  };
  Device& device;
  std::vector<std::unique_ptr<One>> steps;
  std::uint64_t rays = 0;

  StepsOnDevice(Device& d, const std::vector<Step>& all) : device(d) {
    for (const Step& s : all) {
      auto one = std::make_unique<One>();
      one->origins = PointArray(d, s.receivers, "receivers");
      one->targets = PointArray(d, s.samples, "samples");
      one->segments = {&one->origins, nullptr, std::uint32_t(s.receivers.size()), &one->targets,
                       std::uint32_t(s.samples.size())};
      one->masks = Array<std::uint32_t>(
          d, std::uint64_t(one->segments.origin_count) * one->segments.words_per_origin(), "masks");
      rays += s.rays();
      steps.push_back(std::move(one));
    }
  }
  void run(VisibilityEngine& engine) {
    for (auto& s : steps) engine.occluded(s->segments, s->masks);
    device.finish();
  }
  std::vector<std::uint32_t> bits() {
    std::vector<std::uint32_t> all;
    for (auto& s : steps) {
      const auto mine = s->masks.download();
      all.insert(all.end(), mine.begin(), mine.end());
    }
    return all;
  }
};

/// The answer of an engine; throws when it is not `expected` (empty: taken over).
inline void check_bits(StepsOnDevice& steps, VisibilityEngine& engine, std::vector<std::uint32_t>& expected) {
  steps.run(engine);
  const auto bits = steps.bits();
  if (expected.empty()) expected = bits;
  if (bits != expected) throw DeviceError("the engine " + engine.name() + " gives other bits");
}

}  // namespace clrad::bench
