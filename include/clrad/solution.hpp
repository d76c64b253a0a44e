/// What a solve gives back: irradiance at every vertex, radiosity of every patch, irradiance at sensors, and
/// the report.
#pragma once
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/effects.hpp"
#include "clrad/frame.hpp"
#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"

namespace clrad {

/// Irradiance at a point, with an estimate of its error.
struct SensorResult {
  glm::dvec3 position_m{0, 0, 0};
  glm::dvec3 normal{0, 0, 1};
  std::vector<double> irradiance;        ///< H per band [W/m^2 or lm/m^2]
  std::vector<double> irradiance_error;  ///< one standard error, estimated [as irradiance]
};

struct Invariant {
  std::string name;
  double worst = 0, allowed = 0;
  bool holds = true;
};

struct ErrorPart {
  std::string name;
  double relative = 0;
  bool bound = false;  ///< a bound, else an estimate
};

/// One of the solves on the way to a target; edges in metres.
struct TargetStep {
  double patch_edge_m = 0, element_edge_m = 0;
  std::uint32_t samples = 0, light_samples = 0, sensor_rays = 0;
  double converge = 0;        ///< SolveOptions::converge
  double error_relative = 0;  ///< estimated
  double seconds = 0;         ///< without what compiling and loading kernels took
  /// What the steps before foretold of these two; NaN (null in JSON) of the first steps, which have none before.
  double predicted_error_relative = NAN, predicted_seconds = NAN;
};

/// How far a solution is from another; see clrad/accuracy.hpp.
struct Comparison {
  std::string file;                                 ///< of the other; empty: nothing was compared
  double rms_relative = NAN, worst_relative = NAN;  ///< relative to its mean irradiance
  bool by_vertices = false;                         ///< else by the means of input polygons
  std::uint64_t points = 0;
};

/// Everything of the JSON report that is not in the scene or the mesh. Per-band vectors have one entry a
/// band.
struct Report {
  std::vector<Effect> effects;  ///< in the order of plan_effects()
  std::vector<StageProfile> stages;
  std::uint64_t shoots = 0;    ///< patches traced and shot, re-shoots not counted
  std::uint64_t reshoots = 0;  ///< shots from kept columns
  std::uint64_t rays = 0, pieces = 0, candidates = 0, exact_tests = 0;
  /// build and solve: without what compiling and loading kernels took, which is in `total`.
  struct {
    double import = 0, build = 0, solve = 0, render = 0, total = 0;
  } seconds;
  struct {
    bool closed = false;
    std::vector<double> emitted, absorbed, unshot, unaccounted;  ///< [W or lm]
    double unaccounted_relative = 0;
  } energy;
  struct {
    /// RMS error of irradiance over the scene's exposed surfaces, relative to its mean there: root of the sum of squares of the
    /// parts that are estimates; bounds, of the worst place, stand beside it. NaN where a part is unknown, or nothing was estimated.
    double total_relative = NAN;
    double sensors_relative = NAN;        ///< the same over the sensors; NaN where there are none
    std::vector<ErrorPart> parts;         ///< of the scene, relative to the same mean
    std::vector<ErrorPart> sensor_parts;  ///< of the sensors: of their rays, and of the light that they see
  } error;
  /// Adaptive subdivision; all 0 without it.
  struct {
    std::uint32_t refinements = 0;  ///< how often elements were split
    std::uint64_t elements_split = 0, vertices_added = 0;
    std::uint64_t rays = 0;  ///< of re-shooting to added vertices: shot patches x vertices in front x samples
    /// Elements over the tolerance at the end that were not split, by what stopped them.
    std::uint64_t stopped_by_max_level = 0, stopped_by_min_area = 0, stopped_by_min_projected_area = 0,
                  stopped_by_memory = 0;
    std::uint64_t left_as_few =
        0;  ///< over it, too: fewer than 1 in 200 were left when the solution had converged
  } refinement;
  /// Rows of form factors: what they sum to, and what that means for the answer. Defects are shares of a row: area means and
  /// the worst. In a scene that is closed, proven or said so, |1 - row sum|; elsewhere how far the sum and the same sum
  /// by reciprocity are apart. NaN where not all columns were traced.
  struct {
    bool proven = false;   ///< the scene is proven closed
    std::string reason;    ///< why not
    bool applied = false;  ///< rows were closed
    double defect_before = NAN, worst_defect_before = NAN, defect_after = NAN, worst_defect_after = NAN;
    double amplification = NAN;     ///< radiosity / radiosity that the defects feign at first
    double amplified_defect = NAN;  ///< what they change, relative to the mean radiosity
    bool converges = true;          ///< false: amplified_defect > 1, or the solve came to a stand
  } closure;
  Comparison comparison;
  /// What `clrad plan` would have said of this solve; NaN where nobody asked.
  struct {
    double seconds = NAN;       ///< to compare with seconds.build + seconds.solve
    double device_bytes = NAN;  ///< with device_peak_bytes
  } predicted;
  /// Of a solve to a target (SolveOptions::target_error, time_budget_s); no steps without one.
  struct {
    double error_relative = 0, time_budget_s = 0;
    bool at_sensors = false;  ///< the error is that of the sensors
    bool met = true;
    std::vector<TargetStep> steps;
  } target;
  std::uint32_t sensor_rays =
      0;  ///< SolveOptions::sensor_rays, or as many as a target took; 0 of a solution that was loaded
  std::vector<Invariant> invariants;
  std::vector<std::string> warnings;
  std::uint64_t device_peak_bytes = 0, host_peak_bytes = 0;
  DeviceInfo device;
  std::vector<std::pair<std::string, std::string>> options;  ///< as used: name, value
};

/// Diffuse reflectances in a scene with textures; all three are empty in one without, where each polygon has its
/// material's. Dimensionless.
struct Reflectances {
  std::vector<double> element;  ///< [band][element], area means of the texture
  std::vector<double> patch;    ///< [band][patch], area means of the elements'
  std::vector<double> vertex;   ///< [band][vertex], area means of the elements' that have it as a corner
};

struct Solution {
  Scene scene;
  Frame frame;
  Mesh mesh;
  std::uint32_t bands = 1;
  std::vector<double> vertex_irradiance;     ///< [band][vertex] [W/m^2]
  std::vector<std::uint8_t> vertex_covered;  ///< 1: under or inside another surface
  std::vector<double> patch_irradiance;      ///< [band][patch], area means, covered parts included
  std::vector<SensorResult> sensors;         ///< file order
  /// Irradiance that the unshot light would bring if it were everywhere the same (Cohen et al. 1988, section 3.4), per
  /// band [W/m^2]. For previews of unfinished solutions: in no other number here.
  std::vector<double> ambient;
  bool stopped = false;        ///< ended before convergence, by the user or a budget
  double unshot_relative = 0;  ///< unshot / emitted power at the end
  Report report;
  Reflectances textured;

  std::uint32_t vertex_count() const { return mesh.vertex_count(); }
  const Material& material_of(std::uint32_t polygon) const {
    return scene.materials[scene.polygons[polygon].material];
  }
  /// Mean reflectance over a patch.
  double patch_reflectance(std::uint32_t band, std::uint32_t patch) const {
    return textured.patch.empty() ? material_of(mesh.patches[patch].polygon).reflectance[band]
                                  : textured.patch[std::size_t(band) * mesh.patches.size() + patch];
  }
  /// Mean reflectance around vertex v, which lies on polygon p.
  double vertex_reflectance(std::uint32_t band, std::uint32_t vertex, std::uint32_t polygon) const {
    return textured.vertex.empty() ? material_of(polygon).reflectance[band]
                                   : textured.vertex[std::size_t(band) * vertex_count() + vertex];
  }
  /// Radiosity B = E + rho H of vertex v, which lies on polygon p [W/m^2]. Not filled in for covered
  /// vertices.
  double vertex_radiosity(std::uint32_t band, std::uint32_t vertex, std::uint32_t polygon) const {
    return material_of(polygon).emitted_exitance[band] +
           vertex_reflectance(band, vertex, polygon) *
               vertex_irradiance[std::size_t(band) * vertex_count() + vertex];
  }
};

/// Radiosity to draw, [band][vertex]: as vertex_radiosity, but a covered vertex takes the mean of the
/// uncovered corners of its elements (each as often as it is one), so that no shadow bleeds out from under
/// what stands there and no light leaks in.
/// With `ambient`, rho x Solution::ambient is added.
std::vector<double> display_radiosity(const Solution& solution, bool ambient = false);
/// The same, but with the irradiance H on polygons that have a texture: a picture shows E + rho H there, with the texture's
/// own rho.
std::vector<double> display_light(const Solution& solution, bool ambient = false);
/// Irradiance to draw, [band][vertex], with covered vertices filled in likewise [W/m^2].
std::vector<double> display_irradiance(const Solution& solution);

/// Area-weighted means of one polygon.
struct PolygonMean {
  double area_m2 = 0;
  std::vector<double> radiosity, irradiance;  ///< per band [W/m^2]
};
std::vector<PolygonMean> polygon_means(const Solution& solution);

}  // namespace clrad
