// Which element a point of a polygon lies in, and what it is interpolated from.
#pragma once
#include <array>
#include <cstdint>

#include "clrad/mesh.hpp"

namespace clrad {

/// A value at a point: the sum of weight x value over vertices (weights sum to 1; unused entries have weight 0), and of
/// bend_weight x bend over the edges of the element as Edges::of_element (host/mesh/bend.hpp) lists them.
struct Interpolant {
  std::uint32_t element = 0;
  std::array<std::uint32_t, 8> vertex{};
  std::array<double, 8> weight{};
  std::array<double, 8> bend_weight{};
};

/// At parameters (u, v) of the polygon, as PolygonMesh has them; outside it is clamped. By vertices alone: bilinear or
/// linear in the element's corners; where an edge has a T-vertex, what that differs by from the mean of the edge's ends is
/// added as a hat along the edge that falls off to nothing at the other edges. A bend is a parabola along its edge, or its half
/// of an edge with a T-vertex, that falls off likewise (Coons 1967): both sides of every edge have the same values, and a
/// quadratic function is met on quads and triangles of any level. kernels/shared/leaf.cl does the same on the device.
Interpolant locate(const Mesh& mesh, std::uint32_t polygon, std::uint32_t corners, double u, double v);

}  // namespace clrad
