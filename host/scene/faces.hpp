/// The rules by which one face of a file becomes planar convex triangles and quads.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace clrad {

/// What was found about a face. Lengths below `rounding`, four units in the last place of the face's largest
/// coordinate, cannot be told from rounding in the file.
enum class FaceRule {
  as_it_is,         ///< a triangle, or a planar strictly convex quad
  repeated_corner,  ///< a corner equal to the one before it: left out
  degenerate,       ///< all corners within `rounding` of one line: dropped
  non_planar,  ///< a quad whose diagonals pass each other by more than 1e-6 of the longer one: cut along the
               ///< diagonal 0-2, or 1-3 where corner 1 or 3 is reflex or straight
  concave,     ///< a quad with a reflex corner: cut from that corner
  straight_corner,    ///< a quad with a corner within `rounding` of the line of its neighbours: cut from it
  many_corners,       ///< more than four: triangles by ear clipping, best-shaped ear first
  self_intersecting,  ///< its sides cross: an error
};

inline constexpr double kPlanarTolerance = 1e-6;  ///< of the longer diagonal

struct FacePiece {
  std::array<std::uint32_t, 4> corner{};  ///< indices into the face's corners, winding kept
  std::uint32_t corners = 0;
};

struct CutFace {
  std::vector<FacePiece> pieces;  ///< none when degenerate or self-intersecting
  std::vector<FaceRule> rules;    ///< what was done; empty when the face is kept as it is
  double non_planarity = 0;       ///< of a quad: distance of its diagonals / the longer one
};

/// Cuts a face of at least three finite corners.
CutFace cut_face(std::span<const glm::dvec3> corners);

/// Distance between the lines of the diagonals of a quad over the length of the longer one; 0 when planar.
double quad_non_planarity(const std::array<glm::dvec3, 4>& corner);

}  // namespace clrad
