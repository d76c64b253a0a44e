/// `serial`: object-serial / ray-parallel visibility (Drucker & Schroeder, section 1.3.1), the paper's
/// baseline.
#pragma once
#include <memory>
#include <span>

#include "clrad/visibility.hpp"

namespace clrad {

std::unique_ptr<VisibilityEngine> make_serial(Device& device, std::span<const OccluderTriangle> triangles);

}  // namespace clrad
