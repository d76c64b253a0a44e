#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>

#include "clrad/error.hpp"
#include "clrad/options.hpp"

namespace clrad {

std::vector<Sensor> load_sensors(const std::string& path, double unit_m) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("{}: cannot be read", path));
  std::vector<Sensor> sensors;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    const auto begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos || line[begin] == '#') continue;
    std::istringstream words(line);
    double v[6];
    for (double& x : v) {
      std::string word;
      words >> word;
      char* end = nullptr;
      x = std::strtod(word.c_str(), &end);
      if (word.empty() || *end != '\0' || !std::isfinite(x))
        throw InputError(fmt::format("{}:{}: a sensor is six numbers, x y z nx ny nz; this line is \"{}\"",
                                     path, number, line));
    }
    if (std::string more; words >> more)
      throw InputError(fmt::format("{}:{}: a sensor is six numbers, x y z nx ny nz; there is more: \"{}\"",
                                   path, number, more));
    const glm::dvec3 normal(v[3], v[4], v[5]);
    if (!(glm::length(normal) > 0))
      throw InputError(fmt::format("{}:{}: the sensor's normal has no length", path, number));
    sensors.push_back({glm::dvec3(v[0], v[1], v[2]) * unit_m, glm::normalize(normal)});
  }
  if (sensors.empty())
    throw InputError(fmt::format("{}: holds no sensor; expected lines of x y z nx ny nz", path));
  return sensors;
}

}  // namespace clrad
