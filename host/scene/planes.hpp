/// Which polygons lie in one geometric plane: a segment ignores every polygon in the planes of its two ends.
#pragma once
#include <clrad/scene.hpp>
#include <cstdint>
#include <vector>

namespace clrad {

/// One id per polygon, equal exactly for polygons in the same plane, whichever way they face; ids are dense
/// from 0 in the order in which planes first appear.
///
/// Rule: polygons are taken widest first (area / longest diagonal), since a wide one fixes its plane best. A
/// polygon joins the first plane from which none of its corners is further than
///     2^-36 frame units  +  delta (1 + 2 distance / width)
/// where delta, 2 ulp of the scene's largest coordinate, is what rounding in the file does to a corner, and
/// the second term is what it does to the plane at that distance from the polygon that fixed it. Near the
/// origin delta is 2^-52 and the first term rules; a million metres away it keeps the pieces of a tilted wall
/// together.
///
/// Expected time is linear: planes are found by hashing normal and offset, with cells as coarse as the
/// polygon's own width leaves its normal undetermined.
std::vector<std::uint32_t> plane_ids(const Scene& scene);

}  // namespace clrad
