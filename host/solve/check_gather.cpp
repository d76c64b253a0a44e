#include "solve/check_gather.hpp"

#include <cmath>
#include <utility>

#include "solve/nodes.hpp"
#include "solve/sensor.hpp"

namespace clrad {
std::vector<std::vector<double>> gather_for_check(Device& device, const Solution& solution,
                                                  VisibilityEngine& engine, std::span<const double> shot,
                                                  bool reflecting, std::span<const CheckGather> ways,
                                                  const Glass* glass, Lights* lights) {
  Surroundings around = surroundings_of(device, solution, {}, nullptr);
  const std::vector<double> nodes = node_radiosity(solution);
  const std::size_t count = around.patches + std::size_t(around.elements);
  // Rays find emitted + rho H, with H between the vertices; what is not shot yet is to be missing in that.
  std::vector<double> emitted, brightness(around.patches, 0.0);
  for (std::uint32_t b = 0; b < solution.bands; ++b)
    for (std::uint32_t p = 0; p < around.patches; ++p) {
      const double sent = shot[std::size_t(b) * around.patches + p];
      const double e = solution.material_of(solution.mesh.patches[p].polygon).emitted_exitance[b];
      emitted.push_back(e - (nodes[b * count + p] - sent));
      brightness[p] += sent;
    }
  // [0]: varying, [1]: as shot.
  const std::vector<double> sent(shot.begin(), shot.end());
  around.emitted[0] = RealArray(device, emitted, "emitted exitance");
  around.emitted[1] = RealArray(device, sent, "shot radiosity");
  for (std::size_t k = 0; k < 2; ++k) {
    around.radiosity[k] = RealArray(device, sent, "shot radiosity");
    around.brightness[k] = RealArray(device, brightness, "patch brightness");
  }
  Array<std::uint32_t> others(device, std::vector<std::uint32_t>(around.patches, 0u), "elements");
  bool reflects = true;
  std::vector<std::vector<double>> results;
  for (const CheckGather& check : ways) {
    Way way;
    way.rays = check.rays, way.seed = std::uint32_t(check.seed);
    way.without_lamps = check.flat || !reflecting;
    if (reflects == way.without_lamps) std::swap(around.reflects, others), reflects = !reflects;
    const std::uint64_t values = check.points->size() * solution.bands;
    RealArray irradiance(device, values, "irradiance at points"),
        error(device, values, "irradiance at points");
    gather_at(device, solution, around, *check.points, engine, way, glass, lights, irradiance, error,
              most_check_bytes);
    results.push_back(irradiance.download());
    if (lights) add_light_of(*lights, device, engine, *check.points, solution.bands, results.back());
  }
  return results;
}

std::vector<double> gather_of_patches(Device& device, const Solution& solution, VisibilityEngine& engine,
                                      std::span<const double> radiosity, const CheckGather& check,
                                      const Glass* glass) {
  Surroundings around = surroundings_of(device, solution, {}, nullptr);
  const std::vector<double> sent(radiosity.begin(), radiosity.end());
  std::vector<double> brightness(around.patches, 0.0);
  for (std::size_t i = 0; i < sent.size(); ++i) brightness[i % around.patches] += std::abs(sent[i]);
  around.emitted[1] = RealArray(device, sent, "unshot radiosity");
  around.radiosity[1] = RealArray(device, sent, "unshot radiosity");
  around.brightness[1] = RealArray(device, brightness, "patch brightness");
  around.reflects = Array<std::uint32_t>(device, std::vector<std::uint32_t>(around.patches, 0u), "elements");
  Way way;
  way.rays = check.rays, way.seed = std::uint32_t(check.seed), way.without_lamps = true;
  const std::uint64_t values = check.points->size() * solution.bands;
  RealArray irradiance(device, values, "irradiance at points"), error(device, values, "irradiance at points");
  gather_at(device, solution, around, *check.points, engine, way, glass, nullptr, irradiance, error,
            most_check_bytes);
  return irradiance.download();
}

}  // namespace clrad
