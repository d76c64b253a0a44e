#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/error.hpp"
#include "clrad/options.hpp"
#include "fuzz/targets.hpp"

namespace clrad::fuzz {

void sensors(Bytes bytes) {
  const std::string path = write_case("a.pts", bytes);
  std::vector<Sensor> found;
  try {
    found = load_sensors(path);
  } catch (const InputError& e) {
    return require_message(e.what(), path);
  }
  require(!found.empty(), "no sensor, and no message");
  for (const Sensor& s : found) {
    for (int k = 0; k < 3; ++k) require(std::isfinite(s.position_m[k]), "a sensor nowhere");
    // The length of a normalised vector: a few roundings.
    require(std::abs(glm::length(s.normal) - 1) < 1e-14, "a normal that is not of unit length");
  }
}

}  // namespace clrad::fuzz
