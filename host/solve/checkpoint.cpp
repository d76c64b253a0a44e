#include "solve/checkpoint.hpp"

#include <fmt/format.h>

#include "clrad/device.hpp"
#include "output/archive_parts.hpp"
#include "version.hpp"

namespace clrad {
namespace {

using Json = nlohmann::json;
constexpr const char* kind = "checkpoint";

template <class T>
void add_to(Checksum& sum, const T& value) {
  sum.add(&value, sizeof value);
}

// What the answer depends on of a scene: not its names, nor where it was read.
std::string fingerprint(const Scene& scene) {
  Checksum sum;
  add_to(sum, scene.bands.size());
  for (const Polygon& p : scene.polygons) {
    add_to(sum, p.corners);
    add_to(sum, p.material);
    for (std::uint32_t k = 0; k < p.corners; ++k)
      for (int a = 0; a < 3; ++a) add_to(sum, p.corner[k][a]);
  }
  for (const Material& m : scene.materials) {
    for (const double x : m.reflectance) add_to(sum, x);
    for (const double x : m.emitted_exitance) add_to(sum, x);
  }
  return fmt::format("{:016x}", sum.value());
}

// What has to be the same for the same bits, by the names that messages use.
Json conditions(const Device& device, const Scene& scene, const SolveOptions& o) {
  const AdaptiveOptions& a = o.adaptive;
  Json camera;
  if (a.min_projected_area_px > 0)
    for (int k = 0; k < 3; ++k) camera.push_back({a.camera.eye[k], a.camera.target[k], a.camera.up[k]});
  return Json::array({
      {"version of clrad", version},
      {"device", device.info().name + ", " + device.info().driver},
      {"precision", int(device.options().precision)},
      {"scene", fingerprint(scene)},
      {"--patch-edge", o.mesh.patch_edge_m},
      {"--element-edge", o.mesh.element_edge_m},
      {"--form-factor", int(o.estimator)},
      {"--samples", o.samples},
      {"--light-samples", o.light_samples},
      {"--seed", o.seed},
      {"--solver", int(o.solver)},
      {"--closure", int(o.closure)},
      {"--shooters", o.shooters},
      {"--adaptive", a.tolerance},
      {"--max-level", a.max_level},
      {"--min-area", a.min_area_m2},
      {"--min-projected-area", a.min_projected_area_px},
      {"--camera", camera},
      {"--refine-every", a.every},
      {"--interpolate-new", a.interpolate_new},
      {"--no-near-field", !o.near_field},
  });
}

// A RealArray as what the device holds: float or double.
void add_reals(ArchiveWriter& archive, const std::string& name, const RealArray& array) {
  const std::vector<double> values = array.download();
  if (array.bytes() == 8 * array.size()) return archive.add(name, values);
  archive.add(name, std::vector<float>(values.begin(), values.end()));
}

void read_reals(ArchiveReader& archive, const std::string& name, RealArray& array) {
  if (array.bytes() == 8 * array.size()) return array.upload(archive.array<double>(name, array.size()));
  const auto values = archive.array<float>(name, array.size());
  array.upload(std::vector<double>(values.begin(), values.end()));
}

template <class Visit>
void visit_sums(SolveState& state, Visit visit) {
  visit("unshot", state.unshot);
  visit("unshot_lost", state.unshot_lost);
  visit("patch_irradiance", state.patch_irradiance);
  visit("patch_irradiance_lost", state.patch_irradiance_lost);
  visit("total_shot", state.total_shot);
  visit("total_shot_lo", state.total_shot_lo);
  visit("pending", state.pending);
  visit("vertex_irradiance", state.vertex_irradiance);
  visit("vertex_irradiance_lost", state.vertex_irradiance_lost);
  visit("vertex_row_sum", state.vertex_row_sum);
  visit("vertex_row_sum_lost", state.vertex_row_sum_lost);
}

std::string column_name(std::size_t slot) {
  return fmt::format("column.{}", slot);
}

}  // namespace

void write_checkpoint(const std::string& path, Run& run) {
  SolveState& state = run.state;
  const auto stage = state.device.stage("keep a checkpoint");
  ArchiveWriter archive(path, kind);
  archive.add_json("conditions", conditions(state.device, state.scene, state.options));
  const auto& refinement = run.solution.report.refinement;
  const VisibilityCounts counts = run.counts();
  archive.add_json("numbers", {{"shoots", state.shoots},
                               {"reshoots", state.reshoots},
                               {"shoots_since_refined", state.shoots_since_refined},
                               {"emitted_power", state.emitted_power},
                               {"balanced", int(state.balanced)},
                               {"unshot_before_sweep", state.unshot_before_sweep},
                               {"stalls", state.stalls},
                               {"column_budget_bytes", state.column_budget_bytes},
                               {"seconds", run.seconds()},
                               {"rays", counts.rays},
                               {"pieces", counts.pieces},
                               {"candidates", counts.candidates},
                               {"exact", counts.exact},
                               {"refinements", refinement.refinements},
                               {"elements_split", refinement.elements_split},
                               {"vertices_added", refinement.vertices_added},
                               {"refinement_rays", refinement.rays}});
  add_mesh(archive, state.mesh);
  archive.add("covered", state.covered_on_host);
  visit_sums(state, [&](const char* name, RealArray& array) { add_reals(archive, name, array); });
  archive.add("near_field", state.near_field);
  archive.add("patch_of_slot", state.patch_of_slot);
  for (std::size_t slot = 0; slot < state.patch_of_slot.size(); ++slot)
    if (state.vertex_columns[slot]) add_reals(archive, column_name(slot), *state.vertex_columns[slot]);
  if (state.patch_columns.size() > 0) add_reals(archive, "patch_columns", state.patch_columns);
  archive.finish();
}

Checkpoint::Checkpoint(const std::string& path, const Device& device, const Scene& scene,
                       const SolveOptions& options)
    : archive_(path, kind) {
  const Json then = archive_.json("conditions"), now = conditions(device, scene, options);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const std::string name = now[i][0];
    if (then.size() != now.size() || then[i][0] != name)
      archive_.fail("a checkpoint of another version of clrad");
    const Json &was = then[i][1], &is = now[i][1];
    if (was == is) continue;
    if (name == "scene") archive_.fail("a checkpoint of another scene");
    archive_.fail(
        fmt::format("a checkpoint of another {}: it was {}, and now it is {}", name, was.dump(), is.dump()));
  }
}

void Checkpoint::read_mesh(Solution& solution) {
  solution.mesh = clrad::read_mesh(archive_, solution.scene);
  solution.vertex_covered = archive_.array<std::uint8_t>("covered", solution.mesh.vertex_count());
}

void Checkpoint::read_state(Run& run) {
  SolveState& state = run.state;
  const Json numbers = archive_.json("numbers");
  const auto number = [&](const char* name, auto& value) {
    if (!numbers.contains(name) || !numbers[name].is_number())
      archive_.fail(fmt::format("number '{}' is missing", name));
    numbers[name].get_to(value);
  };
  number("shoots", state.shoots), number("reshoots", state.reshoots);
  number("shoots_since_refined", state.shoots_since_refined);
  number("emitted_power", state.emitted_power), number("column_budget_bytes", state.column_budget_bytes);
  int balanced = 0;
  number("balanced", balanced), state.balanced = balanced != 0;
  number("unshot_before_sweep", state.unshot_before_sweep), number("stalls", state.stalls);
  number("seconds", run.seconds_before);
  number("rays", run.counts_before.rays), number("pieces", run.counts_before.pieces);
  number("candidates", run.counts_before.candidates), number("exact", run.counts_before.exact);
  auto& refinement = run.solution.report.refinement;
  number("refinements", refinement.refinements), number("elements_split", refinement.elements_split);
  number("vertices_added", refinement.vertices_added), number("refinement_rays", refinement.rays);

  visit_sums(state, [&](const char* name, RealArray& array) { read_reals(archive_, name, array); });
  state.near_field = archive_.array<double>("near_field");
  if (state.near_field.size() % state.bands != 0 ||
      state.near_field.size() > std::uint64_t(state.bands) * state.vertices)
    archive_.fail("section 'near_field' is not of this mesh");
  const auto patch_of_slot = archive_.array<std::uint32_t>("patch_of_slot");
  for (const std::uint32_t patch : patch_of_slot) {
    if (patch >= state.patches || state.slot_of_patch[patch] != 0xffffffffu)
      archive_.fail("its columns are of patches that the mesh does not have");
    const std::uint32_t slot = state.add_slot(patch);
    auto& kept = state.vertex_columns.emplace_back();
    if (!archive_.has(column_name(slot))) continue;
    kept = std::make_unique<RealArray>(state.device, state.vertices, "kept columns");
    read_reals(archive_, column_name(slot), *kept);
    state.column_bytes += kept->bytes();
  }
  if (!patch_of_slot.empty()) read_reals(archive_, "patch_columns", state.patch_columns);
}

}  // namespace clrad
