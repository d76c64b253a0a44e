/// View factors between the polygons of a scene, with occlusion: the matrix that thermal engineers work with.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/scene.hpp"

namespace clrad {

/// What one row of the matrix stands for.
enum class ViewFactorRows {
  faces,    ///< a face of the file; the pieces into which reading cut it count as one
  objects,  ///< all faces of one name
};

struct ViewFactorProgress {
  std::uint64_t pairs_done = 0, pairs = 0;
  double seconds = 0;
};

struct ViewFactorOptions {
  /// Asked of the estimated error of each entry, relative to it. Entries below 1e-3 x min(1, A_j / A_i) that something
  /// partly hides are held to target_error x that number instead. In (0, 0.1].
  double target_error = 1e-4;
  ViewFactorRows rows = ViewFactorRows::faces;
  /// Of the pairs, about this many are integrated over the other polygon, too, to measure reciprocity. 0: none.
  std::uint32_t reciprocity_sample = 32;
  /// Pieces of a polygon, as seen from a point past its occluders, that may wait; where more do, the polygon is
  /// halved. Memory grows with it, results do not depend on it but for rounding.
  std::uint32_t stack_pieces = 64;
  /// Called now and then; false ends the work: the result has what was done so far and is marked `stopped`.
  std::function<bool(const ViewFactorProgress&)> progress{};
};

/// Compressed sparse rows. F_ij: the share of what i sends out, diffusely, that arrives at j.
struct ViewFactors {
  std::vector<std::string> name;        ///< per row; may repeat
  std::vector<SourceLocation> where;    ///< per row
  std::vector<double> area_m2;          ///< per row
  std::vector<double> emissivity;       ///< per row: 1 - reflectance, averaged over bands (and area)
  std::vector<std::uint64_t> first{0};  ///< row i holds entries first[i] .. first[i + 1]
  std::vector<std::uint32_t> column;    ///< ascending in each row
  std::vector<double> factor;           ///< F_ij > 0, dimensionless
  std::vector<double> error;            ///< estimate of its absolute error

  std::vector<double> row_sum;    ///< sum over j of F_ij
  std::vector<double> row_error;  ///< sum over j of the errors
  bool closed = false;            ///< the scene is watertight: every row should sum to 1
  double worst_row_defect = 0;    ///< largest |row sum - 1| of a complete row when closed
  double worst_relative_error =
      0;  ///< largest error / F_ij, small F_ij as ViewFactorOptions::target_error has it
  std::uint64_t over_target = 0;  ///< entries whose error is above what was asked
  /// Of the sampled pairs: |A_i F_ij - A_j F_ji| / (A_i F_ij), F_ji integrated anew over j; small factors as in
  /// worst_relative_error.
  struct {
    std::uint64_t pairs = 0;
    double worst = 0, estimated = 0;  ///< `estimated`: sum of the two error estimates of that pair, relative
    /// Pairs whose defect is above the sum of their error estimates, and above three times that.
    std::uint64_t beyond = 0, far_beyond = 0;
  } reciprocity;
  std::uint64_t pairs = 0, hidden_pairs = 0;  ///< that face each other; of these, with something in between
  std::uint64_t points = 0;                   ///< point factors evaluated
  double seconds = 0;
  bool stopped =
      false;  ///< ended by the caller: pairs that were not begun are missing, others have the error reached
  std::vector<bool> complete;  ///< per row: all its pairs are done; all true unless stopped
  std::uint64_t pairs_done = 0, pairs_asked = 0;  ///< of all pairs of polygons

  std::uint32_t rows() const { return std::uint32_t(area_m2.size()); }
  /// F_ij, 0 where nothing is stored.
  double at(std::uint32_t i, std::uint32_t j) const;
  double error_at(std::uint32_t i, std::uint32_t j) const;
};

/// Area-to-area factors by adaptive Gauss quadrature over one polygon of a pair of the exact form factor of its points to
/// the visible part of the other; see kernels/viewfactors/integrate.cl. Polygons are one-sided, but for those
/// whose material is two-sided: their backs have rows of their own. All block from both sides; of coplanar ones facing the same way the later lies on top, and what it covers sees nothing. Each pair is
/// integrated once, F_ji = A_i F_ij / A_j. Use a device of Precision::float64 for errors below about 1e-4.
/// Throws UsageError (options) or DeviceError.
ViewFactors view_factors(Device& device, const Scene& scene, const ViewFactorOptions& options = {});

/// Writes the matrix, by the ending of `path`: .mtx MatrixMarket (areas and names in comments), .npz what
/// scipy.sparse.load_npz reads (with arrays area_m2, emissivity, error, row_sum and name beside the matrix), .vf or .txt
/// View3D's text format (areas and emissivities). UsageError for other endings.
void write_view_factors(const std::string& path, const ViewFactors& factors);
/// The JSON report: rows with names, areas, sums and defects; errors; counts. Its schema is in the README.
std::string view_factor_report_json(const ViewFactors& factors, const Scene& scene, const Device& device,
                                    const ViewFactorOptions& options, const std::string& matrix_file);

}  // namespace clrad
