// Everything on the device that a solve changes, and the columns it keeps.
#pragma once
#include <memory>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/mesh.hpp"
#include "clrad/options.hpp"
#include "clrad/scene.hpp"
#include "clrad/solution.hpp"
#include "clrad/visibility.hpp"
#include "mesh/gather.hpp"
#include "scene/enclosure.hpp"
#include "solve/lights.hpp"

namespace clrad {

class Clip;
class Glass;
struct Tree;

/// What a column that is traced keeps until the device has answered.
struct ColumnScratch {
  Array<std::uint32_t> active, rest;  ///< receivers in front; those of them that are not done yet
  RealArray factors;                  ///< by place in active
};

/// Arrays are [band][patch] or [band][vertex]; "lost" ones hold what compensated sums still owe. Radiosities and
/// irradiances in W/m^2.
class SolveState {
 public:
  /// `mesh` and `covered` (a byte a vertex) may grow in adaptive subdivision; take_mesh() follows. `textured`, where there is
  /// one, gets the means of textures over that mesh and has to outlive this; without, each polygon has its material's reflectance.
  SolveState(Device& device, const Scene& scene, Mesh& mesh, std::uint32_t bands, VisibilityEngine& engine,
             const SolveOptions& options, std::vector<std::uint8_t>& covered, double metres_per_unit,
             const Glass* glass = nullptr, Reflectances* textured = nullptr);

  Device& device;
  const Scene& scene;
  Mesh& mesh;
  std::vector<std::uint8_t>& covered_on_host;
  const std::uint32_t bands, patches;
  std::uint32_t vertices = 0;
  VisibilityEngine& engine;
  const SolveOptions& options;
  const double metres_per_unit;  ///< length of one frame unit
  const Glass* const glass;      ///< null: no light passes any
  bool through_glass = false;    ///< light reaches something by way of it
  /// Columns that a shooter has: 1, or one a band where glass is coloured. Band b takes number b % colours.
  const std::uint32_t colours;
  const Tree* tree = nullptr;    ///< of what may stand in the way; null: nothing
  Clip* clip = nullptr;          ///< where shooters are clipped (--visibility-exact), else null
  Reflectances* const textured;  ///< or null

  // Effects that run (clrad/effects.hpp).
  bool occlusion = true;        ///< something may stand between two surfaces
  bool interreflection = true;  ///< light is followed past the first surface that it meets

  PointArray receivers;
  Array<std::uint32_t> covered;
  Array<std::uint32_t> order;  ///< of receivers: neighbours in space one after another
  std::unique_ptr<Gatherer> gatherer;

  std::vector<double> exposed;                     ///< [patch], share of the area that nothing covers
  RealArray patch_area, patch_rho, patch_emitted;  ///< [patch], [band][patch], [band][patch]
  RealArray unshot, unshot_lost;                   ///< [band][patch]
  RealArray patch_irradiance, patch_irradiance_lost;
  RealArray total_shot, total_shot_lo,  ///< ever shot, as hi + lo
      pending;                          ///< shot but not yet delivered to the vertices
  RealArray vertex_irradiance, vertex_irradiance_lost;
  RealArray shot, shot_by_slot;                ///< [band][k] the shots under way; [band][slot] of a re-shoot
  Array<float> power;                          ///< [patch], unshot power
  Array<std::uint32_t> facing, chosen, masks;  ///< scratch of one shoot
  std::vector<ColumnScratch> scratch;          ///< of columns that are traced together
  Array<std::uint32_t> counts;                 ///< two words each
  RealArray column;                            ///< [colour][receiver]
  /// Sum over bands and patches of area x E, and of area x H by lights, at first [W]. What is unshot is measured by it.
  double emitted_power = 0;
  /// What lights bring, where the effect "lights" runs: in vertex and patch irradiance and, reflected, in patch_emitted.
  std::unique_ptr<LitByLights> direct;

  // Kept columns. Patch columns are always kept: slot s holds F of its shooter to every patch, x what glass lets pass. Vertex columns are kept
  // while their share of the memory lasts.
  std::vector<std::uint32_t> slot_of_patch;  ///< 0xffffffff: never shot
  std::vector<std::uint32_t> patch_of_slot;
  Array<std::uint32_t> slot_of_patch_device, patch_of_slot_device;
  RealArray patch_columns;                                 ///< [slot][colour][patch]
  std::vector<std::unique_ptr<RealArray>> vertex_columns;  ///< by slot; null when not kept
  std::uint64_t shoots = 0, reshoots = 0;

  // Rows of the linear system (kernels/solve/balance.cl).
  Enclosure enclosure;                            ///< whether the scene is proven closed
  bool closes_rows = false;                       ///< rows of patches are to be closed (decide_closing())
  bool closes_vertices = false;                   ///< those of vertices, too
  bool balanced = false;                          ///< they are
  RealArray vertex_row_sum, vertex_row_sum_lost;  ///< [vertex], over all columns traced, of the first colour
  std::vector<double> row_sum;                    ///< [colour][patch]
  RealArray loss, coupling, row_scale;            ///< [band][patch], [band][patch], [patch]
  std::uint32_t rows_of_slots = 0xffffffffu;      ///< how many columns the last four are of
  double unshot_before_sweep = 1e9;  ///< relative, when kept columns were last shot again in a row
  std::uint32_t stalls = 0;          ///< solver cycles that brought little
  std::uint32_t shoots_since_refined = 0;
  /// What the near field last added to the vertices that there were then, [band][vertex]: by it elements are judged.
  std::vector<double> near_field;
  std::uint64_t given_back_bytes = 0;  ///< of columns that grew, since the device was last waited for
  std::uint64_t column_budget_bytes = 0, column_bytes = 0;  ///< of kept columns: at most, and now

  const Material& material(std::uint32_t patch) const {
    return scene.materials[scene.polygons[mesh.patches[patch].polygon].material];
  }
  /// Mean reflectance over a patch.
  double reflectance(std::uint32_t band, std::uint32_t patch) const {
    return textured ? textured->patch[std::size_t(band) * patches + patch]
                    : material(patch).reflectance[band];
  }
  /// A slot for the column of `patch`, growing the array of columns when it is full.
  std::uint32_t add_slot(std::uint32_t patch);
  /// Room for one more vertex column inside the budget, or null.
  std::unique_ptr<RealArray> vertex_column();
  /// Vertices that there would still be memory for if every patch were to keep its column.
  std::uint64_t vertices_left() const;
  /// True while no vertex column had to be left out.
  bool keeps_all_columns() const;

  /// After the mesh has grown: arrays of vertices with room for the new ones (irradiance 0 there), the new element array,
  /// and reflectances by what is exposed now. Kept columns grow by extend_column().
  void take_mesh();
  /// The kept column of `slot` with room for the vertices added since; their entries are to be filled in.
  RealArray& extend_column(std::uint32_t slot);

 private:
  void upload_patches();
};

}  // namespace clrad
