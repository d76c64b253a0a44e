// The generated closed room full of boxes as a scene in memory, and visibility steps in it.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "boxes.hpp"
#include "clrad/frame.hpp"
#include "clrad/scene.hpp"
#include "clrad/visibility.hpp"
#include "mesh/build.hpp"
#include "scene/planes.hpp"
#include "solve/form_factor.hpp"

namespace clrad::bench {

inline Scene scene_of(const make_scene::Model& model, const std::string& name) {
  Scene scene;
  scene.file = name;
  scene.bands = {"red", "green", "blue"};
  for (const auto& m : model.materials())
    scene.materials.push_back({m.name,
                               {m.reflectance.red, m.reflectance.green, m.reflectance.blue},
                               {m.exitance.red, m.exitance.green, m.exitance.blue},
                               {}});
  for (const auto& f : model.faces()) {
    Polygon p;
    p.corners = f.corners;
    p.material = f.material;
    for (std::uint32_t k = 0; k < f.corners; ++k) {
      const auto& v = model.vertices()[f.vertex[k]];
      p.corner[k] = {v.x, v.y, v.z};
    }
    scene.polygons.push_back(std::move(p));
  }
  return scene;
}

inline Scene boxes_scene(int polygons) {
  return scene_of(make_scene::boxes(polygons, 1), "boxes_" + std::to_string(polygons));
}

/// Far longer than anything: one patch and one element a polygon.
constexpr double whole_polygons_m = 1e6;

/// A scene as visibility sees it: occluders, and the vertices of its polygons as receivers.
struct Setting {
  Scene scene;
  Mesh mesh;
  Frame frame;
  std::vector<OccluderTriangle> triangles;
  std::vector<std::uint32_t> planes;

  explicit Setting(int polygons) : Setting(boxes_scene(polygons), {whole_polygons_m, whole_polygons_m}) {}
  Setting(Scene from, const MeshOptions& options)
      : scene(std::move(from)), frame(frame_of(scene)), planes(plane_ids(scene)) {
    mesh = build_mesh(scene, frame, planes, options);
    triangles = occluder_triangles(scene, frame, planes);
  }
};

/// One shooter's samples and the receivers that face it.
struct Step {
  std::vector<Point> samples, receivers;
  std::uint64_t rays() const { return std::uint64_t(samples.size()) * receivers.size(); }
};

/// n samples on polygon `patch` against at most `most` receivers in front of it and facing it: neighbouring runs of
/// vertices, spread evenly over the scene. `order`: of the vertices, where it is not that of the mesh.
inline Step step_of(const Setting& s, std::uint32_t patch, std::uint32_t n, std::size_t most,
                    std::span<const std::uint32_t> order = {}) {
  Shooter shooter;
  const Patch& p = s.mesh.patches[patch];
  shooter.corners = p.corners;
  for (int k = 0; k < 4; ++k) shooter.corner[k] = p.corner[std::size_t(k)];
  shooter.normal = s.scene.polygons[p.polygon].normal();
  shooter.area = p.area_m2 * s.frame.scale() * s.frame.scale();
  shooter.plane = s.planes[p.polygon];
  Step step;
  step.samples = stratified_samples(shooter, n, patch);
  const glm::dvec3 middle = step.samples[n / 2].position;
  std::vector<Point> facing;
  for (std::uint32_t i = 0; i < s.mesh.vertex_count(); ++i) {
    const Point& r = s.mesh.receivers[order.empty() ? i : order[i]];
    if (r.plane != shooter.plane && glm::dot(r.position - middle, shooter.normal) > 0 &&
        glm::dot(middle - r.position, r.normal) > 0)
      facing.push_back(r);
  }
  constexpr std::size_t run = 64;
  const std::size_t runs = (facing.size() + run - 1) / run, wanted = std::max<std::size_t>(1, most / run);
  for (std::size_t k = 0; k < std::min(runs, wanted); ++k) {
    const std::size_t first = k * std::max(runs, wanted) / wanted * run;
    for (std::size_t i = first; i < std::min(first + run, facing.size()); ++i)
      step.receivers.push_back(facing[i]);
  }
  return step;
}

/// The lamp's light and `count` - 1 polygons of the scene, the same for the same scene.
inline std::vector<std::uint32_t> shooters(const Setting& s, std::size_t count) {
  std::mt19937 random(7);
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < s.scene.polygons.size() && chosen.empty(); ++i)
    if (s.scene.materials[s.scene.polygons[i].material].emitted_exitance[0] > 0) chosen.push_back(i);
  while (chosen.size() < count) chosen.push_back(std::uint32_t(random() % s.scene.polygons.size()));
  return chosen;
}

}  // namespace clrad::bench
