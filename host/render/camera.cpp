#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "render/render.hpp"

namespace clrad {
namespace {

// Segments may leave the scene's box by this much [frame]: nothing is lost to rounding at its sides.
constexpr double padding = 1.0 / 16;
// An eye this far out is still a point that engines take [frame].
constexpr double near_enough = 2.0;

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

std::array<double, camera_reals> camera_numbers(const Scene& scene, const Frame& frame, const Camera& camera,
                                                unsigned width, unsigned height, Precision precision) {
  const double half_angle = camera.vertical_field_of_view_rad / 2;
  if (!(half_angle > 0 && half_angle < std::acos(0.0)))
    throw UsageError(fmt::format("camera \"{}\": a field of view of {:.6g} rad; it must lie between 0 and pi",
                                 camera.name, camera.vertical_field_of_view_rad));
  const glm::dvec3 look = camera.target - camera.eye, across = glm::cross(look, camera.up);
  if (!finite(camera.eye) || !finite(look) || !(glm::length(look) > 0))
    throw UsageError(fmt::format("camera \"{}\" stands on its target", camera.name));
  if (!finite(across) || !(glm::length(across) > 1e-12 * glm::length(look) * glm::length(camera.up)))
    throw UsageError(fmt::format("camera \"{}\" looks along its up direction", camera.name));
  const glm::dvec3 forward = glm::normalize(look), right = glm::normalize(across),
                   up = glm::cross(right, forward);
  const double tangent = std::tan(half_angle);

  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const auto& polygon : scene.polygons)
    for (std::uint32_t k = 0; k < polygon.corners; ++k) {
      const glm::dvec3 p = frame.to_frame(polygon.corner[k]);
      low = glm::min(low, p), high = glm::max(high, p);
    }
  low -= padding, high += padding;

  // A far eye is replaced by a base point on each ray in the plane through the scene's middle: numbers stay
  // small.
  const glm::dvec3 eye = frame.to_frame(camera.eye);
  const bool near = std::max({std::abs(eye.x), std::abs(eye.y), std::abs(eye.z)}) <= near_enough;
  const double distance = near ? 0 : std::max(glm::dot(0.5 * (low + high) - eye, forward), 0.0);
  const glm::dvec3 base = eye + distance * forward;

  std::array<double, camera_reals> numbers{};
  for (int c = 0; c < 3; ++c) {
    const double hi = precision == Precision::float64 ? base[c] : double(float(base[c]));
    numbers[c] = hi;
    numbers[3 + c] = base[c] - hi;
    numbers[6 + c] = forward[c];
    numbers[9 + c] = right[c] * tangent * width / height;
    numbers[12 + c] = up[c] * tangent;
    numbers[15 + c] = low[c];
    numbers[18 + c] = high[c];
  }
  numbers[21] = distance;
  numbers[22] = near;
  return numbers;
}

void camera_rays(Device& device, const RealArray& camera, const ImageOptions& options,
                 std::uint32_t first_pixel, std::uint32_t rays, PointArray& origins, PointArray& targets) {
  device.run("render/camera.cl", "camera_rays", rays, camera, options.width, options.height,
             options.samples_per_pixel, first_pixel, rays, origins, targets);
}

}  // namespace clrad
