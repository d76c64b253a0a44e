/// Proof that a scene is closed: that every ray from the front of a surface ends on the front of a surface.
#pragma once
#include <clrad/scene.hpp>
#include <string>

namespace clrad {

struct Enclosure {
  bool closed = false;  ///< proven
  std::string
      reason;  ///< why it is not: what is open or faces the wrong way, with file and line; empty when closed
};

/// Two steps. First, all sides are sealed (scene/seams.hpp): with the fills, the polygons are a surface without a
/// boundary, so each point of space has a winding number, which goes up by one from the back of a polygon to its front
/// and is 0 far away. Second, the winding number is 1 in front of every polygon, at its middle and next to each corner,
/// but for parts that another surface's opposite-facing polygon or an outline that stands there covers. A ray that starts
/// where it is 1 must come to 0, so it meets a front, and where no front has 2 before it, it meets no back before.
/// Winding numbers are counted along rays in directions that no scene is aligned with; a ray that passes an edge within
/// rounding is not counted but replaced.
Enclosure find_enclosure(const Scene& scene);

}  // namespace clrad
