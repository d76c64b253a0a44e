#include "visibility/open.hpp"

#include "visibility/batch.hpp"

namespace clrad {
namespace {

class Open : public VisibilityEngine {
 public:
  explicit Open(Device& device) : device_(device) {}
  std::string name() const override { return "none"; }
  void occluded(const Segments& segments, Array<std::uint32_t>& masks) override {
    check_segments(segments);
    device_.fill_bytes(
        masks.buffer(), 0,
        std::uint64_t(segments.origin_count) * segments.words_per_origin() * sizeof(std::uint32_t));
  }
  void intersect_closest(const Segments& segments, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check_segments(segments);
    const std::uint64_t bytes = segments.count() * sizeof(std::uint32_t);
    device_.fill_bytes(triangle.buffer(), 0xffffffffu, bytes);
    device_.fill_bytes(t.buffer(), 0x3f800000u, bytes);  // 1.0f
  }
  VisibilityCounts counts() const override { return {}; }

 private:
  Device& device_;
};

}  // namespace

std::unique_ptr<VisibilityEngine> make_open(Device& device) {
  return std::make_unique<Open>(device);
}

}  // namespace clrad
