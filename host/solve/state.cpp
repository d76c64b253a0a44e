#include "solve/state.hpp"

#include <algorithm>
#include <cmath>

#include "mesh/texture.hpp"
#include "solve/covered.hpp"
#include "solve/order.hpp"
#include "solve/transmission.hpp"

namespace clrad {

SolveState::SolveState(Device& device_, const Scene& scene_, Mesh& mesh_, std::uint32_t bands_,
                       VisibilityEngine& engine_, const SolveOptions& options_,
                       std::vector<std::uint8_t>& covered_, double metres_per_unit_, const Glass* glass_,
                       Reflectances* textured_)
    : device(device_),
      scene(scene_),
      mesh(mesh_),
      covered_on_host(covered_),
      bands(bands_),
      patches(std::uint32_t(mesh_.patches.size())),
      engine(engine_),
      options(options_),
      metres_per_unit(metres_per_unit_),
      glass(glass_),
      colours(glass_ ? glass_->colours() : 1),
      textured(textured_),
      patch_area(device_, patches, "patch areas"),
      patch_rho(device_, std::uint64_t(bands_) * patches, "patch reflectances"),
      patch_emitted(device_, std::uint64_t(bands_) * patches, "patch emission"),
      unshot(device_, std::uint64_t(bands_) * patches, "unshot radiosity"),
      unshot_lost(device_, std::uint64_t(bands_) * patches, "unshot radiosity"),
      patch_irradiance(device_, std::uint64_t(bands_) * patches, "patch irradiance"),
      patch_irradiance_lost(device_, std::uint64_t(bands_) * patches, "patch irradiance"),
      total_shot(device_, std::uint64_t(bands_) * patches, "shot radiosity"),
      total_shot_lo(device_, std::uint64_t(bands_) * patches, "shot radiosity"),
      pending(device_, std::uint64_t(bands_) * patches, "undelivered radiosity"),
      power(device_, patches, "unshot power"),
      slot_of_patch(patches, 0xffffffffu),
      slot_of_patch_device(device_, slot_of_patch, "column slots"),
      patch_of_slot_device(device_, patches, "column slots") {
  take_mesh();
  device.copy(patch_emitted.buffer(), unshot.buffer(), unshot.bytes());
  for (RealArray* a :
       {&unshot_lost, &patch_irradiance, &patch_irradiance_lost, &total_shot, &total_shot_lo, &pending})
    a->fill_zero();
  // Half of what is left is for columns; the engine's rays and the outputs need the rest.
  column_budget_bytes =
      (device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held)) / 2;
}

void SolveState::take_mesh() {
  const std::uint32_t before = vertices;
  vertices = mesh.vertex_count();
  receivers = PointArray(), receivers = PointArray(device, mesh.receivers, "receivers");
  covered = Array<std::uint32_t>(
      device, std::vector<std::uint32_t>(covered_on_host.begin(), covered_on_host.end()), "covered vertices");
  order = in_order(device, receivers);
  gatherer = std::make_unique<Gatherer>(device, mesh);
  const auto grow = [&](RealArray& a, std::uint64_t rows, const char* what) {
    RealArray grown(device, rows * vertices, what);
    grown.fill_zero();
    const std::uint64_t real = grown.bytes() / grown.size();
    for (std::uint64_t r = 0; r < rows && before > 0; ++r)
      device.copy(a.buffer(), grown.buffer(), before * real, r * before * real, r * vertices * real);
    device.finish();
    a = std::move(grown);
  };
  for (RealArray* a : {&vertex_irradiance, &vertex_irradiance_lost}) grow(*a, bands, "vertex irradiance");
  for (RealArray* a : {&vertex_row_sum, &vertex_row_sum_lost}) grow(*a, 1, "row sums");
  rows_of_slots = 0xffffffffu;
  facing = Array<std::uint32_t>(device, vertices, "facing flags");
  chosen = Array<std::uint32_t>(device, vertices, "chosen flags");
  column = RealArray(device, std::uint64_t(colours) * vertices, "a column");
  exposed = exposed_shares(mesh, covered_on_host);
  if (textured) *textured = average_textures(device, scene, mesh, covered_on_host);
  upload_patches();
}

void SolveState::upload_patches() {
  std::vector<double> area, rho(std::size_t(bands) * patches), emitted(std::size_t(bands) * patches);
  double emitted_now = 0;
  for (std::uint32_t p = 0; p < patches; ++p) {
    const Patch& patch = mesh.patches[p];
    const Material& of_patch = material(p);
    // What is covered neither shoots nor reflects: radiosity is that of the exposed part.
    const double share = exposed[p];
    area.push_back(patch.area_m2 * share);
    for (std::uint32_t b = 0; b < bands; ++b) {
      rho[std::size_t(b) * patches + p] = share > 0 ? reflectance(b, p) / share : 0;
      emitted[std::size_t(b) * patches + p] = of_patch.emitted_exitance[b];
      emitted_now += patch.area_m2 * share * of_patch.emitted_exitance[b];
    }
  }
  // Samples of a shooter follow from it: they stay what they are when the mesh grows.
  if (emitted_power == 0) emitted_power = emitted_now;
  patch_area.upload(area);
  patch_rho.upload(rho);
  patch_emitted.upload(emitted);
}

std::uint32_t SolveState::add_slot(std::uint32_t patch) {
  const auto slot = std::uint32_t(patch_of_slot.size());
  const std::uint64_t row = patch_irradiance.bytes() / bands * colours;
  if ((slot + 1) * row > patch_columns.bytes()) {
    const std::uint64_t rows =
        std::min<std::uint64_t>(patches, std::max<std::uint64_t>(64, 2 * std::uint64_t(slot)));
    RealArray more(device, rows * colours * patches, "patch columns");
    device.copy(patch_columns.buffer(), more.buffer(), slot * row);
    device.finish();
    patch_columns = std::move(more);
  }
  patch_of_slot.push_back(patch);
  slot_of_patch[patch] = slot;
  // A fill of one word: an upload would wait for all that was enqueued.
  device.fill_bytes(slot_of_patch_device.buffer(), slot, 4, 4ull * patch);
  device.fill_bytes(patch_of_slot_device.buffer(), patch, 4, 4ull * slot);
  return slot;
}

std::unique_ptr<RealArray> SolveState::vertex_column() {
  const std::uint64_t bytes = column.bytes();
  if (column_bytes + bytes + patch_columns.bytes() > column_budget_bytes) return nullptr;
  column_bytes += bytes;
  return std::make_unique<RealArray>(device, column.size(), "kept columns");
}

bool SolveState::keeps_all_columns() const {
  return std::all_of(vertex_columns.begin(), vertex_columns.end(),
                     [](const auto& c) { return c != nullptr; });
}

std::uint64_t SolveState::vertices_left() const {
  const std::uint64_t real = column.bytes() / column.size();
  // While a column grows, it is there twice; two points, flags and sums besides.
  const std::uint64_t per_vertex =
      real * (std::uint64_t(colours) * (std::uint64_t(patches) + 1) + 4 * bands + 2) + 256;
  const std::uint64_t patch_bytes = real * colours * patches * std::uint64_t(patches);
  const std::uint64_t held = real * colours * vertices * std::uint64_t(patches) + patch_bytes;
  return held > column_budget_bytes ? 0 : (column_budget_bytes - held) / per_vertex;
}

RealArray& SolveState::extend_column(std::uint32_t slot) {
  std::unique_ptr<RealArray>& kept = vertex_columns[slot];
  auto grown = std::make_unique<RealArray>(device, column.size(), "kept columns");
  const std::uint64_t before = kept->bytes() / colours, after = grown->bytes() / colours;
  for (std::uint32_t c = 0; c < colours; ++c)
    device.copy(kept->buffer(), grown->buffer(), before, c * before, c * after);
  column_bytes += grown->bytes() - kept->bytes();
  // The device holds what is given back here until the copy has run: a part of its memory at a time, no more.
  given_back_bytes += kept->bytes();
  if (given_back_bytes > device.ledger()->limit / 64) device.finish(), given_back_bytes = 0;
  kept = std::move(grown);
  return *kept;
}

}  // namespace clrad
