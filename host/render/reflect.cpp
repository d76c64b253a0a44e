#include "render/reflect.hpp"

#include <algorithm>

#include "scene/topology.hpp"

namespace clrad {
namespace {

constexpr const char* reflect_kernels = "render/reflect.cl";

// One value a band of what may be left out where it is 0.
double band_of(const std::vector<double>& values, std::uint32_t band) {
  return band < values.size() ? values[band] : 0;
}

}  // namespace

std::vector<SpecularKind> specular_kinds(const Scene& scene) {
  const auto glass = [&](std::size_t p) { return scene.materials[scene.polygons[p].material].is_glass(); };
  std::vector<SpecularKind> kinds(scene.polygons.size(), SpecularKind::none);
  const std::vector<std::uint32_t> surface = closed_surfaces(scene);
  std::vector<bool> all_glass(scene.polygons.size(), true);  // at a surface's first polygon
  for (std::size_t p = 0; p < kinds.size(); ++p)
    if (surface[p] != 0xffffffffu && !glass(p)) all_glass[surface[p]] = false;
  for (std::size_t p = 0; p < kinds.size(); ++p) {
    if (glass(p))
      kinds[p] =
          surface[p] != 0xffffffffu && all_glass[surface[p]] ? SpecularKind::solid : SpecularKind::sheet;
    else if (scene.materials[scene.polygons[p].material].is_mirror())
      kinds[p] = SpecularKind::mirror;
  }
  return kinds;
}

std::uint64_t Reflector::bytes_per_ray(Precision precision, std::uint32_t bands) {
  const bool wide = precision == Precision::float64;
  const std::uint64_t point = wide ? 88 : 48, real = wide ? 8 : 4;
  // A second queue, throughput of both, counts, offsets, and owner and rank of the two rays that each may ask for.
  return 2 * point + 2 * real * bands + 4 + 4 + 2 * 2 * 4;
}

Reflector::Reflector(Device& device, const SurfaceTables& surfaces,
                     std::span<const OccluderTriangle> triangles, const Scene& scene, const Frame& frame,
                     const RealArray& camera, std::uint64_t capacity)
    : device_(device),
      surfaces_(surfaces),
      bands_(std::uint32_t(scene.bands.size())),
      capacity_(capacity),
      places_(place_tables(device, triangles, scene, frame)),
      counts_(device, capacity, "rays asked for") {
  std::vector<std::uint32_t> kinds;
  for (const SpecularKind kind : specular_kinds(scene)) kinds.push_back(std::uint32_t(kind));
  std::vector<double> ior, shares;
  for (const Polygon& polygon : scene.polygons) {
    const Material& m = scene.materials[polygon.material];
    ior.push_back(m.ior);
    for (const auto* values : {&m.reflectance, &m.specular, &m.transmission})
      for (std::uint32_t band = 0; band < bands_; ++band) shares.push_back(band_of(*values, band));
  }
  const auto numbers = camera.download();
  kinds_ = Array<std::uint32_t>(device, kinds, "mirrors and glass");
  ior_ = RealArray(device, ior, "mirrors and glass");
  shares_ = RealArray(device, shares, "mirrors and glass");
  box_ = RealArray(device, std::span(numbers).subspan(camera_box, 6), "the scene's box");
  allocation_.offsets = Array<std::uint32_t>(device, capacity + 1, "rays asked for");
  allocation_.owner = Array<std::uint32_t>(device, 2 * capacity, "rays asked for");
  allocation_.rank = Array<std::uint32_t>(device, 2 * capacity, "rays asked for");
}

Rays Reflector::queue(std::uint64_t rays, std::uint64_t pixels) const {
  Rays queue;
  queue.origins = PointArray(device_, rays, "reflected and refracted rays");
  queue.targets = PointArray(device_, rays, "reflected and refracted rays");
  queue.throughput = RealArray(device_, rays * bands_, "throughput of rays");
  queue.start = Array<std::uint32_t>(device_, pixels + 1, "rays of each pixel");
  return queue;
}

bool Reflector::send_on(const Rays& rays, const Array<std::uint32_t>& seen, std::uint32_t samples,
                        std::uint32_t pixels, Rays& next) {
  const auto from_camera = std::uint32_t(rays.from_camera);
  // Rays from the camera have neither throughput nor starts; any buffer stands in for them.
  const RawArray& throughput = from_camera ? static_cast<const RawArray&>(shares_) : rays.throughput;
  const RawArray& start = from_camera ? static_cast<const RawArray&>(seen) : rays.start;
  device_.run(reflect_kernels, "ask_for_rays", rays.count, rays.origins, seen, rays.count, surfaces_.polygons,
              kinds_, ior_, shares_, bands_, from_camera, throughput, counts_);
  allocate_into(device_, counts_.buffer(), rays.count, allocation_, "reflected and refracted rays");
  if (allocation_.total > capacity_) return false;
  next.count = allocation_.total;
  next.from_camera = false;
  if (next.count == 0) return true;
  device_.run(reflect_kernels, "send_rays_on", next.count, rays.origins, rays.targets, seen,
              surfaces_.polygons, places_.axes, places_.planes, kinds_, ior_, shares_, bands_, from_camera,
              throughput, box_, allocation_.owner, allocation_.rank, next.count, next.origins, next.targets,
              next.throughput);
  device_.run(reflect_kernels, "find_starts", std::uint64_t(pixels) + 1, from_camera, samples, start,
              allocation_.offsets, pixels, next.start);
  return true;
}

}  // namespace clrad
