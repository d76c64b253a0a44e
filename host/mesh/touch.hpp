// Vertices that touch other surfaces (kernels/mesh/touch.cl).
#pragma once
#include "clrad/frame.hpp"
#include "clrad/mesh.hpp"
#include "visibility/tree.hpp"

namespace clrad {

/// Moves the receivers from `first` on that touch a surface of another plane to its front, along their own: by 1e-3 of the shortest
/// edge around them for each plane that they touch, along their sum. Those that would leave their polygon stay, and those between
/// surfaces that face each other. Where vertices are drawn does not change. Returns how many were moved.
std::uint32_t move_off_touched(Device& device, const Scene& scene, const Frame& frame, const Tree& tree,
                               Mesh& mesh, std::uint32_t first = 0);

}  // namespace clrad
