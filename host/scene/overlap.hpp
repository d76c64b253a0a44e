#pragma once
#include <clrad/scene.hpp>
#include <vector>

namespace clrad {

/// Warns ("overlap") once of each polygon that lies on an earlier one: both in one plane (scene/planes.hpp),
/// facing the same way, and overlapping by more than 1e-9 frame units in every direction. The later one lies
/// on top and covers. Exact duplicates are reported by validation and not again here. Near-linear for scenes
/// whose planes are not crowded: a sweep along the longer axis of each plane.
void check_overlaps(const Scene& scene, std::vector<Diagnostic>& findings);

}  // namespace clrad
