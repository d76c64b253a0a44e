/// Hard scenes as OBJ files, which is how users have them: written with all digits, read back by the program's own reader,
/// solved by the public API or by the command line. Receivers are sensors: next to a black lamp of exitance E = 1 the
/// irradiance at a sensor is the visible form factor itself.
#pragma once
#include <fmt/format.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "scene/files.hpp"

namespace clrad::test {

inline constexpr Precision precisions[] = {Precision::float32, Precision::float64};

using Corners = std::vector<glm::dvec3>;

/// The cases of a reference file; by value, so that a range-for may begin with it.
inline oracle::json cases_of(const std::string& file) {
  return oracle::reference(file).at("cases");
}

inline Corners corners_of(const oracle::json& vertices) {
  Corners corners;
  for (const auto& v : vertices) corners.push_back(oracle::vec(v));
  return corners;
}

/// Corners in the other order: the same polygon seen from behind.
inline Corners reversed(Corners corners) {
  return {corners.rbegin(), corners.rend()};
}

class ObjScene {
 public:
  /// Returns the index of a material. rho and emitted exitance [W/m^2]: one number, or three.
  int material(const std::vector<double>& rho, const std::vector<double>& emitted) {
    const auto three = [](const std::vector<double>& v, double factor) {
      const auto at = [&](std::size_t k) { return factor * (v.size() == 1 ? v[0] : v.at(k)); };
      return fmt::format("{:.17g} {:.17g} {:.17g}", at(0), at(1), at(2));
    };
    mtl_ += fmt::format("newmtl m{}\nKd {}\nKe {}\n", materials_, three(rho, 1),
                        three(emitted, 1 / std::numbers::pi));
    return materials_++;
  }
  void face(const Corners& corners, int material, const std::string& name = "") {
    std::string line = "f";
    for (const glm::dvec3& c : corners) {
      obj_ += fmt::format("v {:.17g} {:.17g} {:.17g}\n", c.x, c.y, c.z);
      line += fmt::format(" {}", ++vertices_);
    }
    if (!name.empty()) obj_ += "o " + name + "\n";
    obj_ += fmt::format("usemtl m{}\n{}\n", material, line);
  }
  /// A black polygon that emits 1.
  void lamp(const Corners& corners) {
    if (lamp_ < 0) lamp_ = material({0}, {1});
    face(corners, lamp_, "lamp");
  }
  /// A black polygon that does not.
  void occluder(const Corners& corners) {
    if (black_ < 0) black_ = material({0}, {0});
    face(corners, black_, "occluder");
  }
  std::string write(const clrad_test::Folder& folder, const std::string& stem = "scene") const {
    folder.write(stem + ".mtl", mtl_);
    return folder.write(stem + ".obj", "mtllib " + stem + ".mtl\n" + obj_);
  }
  Scene load() const {
    const clrad_test::Folder folder;
    return load_scene(write(folder));
  }

 private:
  std::string obj_, mtl_;
  int materials_ = 0, vertices_ = 0, lamp_ = -1, black_ = -1;
};

/// Options for black scenes of a few lamps: every lamp is cut into `elements` along its longer side, and nothing else is
/// cut; `longest` is that of all lamps' edges.
inline SolveOptions lamp_options(double longest, unsigned elements, std::vector<Sensor> sensors) {
  SolveOptions options;
  options.mesh = {longest * 1.0001, longest * 1.0001 / elements};
  options.samples = 1, options.light_samples = 0;
  options.sensors = std::move(sensors);
  return options;
}

inline double longest_edge(const Corners& corners) {
  double longest = 0;
  for (std::size_t k = 0; k < corners.size(); ++k)
    longest = std::max(longest, glm::distance(corners[k], corners[(k + 1) % corners.size()]));
  return longest;
}

/// Irradiance at options.sensors, first band.
inline std::vector<double> irradiance(Device& device, const Scene& scene, const SolveOptions& options) {
  std::vector<double> all;
  for (const SensorResult& s : solve(device, scene, options).sensors) all.push_back(s.irradiance[0]);
  return all;
}

/// The report of `clrad solve` on the same scene with the same mesh, sensors and rays, and with `more` arguments. Its exit
/// code has to be 0.
oracle::json command_line_report(const ObjScene& scene, const SolveOptions& options,
                                 const std::vector<std::string>& more = {});
/// The sensors' irradiance in it, first band.
std::vector<double> command_line_irradiance(const ObjScene& scene, const SolveOptions& options,
                                            const std::vector<std::string>& more = {});

}  // namespace clrad::test
