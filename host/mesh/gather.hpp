// Area averages of vertex values over elements and patches.
#pragma once
#include "clrad/device.hpp"
#include "clrad/mesh.hpp"

namespace clrad {

/// The element quadtree's leaves on the device, as gather.cl reads them.
class Gatherer {
 public:
  Gatherer(Device& device, const Mesh& mesh);

  /// patch_values[at + p] = area average over patch p of the interpolant of vertex_values[from ..]. Error: rounding of one
  /// compensated sum.
  void gather(const RealArray& vertex_values, RealArray& patch_values, std::uint64_t at,
              std::uint64_t from = 0);

 private:
  Device& device_;
  std::uint32_t patches_, elements_;
  Array<std::uint32_t> vertex_, first_element_;
  RealArray weight_, share_, element_values_;
};

}  // namespace clrad
