#include "visibility/serial.hpp"

#include <algorithm>

#include "clrad/error.hpp"
#include "visibility/batch.hpp"
#include "visibility/occluders.hpp"

namespace clrad {

namespace {

constexpr const char* serial_kernels = "visibility/serial.cl";
// Below few_origins (FEW in the kernels, the widest packet) the lanes hold triangles: as origins would leave
// some of them empty, and share what depends on the triangle among too few. Among many triangles, where a ray
// comes close to few of those in a packet, that is the faster way up to some_origins.
constexpr std::uint32_t few_origins = 16, some_origins = 64, many_triangles = 4096;
constexpr std::uint64_t packet_floats = 17;  // PACKET_FLOATS of kernels/shared/block.cl

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
    else if (segments.origin_count < (occluders_.count < many_triangles ? few_origins : some_origins))
      occluded_few(segments, masks);
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
  Array<float> packets_;
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
                      active(s), use_active(s), s.origin_count, s.targets->buffer(), s.samples, words,
                      occluders_.triangles, occluders_.facets, occluders_.count, runs, out, exact_);
    if (runs > 1) merge(s.origin_count * words, runs, masks);
  }

  void occluded_few(const Segments& s, Array<std::uint32_t>& masks) {
    const std::uint32_t words = s.words_per_origin();
    const std::uint64_t items = (std::uint64_t(s.origin_count) + few_origins - 1) / few_origins * words;
    const std::uint32_t runs = ranges(s);
    auto& out = runs == 1 ? masks : parts(std::uint64_t(runs) * s.origin_count * words);
    device_.run_local(serial_kernels, "serial_occluded_few", items * runs, local(), s.origins->buffer(),
                      active(s), use_active(s), s.origin_count, s.targets->buffer(), s.samples, words,
                      occluders_.triangles, occluders_.facets, packets(), occluders_.count, runs, out,
                      exact_);
    if (runs > 1) merge(s.origin_count * words, runs, masks);
  }

  // The triangles in the lanes' layout, made when it is first asked for.
  const Array<float>& packets() {
    if (packets_.size() == 0) {
      const std::uint32_t count = std::max(1u, occluders_.count);  // a device has no empty buffers
      const std::uint64_t lanes = tiles(count) * width();
      packets_ = Array<float>(device_, lanes * packet_floats, "packets of occluders");
      device_.run(serial_kernels, "serial_packets", lanes, std::uint32_t(lanes), count, occluders_.triangles,
                  occluders_.facets, packets_);
    }
    return packets_;
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
