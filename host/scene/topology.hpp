/// How polygons meet along shared sides: open sides, orientation, watertight surfaces. Corners are the same
/// when their coordinates are equal; a T-junction therefore counts as open sides.
#pragma once
#include <clrad/scene.hpp>
#include <vector>

namespace clrad {

/// Warns ("open-edges") once when sides are used by one polygon alone, with their count and the first five.
void check_open_edges(const Scene& scene, std::vector<Diagnostic>& findings);

/// Warns ("orientation") of each polygon that faces against the majority of its connected surface (in a tie,
/// against its first polygon), and once of each surface that cannot be oriented at all. Polygons are
/// connected across sides that exactly two of them use; two that share several sides the same way round lie
/// on each other and are not. Warns ("inside-out") of a closed surface that faces inward with no other
/// surface in its bounding box, or outward with all others in it.
void check_orientation(const Scene& scene, std::vector<Diagnostic>& findings);

/// Per polygon the first polygon of its closed surface, or 0xffffffff where the surface is open, its polygons do not all
/// face the same way, or it is a back.
std::vector<std::uint32_t> closed_surfaces(const Scene& scene);

}  // namespace clrad
