#include "solve/transmission.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "device/grow.hpp"
#include "render/reflect.hpp"
#include "visibility/occluders.hpp"
#include "visibility/snap.hpp"

namespace clrad {
namespace {

constexpr const char* multiply = "multiply by what glass lets pass";
// Triangles that are passed over together where a segment is not near their box.
constexpr std::size_t block_triangles = 16;
// On each side of a box: segment.cl keeps ends to 2^-38, near_box() of transmission.cl looks at floats of up to 4, some
// operations away.
constexpr double box_room = 0x1p-18;
// Products held at a time: enough to keep a device busy, and little beside the columns.
constexpr std::uint64_t most_products = 1 << 22;

}  // namespace

std::vector<std::uint32_t> glass_polygons(const Scene& scene) {
  std::vector<std::uint32_t> glass;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p)
    if (scene.materials[scene.polygons[p].material].is_glass()) glass.push_back(p);
  return glass;
}

std::uint32_t glass_colours(const Scene& scene) {
  const bool one = std::all_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    const std::vector<double>& t = m.transmission;
    return !m.is_glass() || std::all_of(t.begin(), t.end(), [&](double x) { return x == t[0]; });
  });
  return one ? 1 : std::uint32_t(scene.bands.size());
}

std::vector<OccluderTriangle> without_glass(const Scene& scene, std::span<const OccluderTriangle> triangles) {
  std::vector<OccluderTriangle> opaque;
  for (const OccluderTriangle& t : triangles)
    if (!scene.materials[scene.polygons[t.polygon].material].is_glass()) opaque.push_back(t);
  return opaque;
}

Glass::Glass(Device& device, const Scene& scene, std::span<const OccluderTriangle> triangles)
    : device_(device) {
  const auto stage = device.stage(multiply);
  colours_ = glass_colours(scene);
  std::vector<OccluderTriangle> glass;
  for (const OccluderTriangle& t : triangles)
    if (scene.materials[scene.polygons[t.polygon].material].is_glass()) glass.push_back(t);
  std::stable_sort(glass.begin(), glass.end(),
                   [](const OccluderTriangle& a, const OccluderTriangle& b) { return a.plane < b.plane; });
  const std::vector<SpecularKind> kinds = specular_kinds(scene);
  std::vector<clrad_triangle> kept;
  std::vector<clrad_facet> facets;
  std::vector<double> surfaces, shares;
  std::vector<std::uint32_t> block_first;
  std::vector<float> boxes;
  glm::dvec3 low(0), high(0);
  const auto end_block = [&] {
    const glm::dvec3 middle = 0.5 * (low + high), half = 0.5 * (high - low) + box_room;
    for (int a = 0; a < 3; ++a) boxes.push_back(float(middle[a]));
    for (int a = 0; a < 3; ++a) boxes.push_back(float(half[a]));
  };
  for (const OccluderTriangle& t : glass) {
    clrad_triangle triangle;
    clrad_facet facet;
    if (!snap_triangle(t, triangle, facet)) continue;
    const bool new_plane = kept.empty() || kept.back().plane != t.plane;
    if (kept.empty() || (new_plane && kept.size() - block_first.back() >= block_triangles)) {
      if (!kept.empty()) end_block();
      block_first.push_back(std::uint32_t(kept.size()));
      low = high = unsnap(snap(t.corner[0]));
    }
    for (const glm::dvec3& corner : t.corner) {
      const glm::dvec3 p = unsnap(snap(corner));
      low = glm::min(low, p), high = glm::max(high, p);
    }
    kept.push_back(triangle), facets.push_back(facet);
    const Material& m = scene.materials[scene.polygons[t.polygon].material];
    const glm::dvec3 n = scene.polygons[t.polygon].normal();
    surfaces.insert(surfaces.end(),
                    {n.x, n.y, n.z, kinds[t.polygon] == SpecularKind::sheet ? -m.ior : m.ior});
    shares.insert(shares.end(), m.transmission.begin(), m.transmission.begin() + colours_);
  }
  blocks_ = std::uint32_t(block_first.size());
  if (blocks_ > 0) end_block();
  block_first.push_back(std::uint32_t(kept.size()));
  // Devices have no empty buffers.
  if (kept.empty())
    kept.emplace_back(), facets.emplace_back(), boxes.resize(6), surfaces.resize(4), shares.resize(colours_);
  triangles_ = Array<clrad_triangle>(device, kept, "glass");
  facets_ = Array<clrad_facet>(device, facets, "glass");
  block_first_ = Array<std::uint32_t>(device, block_first, "glass");
  boxes_ = Array<float>(device, boxes, "glass");
  surfaces_ = RealArray(device, surfaces, "glass");
  shares_ = RealArray(device, shares, "glass");
}

void Glass::launch(const Segments& s, const Array<std::uint32_t>& masks, std::uint32_t first,
                   std::uint64_t count, RealArray& passes) const {
  device_.run("solve/transmission.cl", "through_glass", count, *s.origins,
              s.active ? s.active->buffer() : s.origins->buffer(), std::uint32_t(s.active != nullptr), first,
              *s.targets, s.samples, masks, triangles_, facets_, surfaces_, shares_, colours_, block_first_,
              boxes_, blocks_, passes, count);
}

void Glass::pass(
    const Segments& segments, const Array<std::uint32_t>& masks,
    const std::function<void(const RealArray& passes, std::uint32_t first, std::uint32_t end)>& use) const {
  if (segments.origin_count == 0) return;
  const std::uint64_t per_origin = std::uint64_t(segments.samples) * colours_;
  const auto& ledger = *device_.ledger();
  const std::uint64_t left = ledger.limit - std::min(ledger.limit, ledger.held);
  const std::uint64_t real = device_.options().precision == Precision::float64 ? 8 : 4;
  const std::uint64_t room = std::max(passes_.size(), std::min(left / 8 / real, most_products));
  const auto batch = std::uint32_t(std::clamp<std::uint64_t>(room / per_origin, 1, segments.origin_count));
  for (std::uint32_t first = 0; first < segments.origin_count; first += batch) {
    const std::uint32_t end = std::min(segments.origin_count, first + batch);
    {
      const auto stage = device_.stage(multiply);
      grow(passes_, device_, batch * per_origin, "what glass lets pass");
      launch(segments, masks, first, std::uint64_t(end - first) * segments.samples, passes_);
    }
    use(passes_, first, end);
  }
}

RealArray Glass::pass_pairs(const Segments& segments, const Array<std::uint32_t>& masks) const {
  const auto stage = device_.stage(multiply);
  const std::uint64_t count = segments.count();
  RealArray passes(device_, count * colours_, "what glass lets pass");
  launch(segments, masks, 0, count, passes);
  return passes;
}

}  // namespace clrad
