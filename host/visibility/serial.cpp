#include "visibility/serial.hpp"

#include "clrad/error.hpp"
#include "visibility/occluders.hpp"

namespace clrad {

namespace {

constexpr char file[] = "visibility/serial.cl";

class Serial final : public VisibilityEngine {
 public:
  Serial(Device& device, std::span<const OccluderTriangle> triangles)
      : device_(device), occluders_(device, triangles), exact_(device, 2, "serial visibility counter") {
    exact_.fill_zero();
  }

  std::string name() const override { return "serial"; }

  void occluded(const Segments& segments, Array<std::uint32_t>& masks) override {
    check(segments);
    if (masks.size() < std::uint64_t(segments.origin_count) * segments.words_per_origin())
      throw UsageError("the array of visibility masks is smaller than the segments need");
    const std::uint64_t packets = (segments.origin_count + width() - 1) / width();
    if (segments.samples > 0)
      device_.run_local(file, "serial_occluded", packets * segments.words_per_origin(), local(),
                        segments.origins->buffer(), active(segments), use_active(segments),
                        segments.origin_count, segments.targets->buffer(), segments.samples,
                        segments.words_per_origin(), occluders_.triangles, occluders_.facets,
                        occluders_.count, masks, exact_);
    else
      device_.run_local(file, "serial_occluded_pairs", packets, local(), segments.origins->buffer(),
                        active(segments), use_active(segments), segments.origin_count,
                        segments.targets->buffer(), occluders_.triangles, occluders_.facets, occluders_.count,
                        masks, exact_);
    count(segments);
  }

  void intersect_closest(const Segments& segments, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check(segments);
    if (triangle.size() < segments.count() || t.size() < segments.count())
      throw UsageError("the arrays of nearest hits are smaller than the segments need");
    const std::uint64_t packets = (segments.count() + width() - 1) / width();
    device_.run_local(file, "serial_closest", packets, local(), segments.origins->buffer(), active(segments),
                      use_active(segments), segments.count(), segments.targets->buffer(), segments.samples,
                      occluders_.triangles, occluders_.facets, occluders_.count, occluders_.input_index,
                      triangle, t, exact_);
    count(segments);
  }

  VisibilityCounts counts() const override {
    VisibilityCounts counts = counts_;
    const std::vector<std::uint32_t> exact = exact_.download();
    counts.exact = exact[0] + (std::uint64_t(exact[1]) << 32);
    return counts;
  }

 private:
  Device& device_;
  Occluders occluders_;
  Array<std::uint32_t> exact_;
  VisibilityCounts counts_;

  unsigned width() const { return device_.options().packet_width; }

  // A work-item already fills the vector unit, and goes over all triangles: on a CPU groups of one spread
  // best.
  unsigned local() const { return device_.info().gpu ? 0 : 1; }

  static cl_uint use_active(const Segments& s) { return s.active != nullptr; }
  // The kernel does not read it when use_active is 0, but the argument has to be some buffer.
  static const cl::Buffer& active(const Segments& s) {
    return s.active ? s.active->buffer() : s.origins->buffer();
  }

  static void check(const Segments& s) {
    if (!s.origins || !s.targets) throw UsageError("visibility segments need origins and targets");
    if (s.active ? s.active->size() < s.origin_count : s.origins->size() < s.origin_count)
      throw UsageError("visibility segments name more origins than there are");
    if (s.targets->size() < (s.samples ? s.samples : s.active ? 0 : s.origin_count))
      throw UsageError("visibility segments name more targets than there are");
  }

  void count(const Segments& s) {
    counts_.rays += s.count();
    counts_.candidates += s.count() * occluders_.count;
  }
};

}  // namespace

std::unique_ptr<VisibilityEngine> make_serial(Device& device, std::span<const OccluderTriangle> triangles) {
  return std::make_unique<Serial>(device, triangles);
}

}  // namespace clrad
