// The second pass: rays that mirrors and glass send on.
#pragma once
#include "clrad/primitives.hpp"
#include "render/render.hpp"

namespace clrad {

/// What a polygon does to a ray besides showing its own light (kernels/render/reflect.cl).
enum class SpecularKind : std::uint32_t { none = 0, mirror = 1, sheet = 2, solid = 3 };
/// Per polygon. Glass is a solid where its closed surface is glass all over, else a thin sheet.
std::vector<SpecularKind> specular_kinds(const Scene& scene);

/// Tables and scratch of the second pass over one scene.
class Reflector {
 public:
  /// `capacity`: most rays that one call may make. The surface tables and the camera's numbers are the caller's and
  /// outlive it.
  Reflector(Device& device, const SurfaceTables& surfaces, std::span<const OccluderTriangle> triangles,
            const Scene& scene, const Frame& frame, const RealArray& camera, std::uint64_t capacity);

  /// A queue with room for `rays` rays of `pixels` pixels.
  Rays queue(std::uint64_t rays, std::uint64_t pixels) const;

  /// Makes the rays that go on where `rays` ended, in their order; seen as from find_seen(). False, with `next` unchanged,
  /// when they are more than the capacity.
  bool send_on(const Rays& rays, const Array<std::uint32_t>& seen, std::uint32_t samples,
               std::uint32_t pixels, Rays& next);

  /// Bytes on the device for each of `capacity` rays.
  static std::uint64_t bytes_per_ray(Precision precision, std::uint32_t bands);

 private:
  Device& device_;
  const SurfaceTables& surfaces_;
  std::uint32_t bands_;
  std::uint64_t capacity_;
  PlaceTables places_;
  Array<std::uint32_t> kinds_;
  RealArray ior_, shares_, box_;
  Array<std::uint32_t> counts_;
  Allocation allocation_;
};

}  // namespace clrad
