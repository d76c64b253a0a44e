// Direct light from point, spot and directional lights: at receivers of any kind, and as a part of a solve.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/frame.hpp"
#include "clrad/scene.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

class Glass;
class SolveState;

/// A scene's lights on the device (kernels/solve/lights.cl).
class Lights {
 public:
  /// `planes`: plane_ids() of the scene. A light that lies on a polygon counts as in front of it, and its rays ignore the
  /// polygon's plane. `glass`: what light has to pass; null: nothing.
  Lights(Device& device, const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes,
         const Glass* glass = nullptr);

  /// Adds H by the lights to irradiance[band * stride + i], i = first .. first + count - 1 the receiver, with `lost` what
  /// compensated sums still owe. `covered` (by receiver; null: none is) receive nothing. Visibility is exact; H is off by
  /// rounding: bound() below. `reaches`, when given, is set for every light of which something arrives.
  void irradiate(VisibilityEngine& engine, const PointArray& receivers, const Array<std::uint32_t>* covered,
                 std::uint32_t first, std::uint32_t count, RealArray& irradiance, RealArray& lost,
                 std::uint64_t stride, bool only_directional = false, std::vector<bool>* reaches = nullptr);

  /// How much irradiate() may be off at a receiver, as a multiple of `unit` (2^-24 or 2^-53): of H, and of what the lights
  /// would bring if they shone on it squarely. Per band. (host/solve/lights.cpp has the derivation.)
  std::vector<double> bound(const glm::dvec3& position_frame, std::span<const double> irradiance,
                            double unit) const;

  std::uint32_t count() const { return std::uint32_t(lights_.size()); }
  bool any_directional() const;
  const std::vector<std::string>& on_surfaces() const { return on_surfaces_; }  ///< names, for a warning
  const std::vector<PunctualLight>& lights() const { return lights_; }

 private:
  void upload(std::span<const std::uint32_t> planes, const Scene& scene, const Frame& frame);

  Device& device_;
  std::uint32_t bands_;
  Frame frame_;
  std::vector<PunctualLight> lights_;
  const Glass* glass_;
  std::vector<PointArray> points_;  ///< of each light; empty of a directional one
  std::vector<std::string> on_surfaces_;
  RealArray records_, intensities_, factors_;
  Array<std::uint32_t> flags_, active_, masks_;
  PointArray ends_;
};

/// What the lights bring to a mesh under solution.
struct LitByLights {
  Lights lights;
  RealArray vertex,
      patch;  ///< [band][vertex], [band][patch]: irradiance by lights alone; patches: area means
  std::vector<bool> reaches;  ///< by light, at the first mesh

  LitByLights(SolveState& state, const Frame& frame, std::span<const std::uint32_t> planes);
};

/// The parts that lights have in a solve; each does nothing where state.direct is null.
///
/// Once, before anything is shot: what lights bring to the vertices and by area means to the patches, whose reflection of it
/// they are then as if they emitted it. Between vertices irradiance is what the mesh interpolates: next to a light it is only as good as the
/// mesh is fine.
void light_first(SolveState& state);
/// The same after a checkpoint has brought state.direct back.
void light_resumed(SolveState& state);
/// After the mesh has grown: to the vertices from `first` on. parents: null, or as for interpolate_to_new().
void light_new(SolveState& state, std::uint32_t first, const Array<std::uint32_t>* parents = nullptr);
/// After patch irradiance was stated anew from columns alone.
void add_direct_to_patches(SolveState& state);
/// Before the irradiance of vertices is divided by their row sums, which is no business of the lights' part.
void hold_direct(SolveState& state);
/// A sentence for each light that lies on a surface or reaches none.
void warn_of_lights(const LitByLights& direct, std::vector<std::string>& warnings);
/// Power of the lights per band [W or lm]: 4 pi I of a point light, of a spot the integral over its cone; of directional
/// lights what arrives on the mesh.
std::vector<double> emitted_by_lights(SolveState& state);

}  // namespace clrad
