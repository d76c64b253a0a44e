// A finished solution as a file, and back: what pictures, files and the report are made from.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "clrad/output.hpp"
#include "output/archive_parts.hpp"
#include "output/fields.hpp"

namespace clrad {

void write_solution(const std::string& path, const Solution& solution) {
  if (lower_ending(path) != ".clrad")
    throw UsageError(fmt::format("cannot write {}: the ending of a solution's file is .clrad", path));
  const auto& [scene, frame, mesh, bands, vertex_irradiance, vertex_covered, patch_irradiance, sensors,
               ambient, stopped, unshot_relative, report, textured] = solution;
  ArchiveWriter archive(path, "solution");
  add_scene(archive, scene);
  add_mesh(archive, mesh);
  archive.add("vertex_irradiance", vertex_irradiance);
  archive.add("vertex_covered", vertex_covered);
  archive.add("patch_irradiance", patch_irradiance);
  archive.add("ambient", ambient);
  if (!textured.patch.empty()) {
    archive.add("reflectance.element", textured.element);
    archive.add("reflectance.patch", textured.patch);
    archive.add("reflectance.vertex", textured.vertex);
  }
  archive.add_json("solution", {{"frame", put(frame)},
                                {"bands", bands},
                                {"stopped", stopped},
                                {"unshot_relative", unshot_relative},
                                {"sensors", put(sensors)},
                                {"report", put(report)}});
  archive.finish();
}

Solution load_solution(const std::string& path) {
  ArchiveReader archive(path, "solution");
  Solution s;
  const nlohmann::json json = archive.json("solution");
  try {
    get(json.at("frame"), s.frame), get(json.at("bands"), s.bands), get(json.at("stopped"), s.stopped);
    get(json.at("unshot_relative"), s.unshot_relative);
    get(json.at("sensors"), s.sensors), get(json.at("report"), s.report);
  } catch (const nlohmann::json::exception& e) {
    archive.fail(fmt::format("section 'solution' cannot be understood: {}", e.what()));
  }
  s.scene = read_scene(archive);
  s.mesh = read_mesh(archive, s.scene);
  if (s.bands != s.scene.bands.size())
    archive.fail(fmt::format("its scene has {} bands, not {}", s.scene.bands.size(), s.bands));
  // Frames of scenes whose coordinates are doubles have exponents in the range of theirs.
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(s.frame.centre[k]) || std::abs(s.frame.exponent) > 1100)
      archive.fail("the frame is not one of a scene");
  s.vertex_irradiance =
      archive.finite<double>("vertex_irradiance", std::uint64_t(s.bands) * s.vertex_count());
  s.vertex_covered = archive.array<std::uint8_t>("vertex_covered", s.vertex_count());
  s.patch_irradiance =
      archive.finite<double>("patch_irradiance", std::uint64_t(s.bands) * s.mesh.patches.size());
  s.ambient = archive.finite<double>("ambient");
  if (archive.has("reflectance.patch")) {
    const auto shares = [&](const std::string& name, std::size_t count) {
      std::vector<double> values = archive.finite<double>(name, s.bands * std::uint64_t(count));
      if (!std::all_of(values.begin(), values.end(), [](double rho) { return rho >= 0 && rho <= 1; }))
        archive.fail("section '" + name + "' holds what is no reflectance");
      return values;
    };
    s.textured = {shares("reflectance.element", s.mesh.elements.size()),
                  shares("reflectance.patch", s.mesh.patches.size()),
                  shares("reflectance.vertex", s.vertex_count())};
  } else if (has_textures(s.scene)) {
    archive.fail("its scene has textures, but their means are missing");
  }
  return s;
}

}  // namespace clrad
