// The first cells of a receiver: small where the integrand may change over short distances, so that no Gauss point rule
// overlooks what happens between its points.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "viewfactors/pairs.hpp"

namespace clrad {

using Quad = std::array<glm::dvec3, 4>;

/// A convex polygon as quads, the last one perhaps a triangle with its last corner repeated.
std::vector<Quad> quads_of(const Convex& polygon);

/// Part of a quad: parameters [u, u + 1] / 2^level_u and [v, v + 1] / 2^level_v of its bilinear map.
struct CellPlace {
  std::uint32_t u = 0, v = 0, level_u = 0, level_v = 0;
  CellPlace half(bool along_v, std::uint32_t which) const;
};

constexpr std::uint32_t deepest_cell = 28;  ///< bisections along one side: coordinates fit 32 bits

/// Form factors of points vary over a length that is the distance to the nearest edge of the shooter or of an occluder
/// (along an edge: to its end), and where a shadow is narrow, its width. Cells are bisected until they are not much longer
/// than that, each way. Cells and shadows of less area than `negligible` are left as they are.
class CellGrading {
 public:
  CellGrading(const PairPart& part, double negligible);
  /// Appends the first cells of one quad of the receiver.
  void grade(const Quad& quad, std::vector<CellPlace>& cells) const;

 private:
  struct Edge {
    glm::dvec3 from, to;
    double scale;  // below this, what the integrand does shows at the Gauss points
  };
  void add_edges(const Convex& polygon, const PairPart& part);

  double negligible_;
  std::vector<Edge> edges_;
  std::vector<PairPart::Occluder::Shadow> shadows_;
};

}  // namespace clrad
