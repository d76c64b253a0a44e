#include "solve/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "clrad/device.hpp"
#include "output/archive_parts.hpp"
#include "solve/clip.hpp"
#include "solve/sensor.hpp"
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
    for (const double x : m.transmission) add_to(sum, x);
    if (m.is_glass()) add_to(sum, m.ior);
    if (m.texture != no_texture) add_to(sum, m.texture);
  }
  for (const PunctualLight& l : scene.lights) {
    add_to(sum, l.kind);
    for (int a = 0; a < 3; ++a) add_to(sum, l.position_m[a]), add_to(sum, l.direction[a]);
    for (const double x : l.intensity) add_to(sum, x);
    add_to(sum, l.inner_cone_rad), add_to(sum, l.outer_cone_rad);
  }
  for (const Texture& t : scene.textures) {
    add_to(sum, t.width), add_to(sum, t.wrap);
    sum.add(t.texels.data(), t.texels.size() * sizeof(float));
  }
  if (!scene.textures.empty())
    for (const Polygon& p : scene.polygons) add_to(sum, p.uv);
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
      {"reach of the farthest sensor", frame_with_sensors(scene, o.sensors).exponent},
      {"--patch-edge", o.mesh.patch_edge_m},
      {"--element-edge", o.mesh.element_edge_m},
      {"--form-factor", int(o.estimator)},
      {"--samples", o.samples},
      {"--light-samples", o.light_samples},
      {"--visibility-exact", o.visibility_exact},
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
      {"--force-effects", o.force_effects},
      {"--without", o.without},
  });
}

// The first `count` numbers of a RealArray as what the device holds: float or double.
void add_reals(ArchiveWriter& archive, const std::string& name, const RealArray& array, std::uint64_t count) {
  const std::vector<double> values = array.download(0, count);
  if (array.bytes() == 8 * array.size()) return archive.add(name, values);
  archive.add(name, std::vector<float>(values.begin(), values.end()));
}
void add_reals(ArchiveWriter& archive, const std::string& name, const RealArray& array) {
  add_reals(archive, name, array, array.size());
}

void read_reals(ArchiveReader& archive, const std::string& name, RealArray& array, std::uint64_t count) {
  if (array.bytes() == 8 * array.size()) return array.upload(archive.finite<double>(name, count));
  const auto values = archive.finite<float>(name, count);
  array.upload(std::vector<double>(values.begin(), values.end()));
}
void read_reals(ArchiveReader& archive, const std::string& name, RealArray& array) {
  read_reals(archive, name, array, array.size());
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
  if (state.direct) visit("lights.vertex", state.direct->vertex);
}

// Names in a damaged file need not be UTF-8, which dump() insists on.
std::string shown(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
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
                               {"clip_asked", state.clip ? state.clip->asked() : 0},
                               {"clip_left", state.clip ? state.clip->left() : 0},
                               {"refinements", refinement.refinements},
                               {"elements_split", refinement.elements_split},
                               {"vertices_added", refinement.vertices_added},
                               {"refinement_rays", refinement.rays}});
  add_mesh(archive, state.mesh);
  archive.add("covered", state.covered_on_host);
  visit_sums(state, [&](const char* name, RealArray& array) { add_reals(archive, name, array); });
  if (state.direct)
    archive.add("lights.reach",
                std::vector<std::uint8_t>(state.direct->reaches.begin(), state.direct->reaches.end()));
  archive.add("near_field", state.near_field);
  archive.add("patch_of_slot", state.patch_of_slot);
  for (std::size_t slot = 0; slot < state.patch_of_slot.size(); ++slot)
    if (state.vertex_columns[slot]) add_reals(archive, column_name(slot), *state.vertex_columns[slot]);
  // Rows past the last slot were never written.
  add_reals(archive, "patch_columns", state.patch_columns,
            state.patch_of_slot.size() * state.colours * state.patches);
  archive.finish();
}

CheckpointSettings settings_of_checkpoint(const std::string& path) {
  ArchiveReader archive(path, kind);
  const Json conditions = archive.json("conditions");
  const auto number = [&](const char* name, double most) {
    for (const Json& c : conditions.is_array() ? conditions : Json::array())
      if (c.is_array() && c.size() == 2 && c[0] == name && c[1].is_number()) {
        const double value = c[1].get<double>();
        if (value > 0 && value <= most) return value;
      }
    archive.fail(fmt::format("a checkpoint that does not say its {}", name));
  };
  CheckpointSettings s;
  s.patch_edge_m = number("--patch-edge", 1e30), s.element_edge_m = number("--element-edge", 1e30);
  s.samples = std::uint32_t(number("--samples", 4096));
  s.light_samples = std::uint32_t(number("--light-samples", 1 << 24));
  return s;
}

Checkpoint::Checkpoint(const std::string& path, const Device& device, const Scene& scene,
                       const SolveOptions& options)
    : Checkpoint(path, conditions(device, scene, options)) {}

Checkpoint::Checkpoint(const std::string& path, const Json& now) : archive_(path, kind) {
  const Json then = archive_.json("conditions");
  const auto is_pair = [](const Json& j) { return j.is_array() && j.size() == 2 && j[0].is_string(); };
  const bool pairs = then.is_array() && std::all_of(then.begin(), then.end(), is_pair);
  if (!pairs || then.size() != now.size()) archive_.fail("a checkpoint of another version of clrad");
  for (std::size_t i = 0; i < now.size(); ++i) {
    const std::string name = now[i][0];
    if (then[i][0] != name) archive_.fail("a checkpoint of another version of clrad");
    const Json &was = then[i][1], &is = now[i][1];
    if (was == is) continue;
    if (name == "scene") archive_.fail("a checkpoint of another scene");
    archive_.fail(
        fmt::format("a checkpoint of another {}: it was {}, and now it is {}", name, shown(was), shown(is)));
  }
}

void Checkpoint::read_mesh(Solution& solution) {
  solution.mesh = clrad::read_mesh(archive_, solution.scene);
  solution.vertex_covered = archive_.array<std::uint8_t>("covered", solution.mesh.vertex_count());
}

CheckpointNumbers Checkpoint::read_numbers(std::uint32_t bands, std::uint32_t vertices,
                                           std::uint32_t patches) {
  CheckpointNumbers n;
  const Json numbers = archive_.json("numbers");
  const auto number = [&]<class T>(const char* name, T& value) {
    if (!numbers.is_object() || !numbers.contains(name) || !numbers[name].is_number())
      archive_.fail(fmt::format("number '{}' is missing", name));
    const Json& json = numbers[name];
    bool fits = true;
    if constexpr (std::is_floating_point_v<T>)
      fits = json.get<double>() >= 0 && std::isfinite(json.get<double>());
    else
      fits = json.is_number_unsigned() && json.get<std::uint64_t>() <= std::numeric_limits<T>::max();
    if (!fits) archive_.fail(fmt::format("number '{}' is {}", name, shown(json)));
    value = json.get<T>();
  };
  number("shoots", n.shoots), number("reshoots", n.reshoots);
  number("shoots_since_refined", n.shoots_since_refined);
  number("emitted_power", n.emitted_power), number("column_budget_bytes", n.column_budget_bytes);
  number("balanced", n.balanced), number("stalls", n.stalls);
  number("unshot_before_sweep", n.unshot_before_sweep);
  number("seconds", n.seconds);
  number("rays", n.rays), number("pieces", n.pieces);
  number("candidates", n.candidates), number("exact", n.exact);
  number("clip_asked", n.clip_asked), number("clip_left", n.clip_left);
  number("refinements", n.refinements), number("elements_split", n.elements_split);
  number("vertices_added", n.vertices_added), number("refinement_rays", n.refinement_rays);

  n.near_field = archive_.finite<double>("near_field");
  if (n.near_field.size() % bands != 0 || n.near_field.size() > std::uint64_t(bands) * vertices)
    archive_.fail("section 'near_field' is not of this mesh");
  n.patch_of_slot = archive_.array<std::uint32_t>("patch_of_slot");
  std::vector<bool> kept(patches, false);
  for (const std::uint32_t patch : n.patch_of_slot) {
    if (patch >= patches || kept[patch])
      archive_.fail("its columns are of patches that the mesh does not have");
    kept[patch] = true;
  }
  return n;
}

void Checkpoint::read_state(Run& run) {
  SolveState& state = run.state;
  const CheckpointNumbers n = read_numbers(state.bands, state.vertices, state.patches);
  state.shoots = n.shoots, state.reshoots = n.reshoots;
  state.shoots_since_refined = n.shoots_since_refined;
  state.emitted_power = n.emitted_power, state.column_budget_bytes = n.column_budget_bytes;
  state.balanced = n.balanced != 0;
  state.unshot_before_sweep = n.unshot_before_sweep, state.stalls = n.stalls;
  run.seconds_before = n.seconds;
  run.counts_before.rays = n.rays, run.counts_before.pieces = n.pieces;
  run.counts_before.candidates = n.candidates, run.counts_before.exact = n.exact;
  if (state.clip) state.clip->note(n.clip_asked, n.clip_left);
  auto& refinement = run.solution.report.refinement;
  refinement.refinements = n.refinements, refinement.elements_split = n.elements_split;
  refinement.vertices_added = n.vertices_added, refinement.rays = n.refinement_rays;

  visit_sums(state, [&](const char* name, RealArray& array) { read_reals(archive_, name, array); });
  if (state.direct) {
    const auto reach = archive_.array<std::uint8_t>("lights.reach", state.direct->lights.count());
    state.direct->reaches.assign(reach.begin(), reach.end());
  }
  state.near_field = n.near_field;
  for (const std::uint32_t patch : n.patch_of_slot) {
    const std::uint32_t slot = state.add_slot(patch);
    auto& kept = state.vertex_columns.emplace_back();
    if (!archive_.has(column_name(slot))) continue;
    kept = std::make_unique<RealArray>(state.device, state.column.size(), "kept columns");
    read_reals(archive_, column_name(slot), *kept);
    state.column_bytes += kept->bytes();
  }
  read_reals(archive_, "patch_columns", state.patch_columns,
             n.patch_of_slot.size() * state.colours * state.patches);
}

}  // namespace clrad
