#include "effects/uniform.hpp"

#include <algorithm>

#include "scene/enclosure.hpp"

namespace clrad {

bool is_uniform_enclosure(const Scene& scene) {
  if (scene.polygons.empty() || !scene.lights.empty()) return false;
  const Material& first = scene.materials[scene.polygons.front().material];
  const bool uniform = std::all_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& p) {
    const Material& m = scene.materials[p.material];
    return m.texture == no_texture && m.reflectance == first.reflectance &&
           m.emitted_exitance == first.emitted_exitance;
  });
  return uniform && find_enclosure(scene).closed;
}

}  // namespace clrad
