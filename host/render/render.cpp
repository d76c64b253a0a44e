#include "render/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "mesh/build.hpp"
#include "render/reflect.hpp"
#include "render/texture.hpp"
#include "scene/planes.hpp"
#include "scene/range.hpp"
#include "solve/sensor.hpp"

namespace clrad {
namespace {

// Of glass, rays may come to several times those from the camera before most of them have ended.
constexpr std::uint32_t glass_growth = 4;
// Their queues are at least this long where memory allows, so that small pictures have room, too.
constexpr std::uint64_t glass_queue = 1 << 16;

void check(const ImageOptions& options) {
  if (options.width == 0 || options.height == 0 || std::uint64_t(options.width) * options.height > (1u << 28))
    throw UsageError(fmt::format("a picture of {} x {} pixels; it must have between 1 and 2^28",
                                 options.width, options.height));
  if (options.samples_per_pixel == 0 || options.samples_per_pixel > 65536)
    throw UsageError(
        fmt::format("{} samples a pixel; there must be between 1 and 65536", options.samples_per_pixel));
  if (options.depth > 64)
    throw UsageError(fmt::format("rays followed to depth {}; at most 64 makes sense", options.depth));
  if (options.light_samples == 0 || options.light_samples > 4096)
    throw UsageError(
        fmt::format("{} rays to a light; there must be between 1 and 4096", options.light_samples));
}

// One picture: tables, queues, and the loop over batches of pixels.
class Picture {
 public:
  Picture(Device& device, VisibilityEngine& engine, std::span<const OccluderTriangle> triangles,
          const Scene& scene, const Frame& frame, const Camera& camera, const ImageOptions& options,
          const SurfaceTables& surfaces, const Shading& shading, const PictureTextures* textures)
      : device_(device),
        engine_(engine),
        options_(options),
        surfaces_(surfaces),
        shading_(shading),
        textures_(textures),
        bands_(std::uint32_t(scene.bands.size())),
        camera_(
            device,
            camera_numbers(scene, frame, camera, options.width, options.height, device.options().precision),
            "the camera") {
    const bool follow = options.depth > 0 && has_specular(scene);
    const bool glass = follow && std::any_of(scene.materials.begin(), scene.materials.end(),
                                             [](const Material& m) { return m.is_glass(); });
    const std::uint64_t samples = options.samples_per_pixel, room = rays_at_a_time(follow),
                        rays_per_pixel = samples * (glass ? glass_growth : 1);
    batch_ = std::uint32_t(
        std::clamp<std::uint64_t>(room / rays_per_pixel, 1, std::uint64_t(options.width) * options.height));
    std::uint64_t capacity = batch_ * rays_per_pixel;
    if (glass) capacity = std::max(capacity, std::min(room, glass_queue));
    if (follow) {
      reflector_.emplace(device, surfaces, triangles, scene, frame, camera_, capacity);
      for (Rays& queue : queue_) queue = reflector_->queue(capacity, batch_);
    } else {
      queue_[0].origins = PointArray(device, capacity, "camera rays");
      queue_[0].targets = PointArray(device, capacity, "camera rays");
    }
    seen_ = Array<std::uint32_t>(device, capacity, "what rays meet");
    t_ = Array<float>(device, capacity, "what rays meet");
    shown_ = Array<float>(device, capacity * bands_, "light that rays meet");
    radiance_ = Array<float>(device, std::uint64_t(batch_) * bands_, "pixels");
  }

  std::vector<float> draw() {
    const std::uint32_t pixels = options_.width * options_.height;
    std::vector<float> radiance;
    radiance.reserve(std::size_t(pixels) * bands_);
    for (std::uint32_t first = 0; first < pixels;) {
      const std::uint32_t count = std::min(batch_, pixels - first);
      if (!draw_batch(first, count)) {
        // A pixel's bits do not depend on its batch, so fewer pixels at a time it is.
        if (count == 1)
          throw DeviceError(
              fmt::format("the reflected and refracted rays of one pixel, more than {}, do not fit into "
                          "memory; give more of it (--memory), fewer samples or a smaller --depth",
                          seen_.size()));
        batch_ = count / 2;
        continue;
      }
      const auto done = radiance_.download(0, std::uint64_t(count) * bands_);
      radiance.insert(radiance.end(), done.begin(), done.end());
      first += count;
    }
    return radiance;
  }

 private:
  // False when the rays that go on are too many for the queues.
  bool draw_batch(std::uint32_t first, std::uint32_t count) {
    const std::uint32_t samples = options_.samples_per_pixel;
    Rays *rays = &queue_[0], *next = &queue_[1];
    rays->count = count * samples;
    rays->from_camera = true;
    {
      const auto stage = device_.stage("make camera rays");
      camera_rays(device_, camera_, options_, first, rays->count, rays->origins, rays->targets);
    }
    for (std::uint32_t depth = 0;; ++depth) {
      {
        const auto stage =
            device_.stage(depth == 0 ? "find what each pixel sees" : "find what mirrors and glass show");
        engine_.intersect_closest(
            {.origins = &rays->origins, .origin_count = rays->count, .targets = &rays->targets}, seen_, t_);
        find_seen(device_, surfaces_, *rays, seen_);
      }
      {
        const auto stage = device_.stage("shade pixels");
        shading_.shade(*rays, seen_, shown_);
      }
      if (textures_) textures_->apply(surfaces_, *rays, seen_, shown_);
      {
        const auto stage = device_.stage("shade pixels");
        add_to_pixels(device_, *rays, shown_, samples, count, bands_, radiance_);
      }
      if (!reflector_ || depth == options_.depth) return true;
      const auto stage = device_.stage("send rays on from mirrors and glass");
      if (!reflector_->send_on(*rays, seen_, samples, count, *next)) return false;
      if (next->count == 0) return true;
      std::swap(rays, next);
    }
  }

  // A share of the memory that is left, so that the engine has room for its own work, and no more than keep
  // the device busy.
  std::uint64_t rays_at_a_time(bool follow) const {
    const Precision precision = device_.options().precision;
    const std::uint64_t point = precision == Precision::float64 ? 88 : 48;
    // Of a pixel, its radiance and where its rays begin, if each had one ray.
    std::uint64_t per_ray = 2 * point + 8 + 8 * std::uint64_t(bands_) + 8 + shading_.bytes_per_ray;
    if (follow) per_ray += Reflector::bytes_per_ray(precision, bands_);
    const auto& ledger = *device_.ledger();
    const std::uint64_t left = ledger.limit - std::min(ledger.limit, ledger.held);
    return std::min<std::uint64_t>(left / 4 / per_ray, std::uint64_t(1) << 19);
  }

  Device& device_;
  VisibilityEngine& engine_;
  const ImageOptions& options_;
  const SurfaceTables& surfaces_;
  const Shading& shading_;
  const PictureTextures* textures_;  // or null
  std::uint32_t bands_, batch_ = 1;
  RealArray camera_;
  std::optional<Reflector> reflector_;
  Rays queue_[2];
  Array<std::uint32_t> seen_;
  Array<float> t_, shown_, radiance_;
};

Image empty_image(const Scene& scene, const ImageOptions& options) {
  Image image;
  image.width = options.width, image.height = options.height, image.bands = unsigned(scene.bands.size());
  image.unit = scene.quantity == Quantity::photometric ? "cd/m^2" : "W/(sr m^2)";
  image.band_names = scene.bands;
  return image;
}

}  // namespace

Image render_through(Device& device, VisibilityEngine& engine, std::span<const OccluderTriangle> triangles,
                     const Solution& solution, const Camera& camera, const ImageOptions& options) {
  if (options.whitted)
    return render_whitted_through(device, engine, triangles, solution.scene, solution.frame, camera, options);
  check(options);
  Image image = empty_image(solution.scene, options);
  const SurfaceTables surfaces = surface_tables(device, triangles, solution.scene, solution.frame);
  const Shading shading = radiosity_shading(device, surfaces, solution, options.ambient);
  std::optional<PictureTextures> textures;
  if (!solution.textured.patch.empty()) textures.emplace(device, solution.scene);
  image.radiance = Picture(device, engine, triangles, solution.scene, solution.frame, camera, options,
                           surfaces, shading, textures ? &*textures : nullptr)
                       .draw();
  return image;
}

Image render_whitted_through(Device& device, VisibilityEngine& engine,
                             std::span<const OccluderTriangle> triangles, const Scene& scene,
                             const Frame& frame, const Camera& camera, const ImageOptions& options) {
  check(options);
  Image image = empty_image(scene, options);
  const SurfaceTables surfaces = surface_tables(device, triangles, scene, frame);
  const Shading shading =
      direct_shading(device, engine, surfaces, triangles, scene, frame, options.light_samples);
  std::optional<PictureTextures> textures;
  if (has_textures(scene)) textures.emplace(device, scene);
  image.radiance = Picture(device, engine, triangles, scene, frame, camera, options, surfaces, shading,
                           textures ? &*textures : nullptr)
                       .draw();
  return image;
}

Image render(Device& device, const Solution& solution, const Camera& camera, const ImageOptions& options) {
  const auto& mesh = solution.mesh;
  std::vector<std::uint32_t> planes;
  for (const auto& polygon : mesh.polygons) planes.push_back(mesh.receivers[polygon.first_vertex].plane);
  const auto triangles = occluder_triangles(solution.scene, solution.frame, planes);
  const auto engine = make_engine("shaft", device, triangles);
  return render_through(device, *engine, triangles, solution, camera, options);
}

Image render_whitted(Device& device, const Scene& given, const Camera& camera, const ImageOptions& options) {
  require_range(given);
  const Scene scene = with_backs(given);
  const Frame frame = frame_with_sensors(scene, {});
  const auto triangles = occluder_triangles(scene, frame, plane_ids(scene));
  const auto engine = make_engine("shaft", device, triangles);
  return render_whitted_through(device, *engine, triangles, scene, frame, camera, options);
}

}  // namespace clrad
