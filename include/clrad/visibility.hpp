/// Who sees whom: occluders, points, and the engines that answer for many segments at once. Every engine gives the
/// same bits, because "blocked" is one exact predicate on a snapped grid (kernels/shared/predicate.cl).
#pragma once
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clrad/device.hpp"

namespace clrad {

/// An end of a segment, in the scene's frame (coordinates in [-1, 1); up to +-4 are allowed).
struct Point {
  glm::dvec3 position{0, 0, 0};
  glm::dvec3 normal{0, 0, 1};         ///< unit length
  std::uint32_t plane = 0xffffffffu;  ///< segments ignore occluders of this plane; 0xffffffff: none
  std::uint32_t surface = 0xffffffffu;
};

/// Points on the device (clrad_point_float or _double of kernels/shared/types.h, as the precision says). Positions are
/// kept as hi + lo: 48 bits in float.
class PointArray : public RawArray {
 public:
  PointArray() = default;
  PointArray(Device& device, std::uint64_t count, std::string_view what);
  PointArray(Device& device, std::span<const Point> points, std::string_view what);
  std::uint64_t size() const { return count_; }
  void upload(std::span<const Point> points, std::uint64_t at = 0);
  std::vector<Point> download() const;

 private:
  std::uint64_t count_ = 0;
};

/// A triangle that blocks from both sides, in the scene's frame.
struct OccluderTriangle {
  glm::dvec3 corner[3];
  std::uint32_t plane = 0;    ///< equal for triangles in one plane, whichever way they face
  std::uint32_t polygon = 0;  ///< index into Scene::polygons; a quad gives two triangles
};

/// Which segments to test. samples > 0: every chosen origin against each of the first `samples` targets, segment
/// o * samples + k. samples == 0: origin i against target i (the chosen origin's index).
struct Segments {
  const PointArray* origins = nullptr;
  const Array<std::uint32_t>* active = nullptr;  ///< indices into origins; null: all of them in order
  std::uint32_t origin_count = 0;                ///< how many of active (or of origins)
  const PointArray* targets = nullptr;
  std::uint32_t samples = 0;

  std::uint64_t count() const { return std::uint64_t(origin_count) * (samples ? samples : 1); }
  std::uint32_t words_per_origin() const { return samples ? (samples + 31) / 32 : 1; }
};

/// What an engine did so far, for the report.
struct VisibilityCounts {
  std::uint64_t rays = 0;        ///< segments asked for
  std::uint64_t pieces = 0;      ///< ray/voxel pieces made by chopping
  std::uint64_t candidates = 0;  ///< ray/triangle pairs tested
  std::uint64_t exact = 0;       ///< pairs that needed the exact predicate
};

class VisibilityEngine {
 public:
  virtual ~VisibilityEngine() = default;
  virtual std::string name() const = 0;
  /// masks: words_per_origin() words per chosen origin, in the order chosen; bit k % 32 of word k / 32 is set when
  /// segment k is occluded. Unused bits are 0.
  virtual void occluded(const Segments& segments, Array<std::uint32_t>& masks) = 0;
  /// Per segment, the triangle it meets first, going from origin to target (0xffffffff: none), and where: t in [0, 1]
  /// of the segment; 1 where there is none. Of equal t the lower triangle index.
  virtual void intersect_closest(const Segments& segments, Array<std::uint32_t>& triangle,
                                 Array<float>& t) = 0;
  virtual VisibilityCounts counts() const = 0;
  /// How it chose between ways to the same answer, and why, in a sentence; empty where it has no choice.
  virtual std::string account() const { return {}; }
};

/// `serial` (object-serial / ray-parallel, section 1.3.1 of the paper), `chop` (object-parallel / ray-parallel, section
/// 1.3.2) or `shaft` (a tree of boxes walked by hulls of many segments, and by packets; the fastest). Zero-area triangles block nothing and are dropped. The triangles' order is what results index.
std::unique_ptr<VisibilityEngine> make_engine(const std::string& name, Device& device,
                                              std::span<const OccluderTriangle> triangles);
std::vector<std::string> engine_names();

}  // namespace clrad
