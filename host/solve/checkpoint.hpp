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

/// A checkpoint that fits `device`, `scene` and `options`. Throws InputError with the reason when it is of another clrad,
/// device, scene, or of options that the result depends on (convergence, engine, sensors and memory may differ).
class Checkpoint {
 public:
  Checkpoint(const std::string& path, const Device& device, const Scene& scene, const SolveOptions& options);

  /// The mesh as it was, and its covered vertices, into `solution`.
  void read_mesh(Solution& solution);
  /// Everything else. The state is new and of that mesh.
  void read_state(Run& run);

 private:
  ArchiveReader archive_;
};

}  // namespace clrad
