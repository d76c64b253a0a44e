/// Two-sided surfaces: two polygons back to back.
#pragma once
#include <clrad/scene.hpp>
#include <cstdint>
#include <vector>

namespace clrad {

/// What is two-sided in a scene, with_backs() applied or not.
struct TwoSided {
  std::vector<std::uint32_t> backs;  ///< polygons that have or get a back
  std::uint64_t dark = 0;            ///< polygons that get none: it would face the dark inside of a solid
};

/// Looks at materials first: without a two-sided one, at nothing else.
///
/// A back is left out where it bounds the inside of a closed surface that is convex (every corner on or behind every
/// face), emits nothing, has no glass, and has no other polygon, no light and no camera in it: light that is not there at
/// first never gets there.
TwoSided find_two_sided(const Scene& scene);

/// Warns ("two-sided") once where polygons have two sides, of how many and what that costs: exporters set it unasked.
void check_two_sided(const Scene& scene, std::vector<Diagnostic>& findings);

/// Whether polygon `p` has its back right behind it.
inline bool has_back(const Scene& scene, std::size_t p) {
  return p + 1 < scene.polygons.size() && scene.polygons[p + 1].back;
}

}  // namespace clrad
