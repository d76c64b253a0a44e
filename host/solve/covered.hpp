// Vertices that something stands on or encloses.
#pragma once
#include <span>
#include <vector>

#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

/// 1 where a polygon in the same plane, facing the same way and later in the file, lies on top of the vertex. Such a
/// vertex gets no rays: visibility ignores its own plane and would look through what covers it. Entry i is vertex first + i.
std::vector<std::uint32_t> overlaid_vertices(const Scene& scene, const Mesh& mesh, std::uint32_t first = 0);

/// Per patch, the share of its area that nothing covers, by the weights that average vertices over it. What a patch
/// reflects leaves from there: its radiosity is rho x mean irradiance / this share.
std::vector<double> exposed_shares(const Mesh& mesh, const std::vector<std::uint8_t>& covered);

/// 1 where the vertex is overlaid, or where each of 16 rays over its hemisphere meets the back of a surface first: it
/// lies under or inside a solid. No light comes there. Entry i, as overlaid's, is vertex first + i.
std::vector<std::uint8_t> covered_vertices(Device& device, const Scene& scene, const Mesh& mesh,
                                           const std::vector<OccluderTriangle>& triangles,
                                           VisibilityEngine& engine,
                                           const std::vector<std::uint32_t>& overlaid,
                                           std::uint32_t first = 0);

/// Weights of those of `elements` that something covers in part, by where its outline runs: their exposed corners stand for
/// the exposed share of the area (64 points tell which), the covered ones for the rest. By corners alone, what stands
/// on a patch would seem half an element smaller on every side, and its rim, often dark, would count twice.
void weigh_exposed(Device& device, const Scene& scene, Mesh& mesh,
                   const std::vector<OccluderTriangle>& triangles, VisibilityEngine& engine,
                   const std::vector<std::uint8_t>& covered, std::span<const std::uint32_t> elements);

}  // namespace clrad
