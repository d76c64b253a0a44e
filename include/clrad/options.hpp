/// What can be asked of a solve.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clrad/mesh.hpp"

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

struct SolveOptions {
  MeshOptions mesh;
  std::string engine =
      "auto";  ///< serial, chop, or auto: serial up to 2000 triangles, where it is the faster of the two
  std::array<std::uint32_t, 3> grid{};  ///< voxels of `chop` along x, y, z; 0: by its cost model
  std::uint32_t rays_per_batch = 0;     ///< of `chop`; 0: its own choice
  Estimator estimator = Estimator::exact;
  std::uint32_t samples = 4;          ///< rays from a receiver to a shooter
  std::uint32_t light_samples = 256;  ///< a shooter gets more than `samples` until one sample carries less
                                      ///< than 1/this of the emitted power
  double converge = 1e-3;             ///< stop when unshot / emitted power is below
  std::uint64_t seed = 1;
  std::vector<Sensor> sensors;
  std::uint32_t sensor_rays = 8192;  ///< rays from a sensor, shared out by what each surface brings
  bool near_field = true;            ///< vertices next to a patch see its elements, not its average
  bool strict = false;               ///< a violated invariant is an error, not a warning
  /// Called after every shoot; returning false stops the solve with a valid partial result.
  std::function<bool(const Progress&)> progress;
};

}  // namespace clrad
