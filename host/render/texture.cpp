// Textures in pictures: where a ray meets one, the light there times the texture's own reflectance.
#include "render/texture.hpp"

namespace clrad {

PictureTextures::PictureTextures(Device& device, const Scene& scene)
    : device_(device), bands_(std::uint32_t(scene.bands.size())) {
  const auto stage = device.stage(stage_name);
  std::vector<const Texture*> textures;
  for (const Texture& t : scene.textures) textures.push_back(&t);
  textures_ = textures_on_device(device, textures, bands_);
  std::vector<std::uint32_t> texture_of;
  std::vector<double> uv, factor, exitance;
  for (const Polygon& p : scene.polygons) {
    const Material& m = scene.materials[p.material];
    texture_of.push_back(m.texture);
    for (const glm::dvec2& c : p.uv) uv.insert(uv.end(), {c.x, c.y});
    factor.insert(factor.end(), m.reflectance.begin(), m.reflectance.end());
    exitance.insert(exitance.end(), m.emitted_exitance.begin(), m.emitted_exitance.end());
  }
  texture_of_ = Array<std::uint32_t>(device, texture_of, "the picture's textures");
  uv_ = RealArray(device, uv, "the picture's textures");
  factor_ = RealArray(device, factor, "the picture's textures");
  exitance_ = RealArray(device, exitance, "the picture's textures");
}

void PictureTextures::apply(const SurfaceTables& surfaces, const Rays& rays, const Array<std::uint32_t>& seen,
                            Array<float>& shown) const {
  const auto stage = device_.stage(stage_name);
  device_.run("render/texture.cl", "texture_rays", rays.count, rays.origins, rays.targets, seen, rays.count,
              surfaces.polygons, texture_of_, uv_, textures_.textures, textures_.texels, factor_, exitance_,
              bands_, shown);
}

}  // namespace clrad
