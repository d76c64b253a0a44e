#include "solve/shooter.hpp"

namespace clrad {

Shooter shooter_of(const Scene& scene, const Mesh& mesh, std::uint32_t patch, double metres_per_unit) {
  const Patch& p = mesh.patches[patch];
  Shooter shooter;
  shooter.corners = p.corners;
  for (std::uint32_t k = 0; k < p.corners; ++k) shooter.corner[k] = p.corner[k];
  shooter.normal = scene.polygons[p.polygon].normal();
  shooter.area = p.area_m2 / (metres_per_unit * metres_per_unit);
  shooter.plane = mesh.receivers[mesh.polygons[p.polygon].first_vertex].plane;
  return shooter;
}

std::uint32_t samples_of(const SolveState& state, std::uint32_t patch) {
  std::uint32_t n = std::max(1u, state.options.samples);
  const Patch& p = state.mesh.patches[patch];
  const Material& material = state.scene.materials[state.scene.polygons[p.polygon].material];
  double power = 0;
  for (std::uint32_t b = 0; b < state.bands; ++b) power += p.area_m2 * material.emitted_exitance[b];
  constexpr std::uint32_t most = 4096;
  // A lamp that gives all the light has exactly 1/N of it at N rays, up to the rounding of the sum over its patches, which
  // differs from mesh to mesh and must not decide between N and 4 N.
  constexpr double rounding = 1 + 1e-6;
  while (n < most && power * state.options.light_samples > rounding * state.emitted_power * n) n *= 4;
  return n;
}

std::vector<Point> samples_on(const Shooter& shooter, std::uint32_t patch, std::uint32_t n,
                              std::uint64_t seed) {
  constexpr std::uint64_t golden_ratio = 0x9e3779b97f4a7c15u;
  return stratified_samples(shooter, n, seed + golden_ratio * (patch + 1));
}

}  // namespace clrad
