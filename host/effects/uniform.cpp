#include "effects/uniform.hpp"

#include <algorithm>

#include "scene/enclosure.hpp"

namespace clrad {

namespace {

// A plan is not to take a second, which the proof that a scene is closed would for 1e5 polygons.
constexpr std::size_t most_polygons = 20'000;

}  // namespace

bool is_uniform_enclosure(const Scene& scene) {
  if (scene.polygons.empty() || scene.polygons.size() > most_polygons || !scene.lights.empty()) return false;
  const Material& first = scene.materials[scene.polygons.front().material];
  const bool uniform = std::all_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    return m.texture == no_texture && m.reflectance == first.reflectance &&
           m.emitted_exitance == first.emitted_exitance;
  });
  return uniform && find_enclosure(scene).closed;
}

}  // namespace clrad
