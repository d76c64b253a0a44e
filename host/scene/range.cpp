#include "scene/range.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>
#include <limits>
#include <numbers>

#include "clrad/error.hpp"
#include "clrad/frame.hpp"

namespace clrad {
namespace {

using Severity = Diagnostic::Severity;

// What the light brings to a surface at one frame unit is held to the limits of what surfaces emit, as are its powers then.
void check_lights(const Scene& scene, std::vector<Diagnostic>& findings) {
  const Frame frame = frame_of(scene);
  const double unit = frame.metres() * frame.metres();
  for (const PunctualLight& light : scene.lights) {
    const bool directional = light.kind == PunctualLight::Kind::directional;
    for (const double intensity : light.intensity) {
      const double there = directional ? intensity : intensity / unit;
      if (intensity == 0 || (there >= smallest_exitance && there <= largest_exitance)) continue;
      findings.push_back(
          {Severity::error, "light-intensity", light.where,
           fmt::format(
               "its light has intensity {:.3g}; in a scene of this size clrad solves 0 and from {:.2g} "
               "to {:.2g}; is --unit right?",
               intensity, smallest_exitance * (directional ? 1 : unit),
               largest_exitance * (directional ? 1 : unit))});
      break;
    }
    const glm::dvec3 at = glm::abs(frame.to_frame(light.position_m));
    if (!directional && !(std::max({at.x, at.y, at.z}) <= farthest_light))
      findings.push_back({Severity::error, "light-position", light.where,
                          fmt::format("its light is more than {:.3g} m from the middle of the scene; a "
                                      "directional light shines from that far; is --unit right?",
                                      farthest_light * frame.metres())});
  }
}

}  // namespace

void check_range(const Scene& scene, std::vector<Diagnostic>& findings) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  glm::dvec3 low(infinite), high(-infinite);
  const Polygon* furthest = nullptr;  // the one to look at first
  double distance = -1;
  for (const Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k) {
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
      const glm::dvec3 size = glm::abs(p.corner[k]);
      if (const double far = std::max({size.x, size.y, size.z}); far > distance)
        distance = far, furthest = &p;
    }
  const glm::dvec3 size = high - low;
  const double extent = std::max({size.x, size.y, size.z});
  if (furthest && !(extent >= smallest_extent_m && extent <= largest_extent_m))
    findings.push_back(
        {Severity::error, "extent", furthest->where,
         fmt::format("the scene measures {:.3g} m, and clrad solves from {} to {} m; is --unit "
                     "right, and does this polygon belong to it?",
                     extent, smallest_extent_m, largest_extent_m)});
  for (const Material& m : scene.materials) {
    const auto bad = std::find_if(m.emitted_exitance.begin(), m.emitted_exitance.end(), [](double e) {
      return e != 0 && !(e >= smallest_exitance && e <= largest_exitance);
    });
    if (bad == m.emitted_exitance.end()) continue;
    findings.push_back({Severity::error, "emission", m.where,
                        fmt::format("material \"{}\" has radiance {:.3g}, and clrad solves 0 and from {:.2g} "
                                    "to {:.2g}; choose other units of power",
                                    m.name, *bad / std::numbers::pi, smallest_exitance / std::numbers::pi,
                                    largest_exitance / std::numbers::pi)});
  }
  check_lights(scene, findings);
}

void require_range(const Scene& scene) {
  std::vector<Diagnostic> findings;
  check_range(scene, findings);
  if (!findings.empty()) throw InputError(findings.front().where.text() + ": " + findings.front().message);
}

void require_sensors_near(const Scene& scene, const std::vector<Sensor>& sensors, const std::string& file) {
  // The frame grows by powers of two to hold the farthest one, and visibility is decided on a grid of 2^-38 of it: here the
  // scene still spans 32 of its cells.
  constexpr double reach = 0x1p33;
  const Frame frame = frame_of(scene);
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const glm::dvec3 at = glm::abs(frame.to_frame(sensors[i].position_m));
    if (std::max({at.x, at.y, at.z}) <= reach) continue;
    const glm::dvec3& p = sensors[i].position_m;
    throw InputError(fmt::format(
        "{}{}sensor {} at ({:.6g}, {:.6g}, {:.6g}) m is more than {:.3g} m from the middle of the scene; is "
        "--unit right?",
        file, file.empty() ? "" : ": ", i + 1, p.x, p.y, p.z, reach * frame.metres()));
  }
}

}  // namespace clrad
