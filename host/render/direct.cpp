#include <algorithm>
#include <glm/geometric.hpp>
#include <memory>
#include <optional>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "render/render.hpp"
#include "solve/form_factor.hpp"
#include "solve/lights.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* direct_kernels = "render/direct.cl";
constexpr std::uint64_t seed = 1;  // of the samples' places on the lights

Shooter light_of(const Polygon& polygon, const Frame& frame, std::uint32_t plane) {
  Shooter light;
  light.corners = polygon.corners;
  for (std::uint32_t k = 0; k < polygon.corners; ++k) light.corner[k] = frame.to_frame(polygon.corner[k]);
  light.normal = polygon.normal();
  light.area = polygon.area_m2() * frame.scale() * frame.scale();
  light.plane = plane;
  return light;
}

class DirectLight {
 public:
  DirectLight(Device& device, VisibilityEngine& engine, const SurfaceTables& surfaces,
              std::span<const OccluderTriangle> triangles, const Scene& scene, const Frame& frame,
              std::uint32_t samples)
      : device_(device),
        engine_(&engine),
        surfaces_(surfaces),
        bands_(std::uint32_t(scene.bands.size())),
        samples_(samples),
        places_(place_tables(device, triangles, scene, frame)) {
    if (!glass_polygons(scene).empty()) {
      behind_glass_ = make_engine("shaft", device, without_glass(scene, triangles));
      engine_ = behind_glass_.get();
      glass_ = std::make_unique<Glass>(device, scene, triangles);
      colours_ = glass_->colours();
    }
    std::vector<std::uint32_t> planes(scene.polygons.size(), 0xffffffffu);
    for (const auto& t : triangles) planes[t.polygon] = t.plane;
    for (std::size_t p = 0; p < scene.polygons.size(); ++p)
      if (scene.polygons[p].back) planes[p] = planes[p - 1];
    std::vector<double> exitance, reflectance, light_exitance;
    for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
      const Material& m = scene.materials[scene.polygons[p].material];
      // Of a texture only the light that arrives is found here; see kernels/render/texture.cl.
      const bool textured = m.texture != no_texture;
      for (std::uint32_t b = 0; b < bands_; ++b) {
        exitance.push_back(textured ? 0 : m.emitted_exitance[b]);
        reflectance.push_back(textured ? 1 : m.reflectance[b]);
      }
      if (std::none_of(m.emitted_exitance.begin(), m.emitted_exitance.end(), [](double e) { return e > 0; }))
        continue;
      light_exitance.insert(light_exitance.end(), m.emitted_exitance.begin(), m.emitted_exitance.end());
      const Shooter light = light_of(scene.polygons[p], frame, planes[p]);
      lights_.push_back(
          {light, PointArray(device, stratified_samples(light, samples, seed + p), "samples on lights")});
    }
    exitance_ = RealArray(device, exitance, "emitted exitance");
    reflectance_ = RealArray(device, reflectance, "reflectance");
    if (!scene.lights.empty()) punctual_.emplace(device, scene, frame, planes, glass_.get());
    if (!lights_.empty()) light_exitance_ = RealArray(device, light_exitance, "the lights' exitance");
  }

  void shade(const Rays& rays, const Array<std::uint32_t>& seen, Array<float>& shown) {
    grow(flags_, device_, rays.count, "lit points"), grow(lit_, device_, rays.count, "lit points");
    device_.run(direct_kernels, "start_direct", rays.count, rays.origins, rays.targets, seen, rays.count,
                surfaces_.polygons, exitance_, reflectance_, bands_, shown, flags_);
    if (lights_.empty() && !punctual_) return;
    const std::uint32_t count = compact(device_, flags_.buffer(), rays.count, lit_.buffer());
    if (count == 0) return;
    grow(receivers_, device_, count, "lit points"), grow(active_, device_, count, "lit points");
    grow(factors_, device_, count, "lit points"),
        grow(column_, device_, std::uint64_t(colours_) * count, "lit points");
    device_.run(direct_kernels, "place_receivers", count, rays.origins, rays.targets, seen, lit_, count,
                surfaces_.polygons, places_.axes, places_.planes, receivers_);
    for (std::uint32_t light = 0; light < lights_.size(); ++light) {
      find_column(lights_[light], count);
      device_.run(direct_kernels, "add_light", count, seen, lit_, count, column_, column_.size() / colours_,
                  colours_, light_exitance_, light, reflectance_, bands_, shown);
    }
    if (punctual_) add_punctual(seen, count, shown);
  }

  std::uint64_t bytes_per_ray(Precision precision, std::uint32_t samples) const {
    const bool wide = precision == Precision::float64;
    return (wide ? 88 : 48) + (1 + colours_) * (wide ? 8 : 4) + 3 * 4 + 4 * ((samples + 31) / 32);
  }

 private:
  struct Light {
    Shooter shooter;
    PointArray samples;
  };

  void add_punctual(const Array<std::uint32_t>& seen, std::uint32_t count, Array<float>& shown) {
    const auto stage = device_.stage("light from point, spot and directional lights");
    const std::uint64_t values = std::uint64_t(bands_) * count;
    RealArray irradiance(device_, values, "light from lights"), lost(device_, values, "light from lights");
    irradiance.fill_zero(), lost.fill_zero();
    punctual_->irradiate(*engine_, receivers_, nullptr, 0, count, irradiance, lost, count);
    device_.run(direct_kernels, "add_irradiance", count, seen, lit_, count, irradiance, reflectance_, bands_,
                shown);
  }

  // column_ = form factor x visible fraction of the light (x what glass lets pass, [colour][receiver]) at each receiver.
  void find_column(const Light& light, std::uint32_t count) {
    column_.fill_zero();
    facing(device_, light.shooter, receivers_, 0, count, flags_);
    const std::uint32_t active = compact(device_, flags_.buffer(), count, active_.buffer());
    if (active == 0) return;
    const Segments segments{&receivers_, &active_, active, &light.samples, samples_};
    grow(masks_, device_, std::uint64_t(active) * segments.words_per_origin(), "visibility masks");
    engine_->occluded(segments, masks_);
    form_factors(device_, Estimator::exact, light.shooter, receivers_, &active_, active, light.samples,
                 samples_, factors_);
    visible_factors(device_, *engine_, Estimator::exact, light.shooter, receivers_, &active_, active,
                    light.samples, samples_, masks_, factors_, column_, glass_.get());
  }

  Device& device_;
  VisibilityEngine* engine_;
  std::unique_ptr<VisibilityEngine> behind_glass_;  // of what is opaque, in scenes with glass
  std::unique_ptr<Glass> glass_;
  std::uint32_t colours_ = 1;
  const SurfaceTables& surfaces_;
  std::uint32_t bands_, samples_;
  PlaceTables places_;
  std::vector<Light> lights_;
  std::optional<Lights> punctual_;
  RealArray exitance_, reflectance_, light_exitance_, factors_, column_;
  PointArray receivers_;
  Array<std::uint32_t> flags_, lit_, active_, masks_;
};

}  // namespace

Shading direct_shading(Device& device, VisibilityEngine& engine, const SurfaceTables& tables,
                       std::span<const OccluderTriangle> triangles, const Scene& scene, const Frame& frame,
                       std::uint32_t light_samples) {
  const auto direct =
      std::make_shared<DirectLight>(device, engine, tables, triangles, scene, frame, light_samples);
  return {[direct](const Rays& rays, const Array<std::uint32_t>& seen, Array<float>& shown) {
            direct->shade(rays, seen, shown);
          },
          direct->bytes_per_ray(device.options().precision, light_samples)};
}

}  // namespace clrad
