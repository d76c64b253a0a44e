#include "solve/clip.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "device/grow.hpp"

namespace clrad {
namespace {

constexpr const char *clip_kernels = "solve/clip.cl", *shaft_kernels = "visibility/shaft.cl";
// As in the kernel files.
constexpr std::uint32_t end_words = 7, corner_group = 32, most_listed = 128;

}  // namespace

void Clip::visible_factors(const Shooter& shooter, const PointArray& receivers,
                           const Array<std::uint32_t>& active, std::uint32_t count, const RealArray& factors,
                           RealArray& column, Array<std::uint32_t>& sampled) {
  if (count == 0) return;
  const unsigned width = device_.options().packet_width;
  const std::uint32_t packets = (count + width - 1) / width;
  grow(ends_, device_, std::uint64_t(packets) * width * end_words, "ends of segments");
  grow(corners_, device_, corner_group * end_words, "ends of segments");
  grow(list_, device_, std::uint64_t(packets) * most_listed, "triangles that hide a part");
  grow(lanes_, device_, std::uint64_t(packets) * most_listed, "triangles that hide a part");
  grow(many_, device_, packets, "triangles that hide a part");
  grow(hidden_, device_, count, "hidden receivers");
  std::vector<Point> points;
  for (std::uint32_t k = 0; k < 4; ++k)
    points.push_back(
        {shooter.corner[std::min(k, shooter.corners - 1)], shooter.normal, shooter.plane, 0xffffffffu});
  const PointArray corners(device_, points, "corners of the shooter");
  device_.run(shaft_kernels, "shaft_ends", packets, receivers, active, 1u, count, width, ends_);
  device_.run(shaft_kernels, "shaft_ends", corner_group / width, corners, active, 0u, 4u, corner_group,
              corners_);
  // As with the engine `shaft`, a work-item has far more to do than a launch costs: groups of one spread best.
  const unsigned local = device_.info().gpu ? 0 : 1;
  device_.run_local(clip_kernels, "clip_candidates", packets, local, ends_, count, corners_, factors,
                    tree_.nodes, tree_.triangles, tree_.facets, list_, lanes_, many_, hidden_);
  const RealArray record(device_, shooter_record(shooter), "shooter");
  device_.run(clip_kernels, "clip_factors", count, record, receivers, active, factors, list_, lanes_, many_,
              hidden_, tree_.triangles, tree_.facets, column, sampled, count);
}

std::string Clip::account() const {
  return fmt::format(
      "{} of {} pairs of receiver and shooter clipped; {} sampled, where more than {} triangles hide a part "
      "from a "
      "packet of receivers, or pieces found no room, or a triangle touches the receiver",
      asked_ - left_, asked_, left_, most_listed);
}

}  // namespace clrad
