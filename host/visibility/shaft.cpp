#include "visibility/shaft.hpp"

#include <fmt/format.h>

#include <chrono>
#include <optional>

#include "clrad/error.hpp"
#include "visibility/batch.hpp"

namespace clrad {
namespace {

constexpr const char* shaft_kernels = "visibility/shaft.cl";
constexpr std::uint32_t period = 16;       // as in the kernel file
constexpr std::uint32_t usual_budget = 8;  // of a shaft where there are shafts
// Below this many tiles, which take a millisecond or so, there is nothing to gain by measuring.
constexpr std::uint64_t worth_measuring = 2048;

class Shaft final : public ShaftEngine {
 public:
  Shaft(Device& device, std::span<const OccluderTriangle> triangles, const ShaftOptions& options)
      : device_(device),
        options_(options),
        tree_(device, Occluders(device, triangles)),
        device_counts_(device, 4, "counts of the visibility engine") {
    device_counts_.fill_zero();
  }

  std::string name() const override { return "shaft"; }
  const Tree& tree() const override { return tree_; }

  void occluded(const Segments& s, Array<std::uint32_t>& masks) override {
    check_segments(s);
    if (masks.size() < std::uint64_t(s.origin_count) * s.words_per_origin())
      throw UsageError("the array of visibility masks is smaller than the segments need");
    counts_.rays += s.count();
    const std::uint64_t tiles = (s.origin_count + width() - 1) / width();
    if (s.samples == 0)
      device_.run_local(shaft_kernels, "shaft_occluded_pairs", tiles, local(), *s.origins, active(s),
                        use_active(s), s.origin_count, *s.targets, tree_.nodes, tree_.triangles, tree_.facets,
                        masks, device_counts_);
    else
      occluded_samples(s, masks);
  }

  void intersect_closest(const Segments& s, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check_segments(s);
    if (triangle.size() < s.count() || t.size() < s.count())
      throw UsageError("the arrays of nearest hits are smaller than the segments need");
    counts_.rays += s.count();
    device_.run_local(shaft_kernels, "shaft_closest", (s.count() + width() - 1) / width(), local(),
                      *s.origins, active(s), use_active(s), s.count(), *s.targets, s.samples, tree_.nodes,
                      tree_.triangles, tree_.facets, tree_.input_index, triangle, t, device_counts_);
  }

  VisibilityCounts counts() const override {
    VisibilityCounts counts = counts_;
    const std::vector<std::uint32_t> words = device_counts_.download();
    counts.exact = words[0] + (std::uint64_t(words[1]) << 32);
    counts.candidates = words[2] + (std::uint64_t(words[3]) << 32);
    return counts;
  }

  std::string account() const override {
    if (options_.budget != ShaftOptions::automatic) return {};
    if (shafts_ + packets_ == 0) return "shafts throughout: no step was long enough to be worth measuring";
    return fmt::format(
        "shafts in {} steps, packets in {}: what was faster on a sixteenth each of each step's receivers",
        shafts_, packets_);
  }

 private:
  Device& device_;
  ShaftOptions options_;
  Tree tree_;
  Array<std::uint32_t> device_counts_;
  VisibilityCounts counts_;
  Array<std::uint32_t> origins_, samples_;
  bool warm_ = false;
  std::uint64_t shafts_ = 0, packets_ = 0;  ///< steps that went either way after measuring

  // A shaft costs little where nothing is in its way: what all of them read alike is made once.
  void occluded_samples(const Segments& s, Array<std::uint32_t>& masks) {
    constexpr std::uint32_t end_words = 7, word = 32;
    const std::uint32_t words = s.words_per_origin();
    const std::uint64_t tiles = (s.origin_count + width() - 1) / width();
    need(device_, origins_, tiles * width() * end_words, "ends of segments");
    need(device_, samples_, std::uint64_t(words) * word * end_words, "ends of segments");
    device_.run(shaft_kernels, "shaft_ends", tiles * width(), *s.origins, active(s), use_active(s),
                s.origin_count, width(), origins_);
    device_.run(shaft_kernels, "shaft_ends", words * word, *s.targets, *s.targets, 0u, s.samples, word,
                samples_);
    const auto trace = [&](std::uint32_t from, std::uint32_t to, std::uint32_t budget) {
      const std::uint64_t numbers = (tiles + period - 1) / period * (to - from);
      device_.run_local(shaft_kernels, "shaft_occluded", numbers * words, local(), origins_, s.origin_count,
                        from, to, samples_, s.samples, words, options_.run_length, budget, tree_.nodes,
                        tree_.triangles, tree_.facets, masks, device_counts_);
    };
    if (options_.budget != ShaftOptions::automatic) return trace(0, period, options_.budget);
    if (!warm_ || tiles * words < worth_measuring) {
      warm_ = true;  // the device's compiler has done its work then
      return trace(0, period, usual_budget);
    }
    const auto seconds = [&](std::uint32_t from, std::uint32_t budget) {
      device_.finish();
      const auto start = std::chrono::steady_clock::now();
      trace(from, from + 1, budget);
      device_.finish();
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const bool shafts = seconds(0, usual_budget) <= seconds(1, 0);
    ++(shafts ? shafts_ : packets_);
    trace(2, period, shafts ? usual_budget : 0);
  }

  unsigned width() const { return device_.options().packet_width; }
  // A work-item already fills the vector unit, and its work is many times that of a launch: groups of one spread best.
  unsigned local() const { return device_.info().gpu ? 0 : 1; }
  static cl_uint use_active(const Segments& s) { return s.active != nullptr; }
  // The kernel does not read it when use_active is 0, but the argument has to be some buffer.
  static const cl::Buffer& active(const Segments& s) {
    return s.active ? s.active->buffer() : s.origins->buffer();
  }
};

}  // namespace

std::unique_ptr<ShaftEngine> make_shaft(Device& device, std::span<const OccluderTriangle> triangles,
                                        const ShaftOptions& options) {
  return std::make_unique<Shaft>(device, triangles, options);
}

}  // namespace clrad
