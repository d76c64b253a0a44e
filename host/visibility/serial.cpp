#include "visibility/serial.hpp"

#include <algorithm>

#include "clrad/error.hpp"
#include "visibility/batch.hpp"
#include "visibility/occluders.hpp"

namespace clrad {

namespace {

constexpr const char* serial_kernels = "visibility/serial.cl";
// Below this many the samples take the lanes, if there are more of them: the widest packet.
constexpr std::uint32_t few_origins = 16;

class Serial final : public VisibilityEngine {
 public:
  Serial(Device& device, std::span<const OccluderTriangle> triangles)
      : device_(device), occluders_(device, triangles), exact_(device, 2, "serial visibility counter") {
    exact_.fill_zero();
  }

  std::string name() const override { return "serial"; }

  void occluded(const Segments& segments, Array<std::uint32_t>& masks) override {
    check_segments(segments);
    if (masks.size() < std::uint64_t(segments.origin_count) * segments.words_per_origin())
      throw UsageError("the array of visibility masks is smaller than the segments need");
    if (segments.origin_count == 0) return;
    if (segments.samples == 0)
      occluded_pairs(segments, masks);
    else if (segments.origin_count < few_origins && segments.samples > segments.origin_count)
      occluded_turned(segments, masks);
    else
      occluded_samples(segments, masks);
    count(segments);
  }

  void intersect_closest(const Segments& segments, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check_segments(segments);
    if (triangle.size() < segments.count() || t.size() < segments.count())
      throw UsageError("the arrays of nearest hits are smaller than the segments need");
    const std::uint64_t packets = (segments.count() + width() - 1) / width();
    device_.run_local(serial_kernels, "serial_closest", packets, local(), segments.origins->buffer(),
                      active(segments), use_active(segments), segments.count(), segments.targets->buffer(),
                      segments.samples, occluders_.triangles, occluders_.facets, occluders_.count,
                      occluders_.input_index, triangle, t, exact_);
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
  Array<std::uint32_t> parts_;
  VisibilityCounts counts_;

  unsigned width() const { return device_.options().packet_width; }

  // Runs that the triangles are split into, one a work-item, when the rays alone would leave the device idle. A run is
  // long enough to be worth its own start. Neither cores nor packets have a say, so that counts are the same for all.
  std::uint32_t ranges(const Segments& s) const {
    const std::uint64_t wanted = device_.info().gpu ? 1u << 14 : 64, shortest = 256, rays_of_one = 256;
    const std::uint64_t most = std::max<std::uint64_t>(1, occluders_.count / shortest);
    return std::uint32_t(std::clamp<std::uint64_t>(wanted * rays_of_one / s.count(), 1, most));
  }

  std::uint64_t tiles(std::uint64_t lanes) const { return (lanes + width() - 1) / width(); }

  Array<std::uint32_t>& parts(std::uint64_t words) {
    need(device_, parts_, words, "parts of visibility masks");
    return parts_;
  }

  void merge(std::uint32_t words, std::uint32_t ranges, Array<std::uint32_t>& masks) {
    device_.run(serial_kernels, "serial_merge", words, words, ranges, parts_, masks);
  }

  void occluded_pairs(const Segments& s, Array<std::uint32_t>& masks) {
    const std::uint64_t items = tiles(s.origin_count);
    const std::uint32_t runs = ranges(s);
    auto& out = runs == 1 ? masks : parts(std::uint64_t(runs) * s.origin_count);
    device_.run_local(serial_kernels, "serial_occluded_pairs", items * runs, local(), s.origins->buffer(),
                      active(s), use_active(s), s.origin_count, s.targets->buffer(), occluders_.triangles,
                      occluders_.facets, occluders_.count, runs, out, exact_);
    if (runs > 1) merge(s.origin_count, runs, masks);
  }

  void occluded_samples(const Segments& s, Array<std::uint32_t>& masks) {
    const std::uint32_t words = s.words_per_origin();
    const std::uint64_t items = tiles(s.origin_count) * words;
    const std::uint32_t runs = ranges(s);
    auto& out = runs == 1 ? masks : parts(std::uint64_t(runs) * s.origin_count * words);
    device_.run_local(serial_kernels, "serial_occluded", items * runs, local(), s.origins->buffer(),
                      active(s), use_active(s), s.origin_count, s.targets->buffer(), s.targets->buffer(), 0u,
                      s.samples, words, occluders_.triangles, occluders_.facets, occluders_.count, runs, out,
                      exact_);
    if (runs > 1) merge(s.origin_count * words, runs, masks);
  }

  // Fewer origins than lanes: samples take the lanes.
  void occluded_turned(const Segments& s, Array<std::uint32_t>& masks) {
    const std::uint32_t words = s.words_per_origin(), origin_words = (s.origin_count + 31) / 32;
    const std::uint64_t items = tiles(s.samples) * origin_words;
    const std::uint32_t runs = ranges(s), count = s.origin_count * words;
    auto& out = parts(std::uint64_t(runs) * s.samples * origin_words);
    device_.run_local(serial_kernels, "serial_occluded", items * runs, local(), s.targets->buffer(),
                      s.targets->buffer(), 0u, s.samples, s.origins->buffer(), active(s), use_active(s),
                      s.origin_count, origin_words, occluders_.triangles, occluders_.facets, occluders_.count,
                      runs, out, exact_);
    device_.run(serial_kernels, "serial_merge_turned", count, count, runs, s.samples, words, origin_words,
                out, masks);
  }

  // A work-item already fills the vector unit, and goes over all triangles: on a CPU groups of one spread
  // best.
  unsigned local() const { return device_.info().gpu ? 0 : 1; }

  static cl_uint use_active(const Segments& s) { return s.active != nullptr; }
  // The kernel does not read it when use_active is 0, but the argument has to be some buffer.
  static const cl::Buffer& active(const Segments& s) {
    return s.active ? s.active->buffer() : s.origins->buffer();
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
