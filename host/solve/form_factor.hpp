/// Form factors of receivers to one shooter: the three estimators, what of them is visible, and which
/// receivers face the shooter at all. Launches kernels/solve/form_factor.cl; the numerics are in
/// kernels/shared/factor.cl.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/options.hpp"
#include "clrad/visibility.hpp"

namespace clrad {

class Glass;

/// A planar convex polygon in the scene's frame that shoots to its front; corners counter-clockwise seen from
/// there.
struct Shooter {
  std::uint32_t corners = 0;  ///< 3 or 4
  glm::dvec3 corner[4]{};
  glm::dvec3 normal{0, 0, 1};  ///< unit length
  double area = 0;             ///< in frame units squared
  std::uint32_t plane = 0xffffffffu;
};

constexpr std::size_t shooter_record_size = 52;  // CLRAD_SHOOTER_SIZE
/// What kernels/shared/factor.cl knows of a shooter; give it to a RealArray.
std::array<double, shooter_record_size> shooter_record(const Shooter& shooter);

/// n points on the shooter, uniform by area and stratified: jittered cells of a grid where n has two similar
/// divisors, the shifted R2 sequence (Roberts 2018) elsewhere. The same for the same seed; neighbours follow
/// each other (Morton order). They carry the shooter's normal and plane.
std::vector<Point> stratified_samples(const Shooter& shooter, std::uint32_t n, std::uint64_t seed);

/// flags[i] = 1 where receiver first + i, i < count, is in front of the shooter's plane, not in the same plane, and at
/// least one corner of the shooter is above i's horizon; else 0.
void facing(Device& device, const Shooter& shooter, const PointArray& receivers, std::uint32_t first,
            std::uint32_t count, Array<std::uint32_t>& flags);

/// Form factor of every chosen receiver to the shooter, as if nothing stood between: factors[i] for receiver
/// active[i] (or i when active is null), i < count. `disk` and `subdisk` sum over the n samples; `exact` does
/// not look at them.
void form_factors(Device& device, Estimator estimator, const Shooter& shooter, const PointArray& receivers,
                  const Array<std::uint32_t>* active, std::uint32_t count, const PointArray& samples,
                  std::uint32_t n, RealArray& factors);

/// The same where nothing can stand between: column[r] for every chosen receiver r, the bits that visible_factors() gives with
/// no sample occluded; other entries stay as they are. samples: null for `exact`.
void unoccluded_factors(Device& device, Estimator estimator, const Shooter& shooter,
                        const PointArray& receivers, const Array<std::uint32_t>& active, std::uint32_t count,
                        const PointArray* samples, std::uint32_t n, RealArray& column);

/// Form factor times visible fraction: column[r] for every chosen receiver r; other entries stay as they are.
/// masks: ceil(n / 32) words per chosen receiver as VisibilityEngine::occluded gives them; factors: from
/// form_factors.
///  - exact: the fraction is sum over visible samples of w_k / sum of w_k, with the sample's own kernel
///    w_k = cos cos / r^2, 0 below the horizon. Where F > 0 but no sample is above the horizon, one more
///    segment to the centroid of the clipped shooter decides.
///  - disk: F = A / n sum_visible cos cos / (pi r^2 + A), the paper's section 1.3;
///  - subdisk: the same with A / n below the line (Wallace, Elmquist & Haines 1989).
/// With `glass`, each visible sample counts by what glass lets pass on the way to it (solve/transmission.hpp); column is
/// then [colour][receiver].
void visible_factors(Device& device, VisibilityEngine& engine, Estimator estimator, const Shooter& shooter,
                     const PointArray& receivers, const Array<std::uint32_t>* active, std::uint32_t count,
                     const PointArray& samples, std::uint32_t n, const Array<std::uint32_t>& masks,
                     const RealArray& factors, RealArray& column, const Glass* glass = nullptr);

/// The same in two steps, so that the host need not wait in between: first all but those that no sample tells of, undecided[i] = 1 for
/// i < count (0 for the sampled estimators); then these, `late` of them, whose places i are listed in `undecided`.
void visible_factors(Device& device, Estimator estimator, const Shooter& shooter, const PointArray& receivers,
                     const Array<std::uint32_t>* active, std::uint32_t count, const PointArray& samples,
                     std::uint32_t n, const Array<std::uint32_t>& masks, const RealArray& factors,
                     RealArray& column, const Glass* glass, Array<std::uint32_t>& undecided);
void decide_undecided(Device& device, VisibilityEngine& engine, const Shooter& shooter,
                      const PointArray& receivers, const Array<std::uint32_t>* active,
                      const Array<std::uint32_t>& undecided, std::uint32_t late, const RealArray& factors,
                      RealArray& column, const Glass* glass);

}  // namespace clrad
