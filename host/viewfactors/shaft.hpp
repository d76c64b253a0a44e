// What may stand between two convex polygons: the shaft between them (Haines & Wallace 1991, "Shaft culling for efficient
// ray-traced radiosity").
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "viewfactors/convex.hpp"
#include "viewfactors/surfaces.hpp"

namespace clrad {

class Shaft;

/// A binary tree of boxes around the surfaces, in the frame, for finding those that may reach into a shaft.
class BoxTree {
 public:
  explicit BoxTree(const SurfaceList& surfaces);
  /// The surfaces, but for a and b, whose boxes, grown by rounding, meet the box that holds both a and b (whole surfaces)
  /// and the shaft between parts of them; `origin`: what the shaft is relative to, in the frame. Ascending.
  std::vector<std::uint32_t> near(std::uint32_t a, std::uint32_t b, const Shaft& shaft,
                                  const glm::dvec3& origin) const;

 private:
  struct Box {
    glm::dvec3 low, high;
  };
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  // of order_; count 0: children at `first` and `first` + 1
  };
  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count);

  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

/// The convex hull of two convex polygons, as the planes that touch both along an edge of one.
class Shaft {
 public:
  struct Plane {
    glm::dvec3 normal, point;  ///< outward
  };
  Shaft(const Convex& a, const Convex& b);
  /// One more plane that has all of the hull behind it.
  void add(const Plane& plane) { planes_.push_back(plane); }
  const std::vector<Plane>& planes() const { return planes_; }
  double size() const { return size_; }
  /// False only when no inner point of the polygon lies inside the hull. `allowed`: positions this near to the hull's
  /// surface count as outside.
  bool may_hold(const Convex& polygon, double allowed) const;

 private:
  void add_planes(const Convex& edges, const Convex& corners);
  const Convex &a_, &b_;
  double size_ = 0;
  std::vector<Plane> planes_;
};

}  // namespace clrad
