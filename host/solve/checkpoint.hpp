// The state of a running solve in a file, and back: a run that goes on from it gives the same bits as one never stopped.
#pragma once
#include <memory>
#include <string>

#include "clrad/solution.hpp"
#include "output/archive.hpp"
#include "solve/run.hpp"

namespace clrad {

/// Writes all that the rest of the run depends on: mesh, sums, what was shot, kept columns. By way of a temporary file:
/// whenever the program is killed, the last whole checkpoint stands.
void write_checkpoint(const std::string& path, Run& run);

/// The part of a checkpoint that stays on the host.
struct CheckpointNumbers {
  std::uint64_t shoots = 0, reshoots = 0, rays = 0, pieces = 0, candidates = 0, exact = 0;
  std::uint64_t clip_asked = 0, clip_left = 0;
  std::uint64_t elements_split = 0, vertices_added = 0, refinement_rays = 0, column_budget_bytes = 0;
  std::uint32_t shoots_since_refined = 0, refinements = 0, balanced = 0, stalls = 0;
  double emitted_power = 0, unshot_before_sweep = 0, seconds = 0;
  std::vector<double> near_field;            ///< [band][vertex] of a mesh of before
  std::vector<std::uint32_t> patch_of_slot;  ///< patches with a kept column, each once
};

/// What a checkpoint was solved with.
struct CheckpointSettings {
  double patch_edge_m = 0, element_edge_m = 0;
  std::uint32_t samples = 0, light_samples = 0;
};
/// Throws InputError where they are not in the file or cannot be.
CheckpointSettings settings_of_checkpoint(const std::string& path);

/// A checkpoint that fits `device`, `scene` and `options`. Throws InputError with the reason when it is of another clrad,
/// device, scene, or of options that the result depends on (convergence, engine, sensors and memory may differ).
class Checkpoint {
 public:
  Checkpoint(const std::string& path, const Device& device, const Scene& scene, const SolveOptions& options);
  /// `now`: what has to be the same, as pairs of name and value.
  Checkpoint(const std::string& path, const nlohmann::json& now);

  /// The mesh as it was, and its covered vertices, into `solution`.
  void read_mesh(Solution& solution);
  /// Numbers and lists, checked: what comes back can be used without further checks.
  CheckpointNumbers read_numbers(std::uint32_t bands, std::uint32_t vertices, std::uint32_t patches);
  /// Everything else. The state is new and of that mesh.
  void read_state(Run& run);

 private:
  ArchiveReader archive_;
};

}  // namespace clrad
