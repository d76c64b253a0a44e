// One pair of polygons made ready for integration: clipped to what can see each other, with what stands between.
#pragma once
#include <cstdint>
#include <vector>

#include "viewfactors/convex.hpp"
#include "viewfactors/shaft.hpp"
#include "viewfactors/surfaces.hpp"

namespace clrad {

/// A part of the receiver and a part of the shooter that see each other whole, but for the occluders. Frame units,
/// relative to the receiver's anchor.
struct PairPart {
  Convex shooter;
  std::vector<Convex> receiver;  ///< convex parts, cut where an occluder stands on the receiver
  glm::dvec3 receiver_normal{0, 0, 1};
  double shooter_doubt = 0;
  struct Occluder {
    Convex corner;  ///< clipped to the front of both planes
    glm::dvec3 normal{0, 0, 1};
    std::uint32_t body = Surface::no_body;  ///< in `bodies`, when all of it is in front of both planes
    /// Where it can hide something of the shooter: a rectangle of the receiver's plane, at most this large.
    struct Shadow {
      bool bounded = false;
      glm::dvec3 middle{0, 0, 0}, axis[2]{};  ///< axes of unit length
      double half[2]{0, 0};                   ///< half the sides
    } shadow{};
  };
  std::vector<Occluder> occluders;  ///< largest first
  /// A closed convex body: what its outline encloses is what its faces hide.
  struct Body {
    Convex corner;
    struct Face {
      glm::dvec3 normal, point;
    };
    std::vector<Face> face;
    std::vector<ConvexBody::Side> side;
  };
  std::vector<Body> bodies;
};

/// Empty when no point of one sees a point of the other. The integral of point factors over all parts' receivers is A F.
std::vector<PairPart> parts_of_pair(const SurfaceList& surfaces, const BoxTree& tree, std::uint32_t receiver,
                                    std::uint32_t shooter);

/// The same part with its shooter cut in two across the longest side, each with the occluders that concern it.
std::vector<PairPart> with_halved_shooter(const PairPart& part);

}  // namespace clrad
