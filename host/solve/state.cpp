#include "solve/state.hpp"

#include <algorithm>
#include <cmath>

#include "solve/covered.hpp"

namespace clrad {

SolveState::SolveState(Device& device_, const Scene& scene_, const Mesh& mesh_, std::uint32_t bands_,
                       VisibilityEngine& engine_, const SolveOptions& options_,
                       const std::vector<std::uint8_t>& covered_, double metres_per_unit_)
    : device(device_),
      scene(scene_),
      mesh(mesh_),
      bands(bands_),
      patches(std::uint32_t(mesh_.patches.size())),
      vertices(mesh_.vertex_count()),
      engine(engine_),
      options(options_),
      metres_per_unit(metres_per_unit_),
      receivers(device_, mesh_.receivers, "receivers"),
      covered(device_, std::vector<std::uint32_t>(covered_.begin(), covered_.end()), "covered vertices"),
      gatherer(device_, mesh_),
      exposed(exposed_shares(mesh_, covered_)),
      patch_area(device_, patches, "patch areas"),
      patch_rho(device_, std::uint64_t(bands_) * patches, "patch reflectances"),
      unshot(device_, std::uint64_t(bands_) * patches, "unshot radiosity"),
      unshot_lost(device_, std::uint64_t(bands_) * patches, "unshot radiosity"),
      patch_irradiance(device_, std::uint64_t(bands_) * patches, "patch irradiance"),
      patch_irradiance_lost(device_, std::uint64_t(bands_) * patches, "patch irradiance"),
      total_shot(device_, std::uint64_t(bands_) * patches, "shot radiosity"),
      pending(device_, std::uint64_t(bands_) * patches, "undelivered radiosity"),
      vertex_irradiance(device_, std::uint64_t(bands_) * vertices, "vertex irradiance"),
      vertex_irradiance_lost(device_, std::uint64_t(bands_) * vertices, "vertex irradiance"),
      shot(device_, bands_, "shot"),
      power(device_, patches, "unshot power"),
      facing(device_, vertices, "facing flags"),
      active(device_, vertices, "active receivers"),
      factors(device_, vertices, "form factors"),
      column(device_, vertices, "a column"),
      slot_of_patch(patches, 0xffffffffu),
      slot_of_patch_device(device_, slot_of_patch, "column slots") {
  std::vector<double> area, rho(std::size_t(bands) * patches), emitted(std::size_t(bands) * patches);
  for (std::uint32_t p = 0; p < patches; ++p) {
    const Patch& patch = mesh.patches[p];
    const Material& material = scene.materials[scene.polygons[patch.polygon].material];
    // What is covered neither shoots nor reflects: radiosity is that of the exposed part.
    const double share = exposed[p];
    area.push_back(patch.area_m2 * share);
    for (std::uint32_t b = 0; b < bands; ++b) {
      rho[std::size_t(b) * patches + p] = share > 0 ? material.reflectance[b] / share : 0;
      emitted[std::size_t(b) * patches + p] = material.emitted_exitance[b];
      emitted_power += patch.area_m2 * share * material.emitted_exitance[b];
    }
  }
  patch_area.upload(area);
  patch_rho.upload(rho);
  unshot.upload(emitted);
  for (RealArray* a : {&unshot_lost, &patch_irradiance, &patch_irradiance_lost, &total_shot, &pending,
                       &vertex_irradiance, &vertex_irradiance_lost})
    a->fill_zero();
  // Half of what is left is for columns; the engine's rays and the outputs need the rest.
  column_budget_bytes_ =
      (device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held)) / 2;
}

std::uint32_t SolveState::add_slot(std::uint32_t patch) {
  const auto slot = std::uint32_t(patch_of_slot.size());
  const std::uint64_t row = patch_irradiance.bytes() / bands;
  if ((slot + 1) * row > patch_columns.bytes()) {
    const std::uint64_t rows =
        std::min<std::uint64_t>(patches, std::max<std::uint64_t>(64, 2 * std::uint64_t(slot)));
    RealArray more(device, rows * patches, "patch columns");
    device.copy(patch_columns.buffer(), more.buffer(), slot * row);
    device.finish();
    patch_columns = std::move(more);
  }
  patch_of_slot.push_back(patch);
  slot_of_patch[patch] = slot;
  slot_of_patch_device.upload(std::span(&slot, 1), patch);
  return slot;
}

std::unique_ptr<RealArray> SolveState::vertex_column() {
  const std::uint64_t bytes = column.bytes();
  if (column_bytes_ + bytes + patch_columns.bytes() > column_budget_bytes_) return nullptr;
  column_bytes_ += bytes;
  return std::make_unique<RealArray>(device, vertices, "kept columns");
}

}  // namespace clrad
