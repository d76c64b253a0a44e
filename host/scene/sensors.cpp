#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "clrad/error.hpp"
#include "clrad/options.hpp"
#include "scene/obj_lines.hpp"

namespace clrad {
namespace {

constexpr double largest = 1e100;  // of a coordinate, in the file's units and in metres

[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& message) {
  throw InputError(fmt::format("{}:{}: {}", path, line, message));
}

Sensor sensor_of(const std::vector<std::string_view>& words, double unit_m, const std::string& path,
                 std::size_t line) {
  if (words.size() != 6)
    fail(path, line,
         fmt::format("a sensor is six numbers, x y z nx ny nz; this line has {} words", words.size()));
  double v[6];
  for (std::size_t i = 0; i < 6; ++i) {
    const auto number = parse_number(words[i]);
    if (!number || !std::isfinite(*number))
      fail(path, line,
           fmt::format("a sensor is six numbers, x y z nx ny nz; number {} is \"{}\"", i + 1, words[i]));
    v[i] = *number;
  }
  const glm::dvec3 position = glm::dvec3(v[0], v[1], v[2]) * unit_m;
  const glm::dvec3 size = glm::abs(position);
  if (!(std::max({size.x, size.y, size.z}) <= largest))
    fail(path, line, fmt::format("the sensor is out of reach; coordinates are at most {:.0e} m", largest));
  // By the longest component first: squares may leave a double's range at either end.
  const glm::dvec3 normal(v[3], v[4], v[5]), along = glm::abs(normal);
  const double longest = std::max({along.x, along.y, along.z});
  if (!(longest > 0)) fail(path, line, "the sensor's normal has no length; write a direction such as 0 0 1");
  return {position, glm::normalize(normal / longest)};
}

}  // namespace

std::vector<Sensor> load_sensors(const std::string& path, double unit_m) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw InputError(fmt::format("{}: is a folder; name a file of sensors in it", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("{}: cannot be read; is the name right?", path));
  std::vector<Sensor> sensors;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty() || words[0].starts_with('#')) continue;
    sensors.push_back(sensor_of(words, unit_m, path, number));
  }
  if (sensors.empty())
    throw InputError(fmt::format("{}: holds no sensor; expected lines of x y z nx ny nz", path));
  return sensors;
}

}  // namespace clrad
