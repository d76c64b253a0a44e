#include "solve/refine.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

#include "mesh/around.hpp"
#include "mesh/average.hpp"
#include "mesh/lattice.hpp"
#include "mesh/subdivide.hpp"
#include "mesh/touch.hpp"
#include "solve/covered.hpp"
#include "solve/near_field.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// Verdicts of refine.cl.
enum Verdict : std::uint32_t { keep, split, at_max_level, at_min_area, at_min_projected_area };

// Share of the elements below which those to split are left once the solution has converged: splits beget a few more,
// round after round, each at the cost of judging the whole mesh.
constexpr double few = 1.0 / 200;

// What is displayed may be off by this share of the difference that is tolerated.
constexpr double error_share = 1.0 / 8;

// What is seen beside an element counts that many times. Samples of visibility leave steps all over, each too small to matter;
// followed as kinks are, they would have everything split.
constexpr double seen_times_exact = 6, seen_times_sampled = 1;

struct Marks {
  std::vector<float> difference;
  std::vector<std::uint32_t> verdict;
};

// Area mean of the reflected radiosity, bands averaged, with what is unshot spread evenly: the same early and late.
double mean_reflected(SolveState& state) {
  const std::vector<double> irradiance = state.patch_irradiance.download(),
                            ambient = ambient_irradiance(state);
  double reflected = 0, area = 0;
  for (std::uint32_t p = 0; p < state.patches; ++p) {
    const Patch& patch = state.mesh.patches[p];
    area += patch.area_m2;
    for (std::uint32_t b = 0; b < state.bands; ++b)
      reflected += patch.area_m2 * state.reflectance(b, p) *
                   (irradiance[std::size_t(b) * state.patches + p] + ambient[b]) / state.bands;
  }
  return area > 0 ? reflected / area : 0;
}

// What projected_area() of refine.cl takes.
std::vector<double> camera_numbers(const AdaptiveOptions& options, const Frame& frame) {
  std::vector<double> numbers(14, 0.0);
  if (!(options.min_projected_area_px > 0)) return numbers;
  const Camera& camera = options.camera;
  const glm::dvec3 eye = frame.to_frame(camera.eye), forward = glm::normalize(camera.target - camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up)), up = glm::cross(right, forward);
  const double tangent = std::tan(camera.vertical_field_of_view_rad / 2);
  for (int a = 0; a < 3; ++a) {
    numbers[std::size_t(a)] = eye[a];
    numbers[3 + std::size_t(a)] = forward[a];
    numbers[6 + std::size_t(a)] = right[a] / (tangent * options.width / options.height);
    numbers[9 + std::size_t(a)] = up[a] / tangent;
  }
  numbers[12] = options.width / 2.0, numbers[13] = options.height / 2.0;
  return numbers;
}

// Level of a polygon's elements in the first mesh.
std::uint32_t first_level(const PolygonMesh& polygon) {
  std::uint32_t level = 0;
  while (polygon.patches_u << level < polygon.cells_u) ++level;
  return level;
}

Marks mark(SolveState& state, const Frame& frame, double tolerated) {
  const auto stage = state.device.stage("find elements to split");
  const AdaptiveOptions& options = state.options.adaptive;
  const Mesh& mesh = state.mesh;
  const auto elements = std::uint32_t(mesh.elements.size());
  std::vector<std::uint32_t> vertex, middle, patch, level, levels_left, made_at, parents;
  std::vector<double> area, reflectance(std::size_t(state.bands) * state.patches);
  for (const PolygonMesh& polygon : mesh.polygons) {
    const std::uint32_t last = std::min(first_level(polygon) + options.max_level, lattice_depth);
    for (std::uint32_t i = 0; i < polygon.elements; ++i) {
      const Element& e = mesh.elements[polygon.first_element + i];
      vertex.insert(vertex.end(), e.vertex.begin(), e.vertex.end());
      middle.insert(middle.end(), e.middle.begin(), e.middle.end());
      patch.push_back(e.patch);
      area.push_back(e.area_m2);
      level.push_back(e.level);
      levels_left.push_back(last - std::min(last, e.level));
    }
  }
  for (std::uint32_t p = 0; p < state.patches; ++p)
    for (std::uint32_t b = 0; b < state.bands; ++b)
      reflectance[std::size_t(b) * state.patches + p] = state.reflectance(b, p);
  for (const auto& at : mesh.lattice) {
    const auto zeros = std::uint32_t(std::countr_zero(at[0] | at[1]));
    made_at.push_back(lattice_depth - std::min(zeros, lattice_depth));
  }
  for (const auto& of : mesh.parents) parents.insert(parents.end(), of.begin(), of.end());
  const Array<std::uint32_t> parents_device(state.device, parents, "parents of vertices"),
      made_device(state.device, made_at, "levels of vertices"),
      vertex_device(state.device, vertex, "element corners"),
      middle_device(state.device, middle, "element T-vertices"),
      patch_device(state.device, patch, "element patches"),
      level_device(state.device, level, "element levels"),
      left_device(state.device, levels_left, "element levels");
  const RealArray area_device(state.device, area, "element areas"),
      reflectance_device(state.device, reflectance, "reflectances"),
      camera(state.device, camera_numbers(options, frame), "the camera");
  std::vector<std::uint32_t> around;
  for (const auto& of : around_parents(mesh, state.covered_on_host))
    around.insert(around.end(), of.begin(), of.end());
  const Array<std::uint32_t> around_device(state.device, around, "vertices around parents");
  RealArray surprise(state.device, std::size_t(state.bands) * state.vertices, "surprise");
  state.device.run("solve/refine.cl", "expect", std::uint64_t(state.vertices) * state.bands,
                   state.vertex_irradiance, parents_device, around_device, state.covered, surprise,
                   state.vertices, state.bands);
  const double seen_times = state.clip ? seen_times_exact : seen_times_sampled;
  Array<float> difference(state.device, elements, "radiosity differences");
  Array<std::uint32_t> verdict(state.device, elements, "elements to split");
  state.device.run("solve/refine.cl", "mark_elements", elements, state.vertex_irradiance, surprise,
                   vertex_device, middle_device, made_device, parents_device, state.covered, patch_device,
                   reflectance_device, area_device, level_device, left_device, state.receivers, camera,
                   state.vertices, state.patches, state.bands, Real{tolerated}, Real{error_share * tolerated},
                   Real{seen_times}, Real{options.min_area_m2}, Real{options.min_projected_area_px},
                   difference, verdict, elements);
  return {difference.download(), verdict.download()};
}

// By what is going to be displayed: near patches by their pieces. That is gathered for vertices added since the last time
// only, as it hardly changes at the others. The state keeps its irradiance.
Marks mark_with_near_field(SolveState& state, Solution& solution, double tolerated) {
  const std::size_t vertices = state.vertices, known = state.near_field.size() / state.bands;
  solution.vertex_irradiance = state.vertex_irradiance.download();
  solution.patch_irradiance = state.patch_irradiance.download();
  std::vector<double> near = near_field(state, solution, std::uint32_t(known)).download(),
                      displayed = solution.vertex_irradiance;
  for (std::size_t b = 0; b < state.bands; ++b)
    for (std::size_t v = 0; v < vertices; ++v) {
      const std::size_t i = b * vertices + v;
      if (v < known) near[i] = state.near_field[b * known + v];
      displayed[i] += near[i];
    }
  state.near_field = std::move(near);
  state.vertex_irradiance.upload(displayed);
  Marks marks = mark(state, solution.frame, tolerated);
  state.vertex_irradiance.upload(solution.vertex_irradiance);
  return marks;
}

// As many of the elements to split as there is memory for, the largest differences first; returns how many had to stay.
std::uint64_t fit_memory(const SolveState& state, Marks& marks) {
  std::vector<std::uint32_t> wanted;
  for (std::uint32_t e = 0; e < marks.verdict.size(); ++e)
    if (marks.verdict[e] == split) wanted.push_back(e);
  // Five new vertices at most, and as many again for neighbours that have to follow.
  const std::uint64_t fit = state.keeps_all_columns() ? state.vertices_left() / 10 : 0;
  if (wanted.size() <= fit) return 0;
  std::sort(wanted.begin(), wanted.end(), [&](std::uint32_t a, std::uint32_t b) {
    return marks.difference[a] != marks.difference[b] ? marks.difference[a] > marks.difference[b] : a < b;
  });
  for (std::size_t i = fit; i < wanted.size(); ++i) marks.verdict[wanted[i]] = keep;
  return wanted.size() - fit;
}

// Elements that have the same owner as a neighbour: it was split.
std::vector<std::uint32_t> children_in(const std::vector<std::uint32_t>& owner) {
  std::vector<std::uint32_t> children;
  for (std::uint32_t e = 0; e < owner.size(); ++e)
    if ((e > 0 && owner[e] == owner[e - 1]) || (e + 1 < owner.size() && owner[e] == owner[e + 1]))
      children.push_back(e);
  return children;
}

}  // namespace

std::vector<double> ambient_irradiance(SolveState& state) {
  const std::vector<double> unshot = state.unshot.download();
  std::vector<double> result(state.bands, 0);
  for (std::uint32_t b = 0; b < state.bands; ++b) {
    double power = 0, reflecting = 0, area = 0;
    for (std::uint32_t p = 0; p < state.patches; ++p) {
      const Patch& patch = state.mesh.patches[p];
      area += patch.area_m2;
      reflecting += patch.area_m2 * state.reflectance(b, p);
      power += patch.area_m2 * state.exposed[p] * unshot[std::size_t(b) * state.patches + p];
    }
    if (area > 0 && reflecting < area) result[b] = power / (area - reflecting);
  }
  return result;
}

bool refine(SolveState& state, Solution& solution, const std::vector<OccluderTriangle>& triangles,
            bool converged) {
  state.shoots_since_refined = 0;
  deliver_pending(state);
  if (!state.interreflection) gather_direct(state);
  const double tolerated = state.options.adaptive.tolerance * mean_reflected(state);
  if (!(tolerated > 0)) return false;
  Marks marks = converged && state.options.near_field ? mark_with_near_field(state, solution, tolerated)
                                                      : mark(state, solution.frame, tolerated);
  auto& report = solution.report.refinement;
  const auto count = [&](Verdict v) {
    return std::uint64_t(std::count(marks.verdict.begin(), marks.verdict.end(), v));
  };
  report.stopped_by_memory = fit_memory(state, marks);
  report.stopped_by_max_level = count(at_max_level);
  report.stopped_by_min_area = count(at_min_area);
  report.stopped_by_min_projected_area = count(at_min_projected_area);
  report.left_as_few = converged && count(split) < marks.verdict.size() * few ? count(split) : 0;
  if (count(split) == report.left_as_few) return false;

  std::vector<std::uint32_t> chosen(marks.verdict.size());
  std::transform(marks.verdict.begin(), marks.verdict.end(), chosen.begin(),
                 [](std::uint32_t v) { return v == split ? 1u : 0u; });
  Subdivision subdivision;
  {
    const auto stage = state.device.stage("subdivide elements");
    subdivision = subdivide(state.device, state.scene, solution.frame, state.mesh, std::move(chosen));
  }
  const std::uint32_t first = subdivision.first_vertex;
  if (state.tree) move_off_touched(state.device, state.scene, solution.frame, *state.tree, state.mesh, first);
  const auto overlaid = overlaid_vertices(state.scene, state.mesh, first);
  const auto covered =
      covered_vertices(state.device, state.scene, state.mesh, triangles, state.engine, overlaid, first);
  state.covered_on_host.insert(state.covered_on_host.end(), covered.begin(), covered.end());
  weigh_exposed(state.device, state.scene, state.mesh, triangles, state.engine, state.covered_on_host,
                children_in(subdivision.owner));
  average_by_parents(state.mesh, state.covered_on_host);
  state.take_mesh();
  if (state.options.adaptive.interpolate_new) {
    std::vector<std::uint32_t> parents;
    for (std::uint32_t v = first; v < state.vertices; ++v)
      parents.insert(parents.end(), state.mesh.parents[v].begin(), state.mesh.parents[v].end());
    if (parents.empty()) parents.assign(4, 0);
    const Array<std::uint32_t> parents_device(state.device, parents, "parents of new vertices");
    light_new(state, first, &parents_device);
    interpolate_to_new(state, first, parents_device);
  } else {
    light_new(state, first);
    report.rays += shoot_to_new(state, first);
  }
  if (state.interreflection) restate(state);
  ++report.refinements;
  report.elements_split += subdivision.split;
  report.vertices_added += state.vertices - first;
  return true;
}

}  // namespace clrad
