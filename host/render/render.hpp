// The picture pass: camera rays, what they meet, and the light there.
#pragma once
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "clrad/output.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

/// render() through an engine that the caller made over `triangles` (in the frame of `solution`).
Image render_through(Device& device, VisibilityEngine& engine, std::span<const OccluderTriangle> triangles,
                     const Solution& solution, const Camera& camera, const ImageOptions& options);
/// render_whitted() through an engine made over `triangles`, in `frame`.
Image render_whitted_through(Device& device, VisibilityEngine& engine,
                             std::span<const OccluderTriangle> triangles, const Scene& scene,
                             const Frame& frame, const Camera& camera, const ImageOptions& options);

/// The numbers that kernels/render/camera.cl takes, in its order; from number camera_box on the box that rays are
/// clipped to: low x y z, high x y z.
constexpr unsigned camera_reals = 23, camera_box = 15;
std::array<double, camera_reals> camera_numbers(const Scene& scene, const Frame& frame, const Camera& camera,
                                                unsigned width, unsigned height, Precision precision);

/// Enqueues one segment per sample of pixels first_pixel, first_pixel + 1, ...: `rays` in all.
void camera_rays(Device& device, const RealArray& camera, const ImageOptions& options,
                 std::uint32_t first_pixel, std::uint32_t rays, PointArray& origins, PointArray& targets);

/// Rays and what they have met, on the device. Those of a pixel stand next to each other.
struct Rays {
  PointArray origins, targets;  ///< an origin's normal is the ray's unit direction
  RealArray throughput;         ///< [ray][band]; not there, and 1, of rays from the camera
  Array<std::uint32_t> start;   ///< per pixel and one more; not there of rays from the camera
  std::uint32_t count = 0;
  bool from_camera = false;
};

/// What is known of every polygon, whatever light falls on it.
struct SurfaceTables {
  Array<std::uint32_t> polygon_of;  ///< per triangle
  RealArray polygons;               ///< 20 a polygon, see kernels/shared/surface.cl
  Array<std::uint32_t> layer_start, layers;
};
SurfaceTables surface_tables(Device& device, std::span<const OccluderTriangle> triangles, const Scene& scene,
                             const Frame& frame);
/// For points on polygons: the axes of each (12 reals, see kernels/shared/surface.cl) and its plane.
struct PlaceTables {
  RealArray axes;
  Array<std::uint32_t> planes;
};
PlaceTables place_tables(Device& device, std::span<const OccluderTriangle> triangles, const Scene& scene,
                         const Frame& frame);

/// seen: from the triangle each ray meets to the polygon it sees, in place.
void find_seen(Device& device, const SurfaceTables& tables, const Rays& rays, Array<std::uint32_t>& seen);

/// The polygons that overlap each polygon in its own plane: two lists per polygon, in file order.
struct Layers {
  std::vector<std::uint32_t> start;  ///< 2 polygons + 1
  /// Polygon p: those that face as it does at [start[2p], start[2p + 1]), the others up to start[2p + 2].
  std::vector<std::uint32_t> polygon;
};
Layers overlapping_layers(std::span<const OccluderTriangle> triangles, std::size_t polygons);

/// Radiosity [W/m^2] of the point where each ray ends, into shown[ray][band].
struct Shading {
  std::function<void(const Rays&, const Array<std::uint32_t>& seen, Array<float>& shown)> shade;
  std::uint64_t bytes_per_ray = 0;  ///< that it needs besides
};
/// From a solution, by interpolation, with its estimate of what is unshot or without. The tables are the caller's and
/// outlive the result.
Shading radiosity_shading(Device& device, const SurfaceTables& tables, const Solution& solution,
                          bool ambient = false);
/// Light that comes straight from emitting polygons (host/render/direct.cpp).
Shading direct_shading(Device& device, VisibilityEngine& engine, const SurfaceTables& tables,
                       std::span<const OccluderTriangle> triangles, const Scene& scene, const Frame& frame,
                       std::uint32_t light_samples);

/// Adds each pixel's rays to radiance[pixel][band]; rays from the camera set it.
void add_to_pixels(Device& device, const Rays& rays, const Array<float>& shown, std::uint32_t samples,
                   std::uint32_t pixels, std::uint32_t bands, Array<float>& radiance);

}  // namespace clrad
