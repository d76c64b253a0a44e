// Rounding of irradiate(), with u one rounding. Differences of positions are off by 2 u, r^2 and 1 / r by 7 u and 4 u more, the
// quotients by 4 u, intensities and the sum over lights by 3 u: 20 u of H. The cosine is off by up to 8 u absolutely (the
// normal's and the differences' rounding, products and sums), and one below 8 u is taken as 0: 16 u of I / r^2. A spot's ramp is off by 10 u
// times its slope s, so its square by 20 u s.
#include "solve/lights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/primitives.hpp"
#include "device/grow.hpp"
#include "solve/state.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* lights_kernels = "solve/lights.cl";
constexpr const char* lights_stage = "light from point, spot and directional lights";
constexpr std::size_t light_size = 15;  // CLRAD_LIGHT_SIZE

// 1 / (cos inner - cos outer), at most the largest number that one rounding of a cosine makes sense of.
double ramp_slope(const PunctualLight& light) {
  constexpr double sharpest = 0x1p23;
  const double width = std::cos(light.inner_cone_rad) - std::cos(light.outer_cone_rad);
  return width * sharpest > 1 ? 1 / width : sharpest;
}

// The first polygon that the light lies on, within the rounding of the visibility grid; of two back to back the one that faces the way
// the light shines.
std::uint32_t polygon_under(const Scene& scene, const Frame& frame, const PunctualLight& light) {
  const double touching = std::ldexp(1.0, -34);
  const glm::dvec3 position = frame.to_frame(light.position_m);
  std::uint32_t found = 0xffffffffu;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
    const Polygon& polygon = scene.polygons[p];
    const glm::dvec3 n = polygon.normal();
    if (std::abs(glm::dot(position - frame.to_frame(polygon.corner[0]), n)) > touching) continue;
    bool inside = true;
    for (std::uint32_t k = 0; k < polygon.corners; ++k) {
      const glm::dvec3 a = frame.to_frame(polygon.corner[k]),
                       b = frame.to_frame(polygon.corner[(k + 1) % polygon.corners]);
      inside &= glm::dot(glm::cross(b - a, position - a), n) >= -touching * glm::length(b - a);
    }
    if (!inside) continue;
    if (light.kind != PunctualLight::Kind::spot || glm::dot(light.direction, n) > 0) return p;
    if (found == 0xffffffffu) found = p;
  }
  return found;
}

// Area means of [band][vertex] values, into [band][patch] ones.
void average_over_patches(SolveState& state, const RealArray& vertex, RealArray& patch) {
  const std::uint64_t real = vertex.bytes() / vertex.size();
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    state.device.copy(vertex.buffer(), state.column.buffer(), state.vertices * real,
                      b * state.vertices * real);
    state.gatherer->gather(state.column, patch, std::uint64_t(b) * state.patches);
  }
}

void irradiate_vertices(SolveState& state, std::uint32_t first) {
  LitByLights& direct = *state.direct;
  RealArray lost(state.device, direct.vertex.size(), "light from lights");
  lost.fill_zero();
  direct.lights.irradiate(state.engine, state.receivers, &state.covered, first, state.vertices - first,
                          direct.vertex, lost, state.vertices, false, first == 0 ? &direct.reaches : nullptr);
}

// state.patch_emitted is what patches emit of their own.
void reflect_direct(SolveState& state) {
  if (!state.interreflection) return;
  LitByLights& direct = *state.direct;
  state.device.run(lights_kernels, "reflect_direct", direct.patch.size(), direct.patch, state.patch_rho,
                   state.patch_emitted, std::uint32_t(direct.patch.size()));
}

}  // namespace

Lights::Lights(Device& device, const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes,
               const Glass* glass)
    : device_(device),
      bands_(std::uint32_t(scene.bands.size())),
      frame_(frame),
      lights_(scene.lights),
      glass_(glass) {
  if (!lights_.empty()) upload(planes, scene, frame);
}

void Lights::upload(std::span<const std::uint32_t> planes, const Scene& scene, const Frame& frame) {
  std::vector<double> records, intensities;
  const auto add = [&](const glm::dvec3& v) { records.insert(records.end(), {v.x, v.y, v.z}); };
  const bool doubles = device_.options().precision == Precision::float64;
  for (const PunctualLight& light : lights_) {
    const bool directional = light.kind == PunctualLight::Kind::directional;
    const glm::dvec3 at = directional ? glm::dvec3(0) : frame.to_frame(light.position_m);
    const glm::dvec3 hi = doubles ? at : glm::dvec3(float(at.x), float(at.y), float(at.z));
    Point point{at, {0, 0, 1}};
    glm::dvec3 behind(0);
    if (const std::uint32_t p = directional ? 0xffffffffu : polygon_under(scene, frame, light);
        p != 0xffffffffu) {
      point.plane = planes[p];
      behind = scene.polygons[p].normal();
      on_surfaces_.push_back(light.name);
    }
    records.push_back(double(light.kind));
    add(hi), add(at - hi), add(light.direction);
    records.push_back(std::cos(light.outer_cone_rad));
    records.push_back(ramp_slope(light));
    add(behind);
    for (const double i : light.intensity)
      intensities.push_back(directional ? i : i / (frame.metres() * frame.metres()));
    points_.push_back(directional ? PointArray() : PointArray(device_, std::span(&point, 1), "a light"));
  }
  records_ = RealArray(device_, records, "lights");
  intensities_ = RealArray(device_, intensities, "intensities of lights");
}

bool Lights::any_directional() const {
  return std::any_of(lights_.begin(), lights_.end(),
                     [](const PunctualLight& l) { return l.kind == PunctualLight::Kind::directional; });
}

void Lights::irradiate(VisibilityEngine& engine, const PointArray& receivers,
                       const Array<std::uint32_t>* covered, std::uint32_t first, std::uint32_t count,
                       RealArray& irradiance, RealArray& lost, std::uint64_t stride, bool only_directional,
                       std::vector<bool>* reaches) {
  if (reaches) reaches->assign(lights_.size(), false);
  if (lights_.empty() || count == 0) return;
  grow(factors_, device_, count, "light from a light"), grow(flags_, device_, count, "lit receivers");
  grow(active_, device_, count, "lit receivers"), grow(masks_, device_, count, "visibility masks");
  for (std::uint32_t l = 0; l < lights_.size(); ++l) {
    const bool directional = lights_[l].kind == PunctualLight::Kind::directional;
    if (only_directional && !directional) continue;
    device_.run(lights_kernels, "light_factors", count, records_, l, receivers, covered ? *covered : flags_,
                std::uint32_t(covered != nullptr), factors_, flags_, first, count);
    const std::uint32_t lit = compact(device_, flags_.buffer(), count, active_.buffer());
    if (lit == 0) continue;
    if (first > 0) device_.run(lights_kernels, "number_lit", lit, active_, first, lit);
    if (directional) {
      grow(ends_, device_, receivers.size(), "ends of rays");
      device_.run(lights_kernels, "far_ends", lit, records_, l, receivers, active_, ends_, lit);
    }
    const Segments rays{&receivers, &active_, lit, directional ? &ends_ : &points_[l], directional ? 0u : 1u};
    engine.occluded(rays, masks_);
    const auto add = [&](const RealArray* passes, std::uint32_t begin, std::uint32_t end) {
      device_.run(lights_kernels, "add_light", end - begin, active_, masks_, factors_, intensities_, l,
                  std::uint32_t(passes != nullptr), passes ? *passes : factors_,
                  glass_ ? glass_->colours() : 1u, irradiance, lost, first, stride, bands_, begin,
                  end - begin);
    };
    if (!glass_) {
      add(nullptr, 0, lit);
    } else if (directional) {
      const RealArray passes = glass_->pass_pairs(rays, masks_);
      add(&passes, 0, lit);
    } else {
      glass_->pass(rays, masks_, [&](const RealArray& passes, std::uint32_t begin, std::uint32_t end) {
        add(&passes, begin, end);
      });
    }
    if (!reaches) continue;
    const std::vector<std::uint32_t> masks = masks_.download(0, lit);
    (*reaches)[l] = std::any_of(masks.begin(), masks.end(), [](std::uint32_t m) { return (m & 1) == 0; });
  }
}

std::vector<double> Lights::bound(const glm::dvec3& position_frame, std::span<const double> irradiance,
                                  double unit) const {
  std::vector<double> bound;
  for (const double h : irradiance) bound.push_back(20 * unit * h);
  for (const PunctualLight& light : lights_) {
    double squarely = 1;
    if (light.kind != PunctualLight::Kind::directional) {
      const glm::dvec3 r = (frame_.to_frame(light.position_m) - position_frame) * frame_.metres();
      squarely = 1 / glm::dot(r, r);
    }
    const double slope = light.kind == PunctualLight::Kind::spot ? ramp_slope(light) : 0;
    for (std::size_t b = 0; b < bound.size(); ++b)
      bound[b] += (16 + 20 * slope) * unit * light.intensity[b] * squarely;
  }
  return bound;
}

LitByLights::LitByLights(SolveState& state, const Frame& frame, std::span<const std::uint32_t> planes)
    : lights(state.device, state.scene, frame, planes, state.glass),
      vertex(state.device, std::uint64_t(state.bands) * state.vertices, "light from lights"),
      patch(state.device, std::uint64_t(state.bands) * state.patches, "light from lights") {
  vertex.fill_zero();
}

void light_first(SolveState& state) {
  if (!state.direct) return;
  const auto stage = state.device.stage(lights_stage);
  LitByLights& direct = *state.direct;
  irradiate_vertices(state, 0);
  average_over_patches(state, direct.vertex, direct.patch);
  state.device.run(lights_kernels, "add_direct", direct.vertex.size(), direct.vertex, state.vertex_irradiance,
                   0u, state.vertices, state.bands);
  state.device.run(lights_kernels, "add_direct", direct.patch.size(), direct.patch, state.patch_irradiance,
                   0u, state.patches, state.bands);
  reflect_direct(state);
  state.device.copy(state.patch_emitted.buffer(), state.unshot.buffer(), state.unshot.bytes());
  // Of a light outside of a room only what comes in matters to convergence, so that counts.
  const std::vector<double> arrives = direct.patch.download();
  double power = 0;
  for (std::size_t i = 0; i < arrives.size(); ++i)
    power += state.mesh.patches[i % state.patches].area_m2 * arrives[i];
  state.emitted_power += power;
}

void light_resumed(SolveState& state) {
  if (!state.direct) return;
  const auto stage = state.device.stage(lights_stage);
  average_over_patches(state, state.direct->vertex, state.direct->patch);
  reflect_direct(state);
}

void light_new(SolveState& state, std::uint32_t first, const Array<std::uint32_t>* parents) {
  if (!state.direct) return;
  const auto stage = state.device.stage(lights_stage);
  LitByLights& direct = *state.direct;
  RealArray grown(state.device, std::uint64_t(state.bands) * state.vertices, "light from lights");
  grown.fill_zero();
  const std::uint64_t real = grown.bytes() / grown.size();
  for (std::uint32_t b = 0; b < state.bands; ++b)
    state.device.copy(direct.vertex.buffer(), grown.buffer(), first * real, b * first * real,
                      b * state.vertices * real);
  state.device.finish();
  direct.vertex = std::move(grown);
  if (parents)
    state.device.run(lights_kernels, "interpolate_direct", state.vertices - first, direct.vertex, *parents,
                     first, state.vertices, state.bands);
  else
    irradiate_vertices(state, first);
  average_over_patches(state, direct.vertex, direct.patch);
  state.device.run(lights_kernels, "add_direct", std::uint64_t(state.vertices - first) * state.bands,
                   direct.vertex, state.vertex_irradiance, first, state.vertices, state.bands);
  reflect_direct(state);
}

void add_direct_to_patches(SolveState& state) {
  if (!state.direct) return;
  const auto stage = state.device.stage(lights_stage);
  state.device.run(lights_kernels, "add_direct", state.direct->patch.size(), state.direct->patch,
                   state.patch_irradiance, 0u, state.patches, state.bands);
}

void hold_direct(SolveState& state) {
  if (!state.direct) return;
  const auto stage = state.device.stage(lights_stage);
  state.device.run(lights_kernels, "hold_direct", state.vertices, state.direct->vertex, state.vertex_row_sum,
                   state.vertex_irradiance, state.vertices, state.bands);
}

void warn_of_lights(const LitByLights& direct, std::vector<std::string>& warnings) {
  for (const std::string& name : direct.lights.on_surfaces())
    warnings.push_back(fmt::format(
        "light \"{}\" lies on a surface; it is taken to be just in front of it, and does not light its plane",
        name));
  for (std::size_t l = 0; l < direct.reaches.size(); ++l)
    if (!direct.reaches[l])
      warnings.push_back(
          fmt::format("light \"{}\" reaches no front of a surface: is it shut in, or does it shine past all?",
                      direct.lights.lights()[l].name));
}

std::vector<double> emitted_by_lights(SolveState& state) {
  std::vector<double> power(state.bands, 0);
  if (!state.direct) return power;
  Lights& lights = state.direct->lights;
  for (const PunctualLight& light : lights.lights())
    for (std::uint32_t b = 0; b < state.bands; ++b) power[b] += light.solid_angle_sr() * light.intensity[b];
  if (!lights.any_directional()) return power;
  const auto stage = state.device.stage(lights_stage);
  const std::uint64_t count = std::uint64_t(state.bands) * state.vertices;
  RealArray vertex(state.device, count, "light from lights"), lost(state.device, count, "light from lights"),
      patch(state.device, state.direct->patch.size(), "light from lights");
  vertex.fill_zero(), lost.fill_zero();
  lights.irradiate(state.engine, state.receivers, &state.covered, 0, state.vertices, vertex, lost,
                   state.vertices, true);
  average_over_patches(state, vertex, patch);
  const std::vector<double> arrives = patch.download();
  for (std::size_t i = 0; i < arrives.size(); ++i)
    power[i / state.patches] += state.mesh.patches[i % state.patches].area_m2 * arrives[i];
  return power;
}

}  // namespace clrad
