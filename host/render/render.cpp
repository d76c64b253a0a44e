#include "render/render.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "mesh/build.hpp"

namespace clrad {
namespace {

// Rays handled at a time: a share of the memory that is left, so that the engine has room for its own work,
// and no more than keeps the device busy.
std::uint32_t pixels_at_a_time(const Device& device, const ImageOptions& options, std::uint32_t bands) {
  const std::uint64_t point = device.options().precision == Precision::float64 ? 88 : 48;
  const std::uint64_t per_pixel = options.samples_per_pixel * (2 * point + 8) + 4 * std::uint64_t(bands);
  const auto& ledger = *device.ledger();
  const std::uint64_t left = ledger.limit - std::min(ledger.limit, ledger.held);
  const std::uint64_t most = (std::uint64_t(1) << 19) / options.samples_per_pixel;
  return std::uint32_t(std::clamp<std::uint64_t>(left / 4 / per_pixel, 1, std::max<std::uint64_t>(most, 1)));
}

void check(const ImageOptions& options) {
  if (options.width == 0 || options.height == 0 || std::uint64_t(options.width) * options.height > (1u << 28))
    throw UsageError(fmt::format("a picture of {} x {} pixels; it must have between 1 and 2^28",
                                 options.width, options.height));
  if (options.samples_per_pixel == 0 || options.samples_per_pixel > 65536)
    throw UsageError(
        fmt::format("{} samples a pixel; there must be between 1 and 65536", options.samples_per_pixel));
}

}  // namespace

Image render_through(Device& device, VisibilityEngine& engine, std::span<const OccluderTriangle> triangles,
                     const Solution& solution, const Camera& camera, const ImageOptions& options) {
  check(options);
  const std::uint32_t samples = options.samples_per_pixel, pixels = options.width * options.height;
  const auto numbers =
      camera_numbers(solution, camera, options.width, options.height, device.options().precision);
  const RealArray camera_array(device, numbers, "the camera");
  const ShadeTables tables =
      shade_tables(device, triangles, solution, solution.frame.to_frame(camera.eye), options.ambient);

  Image image;
  image.width = options.width, image.height = options.height, image.bands = solution.bands;
  image.unit = solution.scene.quantity == Quantity::photometric ? "cd/m^2" : "W/(sr m^2)";
  image.band_names = solution.scene.bands;
  image.radiance.reserve(std::size_t(pixels) * image.bands);

  const std::uint32_t batch = std::min(pixels, pixels_at_a_time(device, options, image.bands));
  const std::uint64_t rays_at_most = std::uint64_t(batch) * samples;
  PointArray origins(device, rays_at_most, "camera rays"), targets(device, rays_at_most, "camera rays");
  Array<std::uint32_t> triangle(device, rays_at_most, "what camera rays meet");
  Array<float> t(device, rays_at_most, "what camera rays meet");
  Array<float> radiance(device, std::uint64_t(batch) * image.bands, "pixels");
  for (std::uint32_t first = 0; first < pixels; first += batch) {
    const std::uint32_t count = std::min(batch, pixels - first), rays = count * samples;
    {
      const auto stage = device.stage("make camera rays");
      camera_rays(device, camera_array, options, first, rays, origins, targets);
    }
    {
      const auto stage = device.stage("find what each pixel sees");
      engine.intersect_closest({.origins = &origins, .origin_count = rays, .targets = &targets}, triangle, t);
    }
    const auto stage = device.stage("shade pixels");
    shade_pixels(device, tables, origins, targets, triangle, samples, count, radiance);
    const auto done = radiance.download(0, std::uint64_t(count) * image.bands);
    image.radiance.insert(image.radiance.end(), done.begin(), done.end());
  }
  return image;
}

Image render(Device& device, const Solution& solution, const Camera& camera, const ImageOptions& options) {
  const auto& mesh = solution.mesh;
  std::vector<std::uint32_t> planes;
  for (const auto& polygon : mesh.polygons) planes.push_back(mesh.receivers[polygon.first_vertex].plane);
  const auto triangles = occluder_triangles(solution.scene, solution.frame, planes);
  const auto engine = make_engine("chop", device, triangles);
  return render_through(device, *engine, triangles, solution, camera, options);
}

}  // namespace clrad
