// The picture pass: camera rays, what they meet, and the radiosity there.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "clrad/output.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

/// render() through an engine that the caller made over `triangles` (in the frame of `solution`).
Image render_through(Device& device, VisibilityEngine& engine, std::span<const OccluderTriangle> triangles,
                     const Solution& solution, const Camera& camera, const ImageOptions& options);

/// The numbers that kernels/render/camera.cl takes, in its order.
constexpr unsigned camera_reals = 23;
std::array<double, camera_reals> camera_numbers(const Solution& solution, const Camera& camera,
                                                unsigned width, unsigned height, Precision precision);

/// Enqueues one segment per sample of pixels first_pixel, first_pixel + 1, ...: `rays` in all.
void camera_rays(Device& device, const RealArray& camera, const ImageOptions& options,
                 std::uint32_t first_pixel, std::uint32_t rays, PointArray& origins, PointArray& targets);

/// What shading needs of the solution, on the device.
struct ShadeTables {
  Array<std::uint32_t> polygon_of;  ///< per triangle
  RealArray polygons;               ///< 20 a polygon, see kernels/render/shade.cl
  Array<std::uint32_t> grids;       ///< 4 a polygon: first vertex, cells_u, cells_v, corners
  Array<std::uint32_t> layer_start, layers;
  RealArray radiosity;  ///< [band][vertex], to draw [W/m^2]
  std::uint32_t vertices = 0, bands = 0;
};
ShadeTables shade_tables(Device& device, std::span<const OccluderTriangle> triangles,
                         const Solution& solution, const glm::dvec3& eye, bool ambient = false);
void shade_pixels(Device& device, const ShadeTables& tables, const PointArray& origins,
                  const PointArray& targets, const Array<std::uint32_t>& triangles, std::uint32_t samples,
                  std::uint32_t pixels, Array<float>& radiance);

/// Which polygons may be seen in place of another of the same plane, seen from `eye` [frame]: one list per
/// polygon, lists in file order. Of overlapping polygons in one plane the last that shows its front is seen.
struct Layers {
  std::vector<std::uint32_t> start;    ///< polygons + 1
  std::vector<std::uint32_t> polygon;  ///< polygon p: those at [start[p], start[p + 1])
};
Layers visible_layers(std::span<const OccluderTriangle> triangles, std::size_t polygons,
                      const glm::dvec3& eye);

}  // namespace clrad
