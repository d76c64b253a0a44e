#include "visibility/shaft.hpp"

#include <fmt/format.h>

#include "clrad/error.hpp"
#include "visibility/batch.hpp"

namespace clrad {
namespace {

constexpr const char* shaft_kernels = "visibility/shaft.cl";
// As in the kernel file.
constexpr std::uint32_t count_places = 64, count_words = 16;

class Shaft final : public ShaftEngine {
 public:
  Shaft(Device& device, std::span<const OccluderTriangle> triangles, const ShaftOptions& options)
      : device_(device),
        options_(options),
        tree_(device, Occluders(device, triangles)),
        device_counts_(device, count_places * count_words, "counts of the visibility engine") {
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
    const std::vector<std::uint32_t> words = device_counts_.download();
    VisibilityCounts counts = counts_;
    counts.exact = counted(words, 0);
    counts.candidates = counted(words, 2);
    return counts;
  }

  ShaftWork work() const override {
    const std::vector<std::uint32_t> words = device_counts_.download();
    return {.runs = runs_,
            .given_up = counted(words, 4),
            .nodes = counted(words, 6),
            .boxes = counted(words, 8),
            .shaft_triangles = counted(words, 10),
            .packet_triangles = counted(words, 12)};
  }

  std::string account() const override {
    if (options_.budget != ShaftOptions::usual || runs_ == 0) return {};
    return fmt::format(
        "shafts decided {:.1f} % of the runs of up to {} samples; the others, where many triangles hide a "
        "part, went on as packets",
        100 * (1 - double(work().given_up) / double(runs_)), options_.run_length);
  }

 private:
  Device& device_;
  ShaftOptions options_;
  Tree tree_;
  Array<std::uint32_t> device_counts_;
  VisibilityCounts counts_;
  Array<std::uint32_t> origins_, samples_;
  Array<float> boxes_;
  std::uint64_t runs_ = 0;  ///< of samples, which had a shaft each

  static std::uint64_t counted(const std::vector<std::uint32_t>& words, std::size_t what) {
    std::uint64_t sum = 0;
    for (std::size_t at = what; at < words.size(); at += count_words)
      sum += words[at] + (std::uint64_t(words[at + 1]) << 32);
    return sum;
  }

  // A shaft costs little where nothing is in its way: what all of them read alike is made once.
  void occluded_samples(const Segments& s, Array<std::uint32_t>& masks) {
    constexpr std::uint32_t end_words = 7, word = 32;
    const std::uint32_t words = s.words_per_origin();
    const std::uint64_t tiles = (s.origin_count + width() - 1) / width();
    need(device_, origins_, tiles * width() * end_words, "ends of segments");
    need(device_, samples_, std::uint64_t(words) * word * end_words, "ends of segments");
    device_.run(shaft_kernels, "shaft_ends", tiles, *s.origins, active(s), use_active(s), s.origin_count,
                width(), origins_);
    device_.run(shaft_kernels, "shaft_ends", words * word / width(), *s.targets, *s.targets, 0u, s.samples,
                word, samples_);
    const std::uint32_t runs = (word + options_.run_length - 1) / options_.run_length;
    need(device_, boxes_, std::uint64_t(words) * runs * 8, "boxes of samples");
    device_.run(shaft_kernels, "shaft_runs", words * runs, samples_, s.samples, options_.run_length, runs,
                boxes_);
    device_.run_local(shaft_kernels, "shaft_occluded", tiles * words, local(), origins_, s.origin_count,
                      samples_, boxes_, s.samples, words, options_.run_length, options_.budget, tree_.nodes,
                      tree_.triangles, tree_.facets, masks, device_counts_);
    const std::uint32_t last = s.samples - (words - 1) * word;
    runs_ +=
        tiles * (std::uint64_t(words - 1) * runs + (last + options_.run_length - 1) / options_.run_length);
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
