// Textures in pictures.
#pragma once
#include "mesh/texture.hpp"
#include "render/render.hpp"

namespace clrad {

/// All textures of a scene on the device, and which polygon has which.
class PictureTextures {
 public:
  PictureTextures(Device& device, const Scene& scene);

  /// shown[ray][band]: from irradiance to radiosity where a ray has met a texture (kernels/render/texture.cl).
  void apply(const SurfaceTables& surfaces, const Rays& rays, const Array<std::uint32_t>& seen,
             Array<float>& shown) const;

 private:
  static constexpr const char* stage_name = "sample textures in the picture";
  Device& device_;
  std::uint32_t bands_;
  DeviceTextures textures_;
  Array<std::uint32_t> texture_of_;
  RealArray uv_, factor_, exitance_;
};

}  // namespace clrad
