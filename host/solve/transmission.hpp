/// What glass lets pass of light on its way from surface to surface (kernels/solve/transmission.cl).
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/scene.hpp"
#include "clrad/visibility.hpp"
#include "shared/types.h"

namespace clrad {

/// Polygons of glass, in file order.
std::vector<std::uint32_t> glass_polygons(const Scene& scene);

/// Glass::colours() of that scene.
std::uint32_t glass_colours(const Scene& scene);

/// Those of the triangles that light does not pass.
std::vector<OccluderTriangle> without_glass(const Scene& scene, std::span<const OccluderTriangle> triangles);

/// The glass of a scene on the device. Exists only while the effect "transmission" runs.
class Glass {
 public:
  /// `triangles`: those of all polygons; what is no glass is left out.
  Glass(Device& device, const Scene& scene, std::span<const OccluderTriangle> triangles);

  /// How many products each segment has: 1 where all glass passes the same share of all bands, else one a band. What is
  /// [colour][...] holds band b in row b % colours().
  std::uint32_t colours() const { return colours_; }

  /// What glass lets pass of segments with samples > 0, for origins first .. end - 1 of the chosen ones at a time, as memory
  /// allows: `use` gets passes[(c * (end - first) + origin - first) * samples + k] in [0, 1]; 1 where masks say that the segment is
  /// blocked.
  void pass(
      const Segments& segments, const Array<std::uint32_t>& masks,
      const std::function<void(const RealArray& passes, std::uint32_t first, std::uint32_t end)>& use) const;

  /// The same of segments with samples == 0, all at once: [colour][segment].
  RealArray pass_pairs(const Segments& segments, const Array<std::uint32_t>& masks) const;

 private:
  void launch(const Segments& segments, const Array<std::uint32_t>& masks, std::uint32_t first,
              std::uint64_t count, RealArray& passes) const;

  Device& device_;
  std::uint32_t colours_ = 1, blocks_ = 0;
  Array<clrad_triangle> triangles_;
  Array<clrad_facet> facets_;
  Array<std::uint32_t> block_first_;
  Array<float> boxes_;
  RealArray surfaces_, shares_;
  mutable RealArray passes_;  // scratch
};

}  // namespace clrad
