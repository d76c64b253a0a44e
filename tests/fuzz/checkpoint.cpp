#include "solve/checkpoint.hpp"

#include <cmath>

#include "fuzz/archive_case.hpp"

namespace clrad::fuzz {
namespace {

// Two triangles that face each other: the scene that the seeds of checkpoints are of.
Scene two_triangles() {
  Scene scene;
  scene.bands = {"grey"};
  scene.materials = {{"light", {0.5}, {1}, {}}};
  for (const double z : {0.0, 1.0}) {
    Polygon p;
    p.corner = {{{0, z, z}, {1, 0, z}, {0, 1 - z, z}}};
    p.corners = 3;
    scene.polygons.push_back(p);
  }
  return scene;
}

}  // namespace

void checkpoint(Bytes bytes) {
  const std::string path = write_archive("a.ck", bytes);
  try {
    // Whatever the conditions say, take them for what is asked for: the rest is then read.
    ArchiveReader archive(path, "checkpoint");
    nlohmann::json now = nlohmann::json::array();
    for (const auto& pair : archive.json("conditions"))
      if (pair.is_array() && pair.size() == 2 && pair[0].is_string()) now.push_back(pair);
    Checkpoint read(path, now);
    Solution solution;
    solution.scene = two_triangles();
    solution.bands = 1;
    read.read_mesh(solution);
    require(solution.vertex_covered.size() == solution.vertex_count(), "a vertex of which nothing is known");
    const auto patches = std::uint32_t(solution.mesh.patches.size());
    const CheckpointNumbers n = read.read_numbers(solution.bands, solution.vertex_count(), patches);
    require(std::isfinite(n.emitted_power) && std::isfinite(n.seconds), "a number that is not finite");
    require(n.patch_of_slot.size() <= patches, "more columns than patches");
  } catch (const InputError& e) {
    require_message(e.what(), path);
  }
}

}  // namespace clrad::fuzz
