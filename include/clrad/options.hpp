/// What can be asked of a solve.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"

namespace clrad {

enum class Estimator { disk, subdisk, exact };

struct Sensor {
  glm::dvec3 position_m{0, 0, 0};
  glm::dvec3 normal{0, 0, 1};
};

/// Reads sensors, one `x y z nx ny nz` a line as Radiance's `rtrace -I` takes them; empty lines and lines that begin
/// with # are skipped. `unit_m`: length of one unit of the file [m]. Throws InputError with file and line.
std::vector<Sensor> load_sensors(const std::string& path, double unit_m = 1.0);

/// Where a solve stands; given to SolveOptions::progress.
struct Progress {
  std::string stage;
  std::uint64_t shoots = 0;
  double unshot_relative = 1;  ///< unshot / emitted power
  double seconds = 0;          ///< since the solve began
  double seconds_left = -1;    ///< estimate; negative: not known yet
};

/// How the patches' radiosities are found. All three give the same answer to `converge`.
enum class Solver {
  progressive,  ///< shoots the patch with the most unshot power (Cohen et al. 1988)
  gathering,  ///< traces every column, then gathers at all patches at once (Jacobi's iteration: a bounce a sweep)
  gauss_seidel,  ///< traces every column, then gathers at one patch after the other
};

/// What to make of rows of form factors that do not sum to 1 (rounding, samples and the mesh see to that). In a closed scene they
/// should, and what they lack is amplified by 1 / (1 - reflectance).
enum class Closure {
  automatic,  ///< rows are closed where the scene is proven closed
  on,         ///< they are closed: the caller knows that the scene is
  off,        ///< they are left as they are
};

/// Adaptive subdivision (section 1.4 of Drucker & Schroeder): elements across which radiosity differs are split.
struct AdaptiveOptions {
  /// Split where radiosity differs across an element by more than this x the scene's mean reflected radiosity, and the
  /// level above did not interpolate it that well either; 0: never.
  double tolerance = 0;
  std::uint32_t max_level = 3;  ///< splits of an element of the first mesh
  double min_area_m2 = 0;       ///< no element gets smaller than this
  double min_projected_area_px =
      0;  ///< nor than this in the picture of `camera`; out of sight counts 0 [pixels]
  Camera camera;
  unsigned width = 0, height = 0;  ///< of that picture
  std::uint32_t every = 32;        ///< shoots between refinements; at convergence it is refined in any case
  /// The paper's alternative: new vertices get the mean of their neighbours instead of being shot to. Wrong where a new
  /// vertex lies in a shadow that its neighbours do not.
  bool interpolate_new = false;
};

/// Which error SolveOptions::target_error is of; all are relative to the mean irradiance there.
enum class TargetOf {
  automatic,     ///< sensors where there are some, else the scene
  scene,         ///< RMS over the surfaces
  sensors,       ///< RMS over the sensors
  worst_sensor,  ///< the largest of a sensor
};

struct SolveOptions {
  MeshOptions mesh;
  AdaptiveOptions adaptive;
  Solver solver = Solver::progressive;
  Closure closure = Closure::automatic;
  std::uint32_t shooters = 1;  ///< of the progressive solver: the k brightest patches are chosen at a time
  std::string engine =
      "auto";  ///< serial, chop, shaft, or auto: shaft, the fastest, all of whose bits are the same
  std::array<std::uint32_t, 3> grid{};  ///< voxels of `chop` along x, y, z; 0: by its cost model
  std::uint32_t rays_per_batch = 0;     ///< of `chop`; 0: its own choice
  Estimator estimator = Estimator::exact;
  std::uint32_t samples = 4;          ///< rays from a receiver to a shooter
  std::uint32_t light_samples = 256;  ///< a shooter gets more than `samples` until one sample carries no more
                                      ///< than 1/this of the emitted power
  /// Clips shooters by what stands in the way instead of sampling them (kernels/solve/clip.cl): no noise of visibility. Where more
  /// triangles than it has room for hide a part, samples it is all the same. Needs Estimator::exact; where light passes glass it is sampled all the same, with a warning.
  bool visibility_exact = false;
  double converge = 1e-3;  ///< stop when unshot / emitted power is below
  std::uint64_t seed = 1;
  std::vector<Sensor> sensors;
  std::uint32_t sensor_rays =
      8192;                ///< rays from a sensor, shared out by what each surface brings and how it varies
  bool near_field = true;  ///< vertices next to a patch see its elements, not its average
  /// Effects (clrad/effects.hpp) to run though the scene does not call for them, by name; "all": every one. The answer stays
  /// what it is, it only takes longer.
  std::vector<std::string> force_effects;
  /// Effects to leave out though the scene calls for them: the answer is wrong by what they do.
  std::vector<std::string> without;
  bool error = true;  ///< estimate what the solve is off by (Report::error)
  /// Estimated relative error to reach, such as 0.01; 0: none. The scene is solved coarsely (at sensors: as fine as the target asks of a plain
  /// room, and finer, with four times `samples`, where something stands in the way) and then finer until it is met (at sensors, where few points
  /// tell, by 5 % as long as that can be had); where rays at sensors are all that it wants, more of them see the same solution. Where patch edges are
  /// given, mesh and samples above are where that starts.
  double target_error = 0;
  TargetOf target_of = TargetOf::automatic;
  /// Seconds for the whole solve; 0: no limit. The best solution that can be had in that time, or the first with which target_error ends the search.
  double time_budget_s = 0;
  bool strict = false;             ///< a violated invariant is an error, not a warning
  std::string checkpoint;          ///< file to keep the state of a running solve in; empty: none
  double checkpoint_every_s = 30;  ///< least time between two; also not more than 5 % of the solve's time
  std::string resume;              ///< checkpoint to go on from; empty: from nothing
  /// Called after every shoot; returning false stops the solve with a valid partial result.
  std::function<bool(const Progress&)> progress;
};

}  // namespace clrad
