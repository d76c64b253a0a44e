/// Whether the sides of all polygons are sealed, T-junctions and outlines that stand on a surface included.
#pragma once
#include <array>
#include <clrad/scene.hpp>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "clrad/frame.hpp"

namespace clrad {

/// A piece of surface that nothing but the surface under it stands for, such as the missing bottom of a block on a floor.
struct Fill {
  std::array<glm::dvec3, 3> corner{};  ///< frame; counter-clockwise seen from its front
  int weight = 1;                      ///< how often it counts
  std::uint32_t plane = 0;             ///< as of plane_ids()
  std::uint32_t surface = 0;           ///< which surface it closes
};

struct Seams {
  std::vector<std::uint32_t> surface;  ///< per polygon: which connected surface it belongs to, from 0
  std::uint32_t surfaces = 0;
  std::vector<Fill> fills;
  std::string open;  ///< where the first open side is; empty: all are sealed
};

/// Frame units within which points count as one, or as on a side: 2^-36, far below what a ray of the solve can find, and
/// what rounding in the file does to coordinates.
double seam_tolerance(const Scene& scene, const Frame& frame);

/// Every side of a polygon is an oriented interval of a line. The intervals are cut at each other's ends and added up with
/// their signs: where the sum is zero along all lines, the polygons form a surface without a boundary (an algebraic
/// cycle), however they meet, also in T-junctions. What is left must be outlines that lie flat on other polygons: closed
/// in one plane, with polygons of that plane, all facing the side that the outline stands on, under all that they
/// enclose. Such an outline is closed by `fills`, which lie on these polygons.
/// `planes`: plane_ids() of the scene.
Seams find_seams(const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes);

}  // namespace clrad
