#include "effects/colour.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effects/effects.hpp"
#include "output/tone.hpp"

namespace clrad {
namespace {

constexpr double proportional = 4 * 0x1p-53;

bool all_equal(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [&](double v) { return v == values.front(); });
}

// The same in all bands, [row][column][band].
bool is_grey(const Texture& texture, std::size_t bands) {
  for (std::size_t i = 0; i < texture.texels.size(); ++i)
    if (texture.texels[i] != texture.texels[i - i % bands]) return false;
  return true;
}

// One number a texel: of its bands what `of` makes of them.
template <class Of>
void narrow(Texture& texture, std::size_t bands, Of of) {
  const std::size_t texels = texture.texels.size() / bands;
  for (std::size_t i = 0; i < texels; ++i) texture.texels[i] = float(of(texture.texels.data() + i * bands));
  texture.texels.resize(texels);
}

std::size_t strongest(const std::vector<double>& factors) {
  return std::size_t(std::find(factors.begin(), factors.end(), 1.0) - factors.begin());
}

std::vector<double> times(double value, const std::vector<double>& factors) {
  std::vector<double> all;
  all.reserve(factors.size());
  for (const double f : factors) all.push_back(f * value);
  return all;
}

// [1][n] -> [band][n].
std::vector<double> rows(const std::vector<double>& values, const std::vector<double>& factors) {
  std::vector<double> all;
  all.reserve(values.size() * factors.size());
  for (const double f : factors)
    for (const double v : values) all.push_back(f * v);
  return all;
}

void spread(std::vector<double>& one, const std::vector<double>& factors) {
  one = one.empty() ? one : times(one.front(), factors);
}

}  // namespace

std::vector<double> band_factors(const Scene& scene) {
  const std::size_t bands = scene.bands.size();
  std::vector<const Material*> used;
  for (const Polygon& p : scene.polygons) used.push_back(&scene.materials[p.material]);
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<double> sum(bands, 0);
  for (const Material* m : used) {
    if (!all_equal(m->reflectance) || !all_equal(m->transmission)) return {};
    if (m->texture != no_texture && !is_grey(scene.textures[m->texture], bands)) return {};
    for (std::size_t b = 0; b < bands; ++b) sum[b] = std::max(sum[b], m->emitted_exitance[b]);
  }
  for (const PunctualLight& l : scene.lights)
    for (std::size_t b = 0; b < bands; ++b) sum[b] = std::max(sum[b], l.intensity[b]);
  const auto best = std::size_t(std::max_element(sum.begin(), sum.end()) - sum.begin());
  const double most = sum[best];
  std::vector<double> factors(bands, 1);
  if (most > 0)
    for (std::size_t b = 0; b < bands; ++b) factors[b] = sum[b] / most;
  const auto follows = [&](const std::vector<double>& emission) {
    for (std::size_t b = 0; b < bands; ++b) {
      const double expected = factors[b] * emission[best];
      if (!(std::abs(emission[b] - expected) <= proportional * expected)) return false;
    }
    return true;
  };
  for (const Material* m : used)
    if (!follows(m->emitted_exitance)) return {};
  for (const PunctualLight& l : scene.lights)
    if (!follows(l.intensity)) return {};
  return factors;
}

Scene one_band(const Scene& scene, const std::vector<double>& factors) {
  const std::size_t best = strongest(factors);
  const auto keep = [&](std::vector<double>& values) {
    if (!values.empty()) values = {values[best]};
  };
  Scene one = scene;
  one.bands = {scene.bands[best]};
  for (Material& m : one.materials)
    keep(m.reflectance), keep(m.emitted_exitance), keep(m.specular), keep(m.transmission);
  for (PunctualLight& l : one.lights) keep(l.intensity);
  for (Texture& t : one.textures)
    narrow(t, scene.bands.size(), [&](const float* bands) { return bands[best]; });
  return one;
}

Scene without_colour(const Scene& scene) {
  const auto mean = [&](std::vector<double>& values) {
    if (values.empty()) return;
    const std::vector<float> bands(values.begin(), values.end());
    values = {luminance(bands.data(), unsigned(bands.size()))};
  };
  Scene grey = scene;
  grey.bands = {"grey"};
  for (Material& m : grey.materials)
    mean(m.reflectance), mean(m.emitted_exitance), mean(m.specular), mean(m.transmission);
  for (PunctualLight& l : grey.lights) mean(l.intensity);
  const auto bands = unsigned(scene.bands.size());
  for (Texture& t : grey.textures)
    narrow(t, bands, [&](const float* values) { return luminance(values, bands); });
  return grey;
}

void spread_over_bands(Solution& solution, const Scene& scene, const std::vector<double>& factors) {
  solution.scene = scene;
  solution.bands = std::uint32_t(factors.size());
  solution.vertex_irradiance = rows(solution.vertex_irradiance, factors);
  solution.patch_irradiance = rows(solution.patch_irradiance, factors);
  const std::vector<double> same(factors.size(), 1);
  for (auto* means : {&solution.textured.element, &solution.textured.patch, &solution.textured.vertex})
    *means = rows(*means, same);
  spread(solution.ambient, factors);
  for (SensorResult& s : solution.sensors) spread(s.irradiance, factors), spread(s.irradiance_error, factors);
  auto& energy = solution.report.energy;
  for (auto* e : {&energy.emitted, &energy.absorbed, &energy.unshot, &energy.unaccounted})
    spread(*e, factors);
  // Estimates are root mean squares over all values by the mean of all: bands that differ have the larger ones.
  double sum = 0, squares = 0;
  for (const double f : factors) sum += f, squares += f * f;
  const double scale = sum > 0 ? std::sqrt(squares * double(factors.size())) / sum : 1;
  auto& error = solution.report.error;
  error.total_relative *= scale, error.sensors_relative *= scale;
  for (auto* parts : {&error.parts, &error.sensor_parts})
    for (ErrorPart& part : *parts)
      if (!part.bound) part.relative *= scale;
}

Effect plan_colour(const Scene& scene, const SolveOptions&) {
  Effect effect;
  const std::size_t bands = scene.bands.size();
  if (bands == 1) {
    effect.needed = false;
    effect.skip_error_relative = 0;
    effect.reason = "no surface or light is coloured: one band says it all";
    return effect;
  }
  const std::vector<double> factors = band_factors(scene);
  effect.needed = factors.empty();
  if (effect.needed) {
    effect.reason = fmt::format("surfaces reflect, or lights emit, differently in the {} bands", bands);
    return effect;
  }
  const bool alike = all_equal(factors);
  effect.skip_error_relative = alike ? 0 : proportional;  // rounding apart
  effect.reason = alike
                      ? fmt::format("the {} bands are alike: one is solved", bands)
                      : fmt::format(
                            "all surfaces reflect the same in the {} bands and all light has one colour: one "
                            "band is solved and scaled",
                            bands);
  return effect;
}

}  // namespace clrad
