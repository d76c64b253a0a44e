#include "visibility/shaft.hpp"

#include <optional>

#include "clrad/error.hpp"
#include "visibility/batch.hpp"

namespace clrad {
namespace {

constexpr const char* shaft_kernels = "visibility/shaft.cl";

class Shaft final : public ShaftEngine {
 public:
  Shaft(Device& device, std::span<const OccluderTriangle> triangles, const ShaftOptions& options)
      : device_(device),
        options_(options),
        tree_(device, Occluders(device, triangles)),
        exact_(device, 2, "shaft visibility counter") {
    exact_.fill_zero();
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
      device_.run_local(shaft_kernels, "shaft_occluded_pairs", tiles, local(), *s.origins, active(s), use_active(s),
                        s.origin_count, *s.targets, tree_.nodes, tree_.triangles, tree_.facets, masks, exact_);
    else
      device_.run_local(shaft_kernels, "shaft_occluded", tiles * s.words_per_origin(), local(), *s.origins, active(s),
                        use_active(s), s.origin_count, *s.targets, s.samples, s.words_per_origin(), options_.run_length,
                        tree_.nodes, tree_.triangles, tree_.facets, masks, exact_);
  }

  void intersect_closest(const Segments& s, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check_segments(s);
    if (triangle.size() < s.count() || t.size() < s.count())
      throw UsageError("the arrays of nearest hits are smaller than the segments need");
    counts_.rays += s.count();
    device_.run_local(shaft_kernels, "shaft_closest", (s.count() + width() - 1) / width(), local(), *s.origins, active(s),
                      use_active(s), s.count(), *s.targets, s.samples, tree_.nodes, tree_.triangles, tree_.facets,
                      tree_.input_index, triangle, t, exact_);
  }

  VisibilityCounts counts() const override {
    VisibilityCounts counts = counts_;
    const std::vector<std::uint32_t> exact = exact_.download();
    counts.exact = exact[0] + (std::uint64_t(exact[1]) << 32);
    return counts;
  }

 private:
  Device& device_;
  ShaftOptions options_;
  Tree tree_;
  Array<std::uint32_t> exact_;
  VisibilityCounts counts_;

  unsigned width() const { return device_.options().packet_width; }
  // A work-item already fills the vector unit, and its work is many times that of a launch: groups of one spread best.
  unsigned local() const { return device_.info().gpu ? 0 : 1; }
  static cl_uint use_active(const Segments& s) { return s.active != nullptr; }
  // The kernel does not read it when use_active is 0, but the argument has to be some buffer.
  static const cl::Buffer& active(const Segments& s) { return s.active ? s.active->buffer() : s.origins->buffer(); }
};

}  // namespace

std::unique_ptr<ShaftEngine> make_shaft(Device& device, std::span<const OccluderTriangle> triangles,
                                        const ShaftOptions& options) {
  return std::make_unique<Shaft>(device, triangles, options);
}

}  // namespace clrad
