#include "visibility/occluders.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "device/parallel.hpp"
#include "visibility/snap.hpp"

namespace clrad {

namespace {

__extension__ typedef __int128 Wide;

// An upper bound of a sum that was rounded a few times in float.
float round_up(double x) {
  return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

}  // namespace

bool snap_triangle(const OccluderTriangle& input, clrad_triangle& triangle, clrad_facet& facet) {
  GridPoint corner[3];
  float hi[3][3], lo[3][3];
  for (int i = 0; i < 3; ++i) {
    check_range(input.corner[i], "a corner of an occluder");
    corner[i] = snap(input.corner[i]);
    for (int axis = 0; axis < 3; ++axis) {
      const FloatPair pair = split(corner[i][static_cast<std::size_t>(axis)]);
      hi[i][axis] = pair.hi;
      lo[i][axis] = pair.lo;
    }
  }

  std::int64_t edge[3][3];
  float e[3][3];
  double size = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double norm = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      edge[i][axis] = corner[(i + 1) % 3][axis] - corner[i][axis];
      e[i][axis] = static_cast<float>(edge[i][axis]) * 0x1p-38f;
      norm += std::abs(static_cast<double>(edge[i][axis])) * 0x1p-38;
    }
    size = std::max(size, norm);
  }

  float n[3];
  bool area = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
    // Exact: below 2^83. The conversion to float rounds once.
    const Wide normal = Wide(edge[0][j]) * edge[1][k] - Wide(edge[0][k]) * edge[1][j];
    area = area || normal != 0;
    n[axis] = static_cast<float>(normal) * 0x1p-76f;
  }

  triangle = {hi[0][0], hi[0][1], hi[0][2], hi[1][0], hi[1][1],    hi[1][2],     hi[2][0],
              hi[2][1], hi[2][2], lo[0][0], lo[0][1], lo[0][2],    lo[1][0],     lo[1][1],
              lo[1][2], lo[2][0], lo[2][1], lo[2][2], input.plane, input.polygon};
  facet = {e[0][0],
           e[0][1],
           e[0][2],
           e[1][0],
           e[1][1],
           e[1][2],
           e[2][0],
           e[2][1],
           e[2][2],
           n[0],
           n[1],
           n[2],
           round_up(size),
           std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])}),
           0,
           0};
  return area;
}

Occluders::Occluders(Device& device, std::span<const OccluderTriangle> input) {
  constexpr std::size_t worth_a_thread = 10000;
  const auto parts = unsigned(std::clamp<std::size_t>(input.size() / worth_a_thread, 1, host_cores(device)));
  std::vector<clrad_triangle> kept(std::max<std::size_t>(1, input.size()));  // devices have no empty buffers
  std::vector<clrad_facet> kept_facets(kept.size());
  std::vector<std::uint32_t> index(kept.size());
  struct Part {
    std::size_t begin = 0, kept = 0;
    glm::dvec3 low{INFINITY}, high{-INFINITY};
  };
  std::vector<Part> done(parts);
  in_parallel(input.size(), parts, [&](std::size_t begin, std::size_t end, unsigned part) {
    Part of{.begin = begin};
    std::size_t at = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (!snap_triangle(input[i], kept[at], kept_facets[at])) continue;
      index[at++] = static_cast<std::uint32_t>(i);
      for (const glm::dvec3& corner : input[i].corner) {
        const glm::dvec3 p = unsnap(snap(corner));
        of.low = glm::min(of.low, p), of.high = glm::max(of.high, p);
      }
    }
    of.kept = at - begin;
    done[part] = of;
  });
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const Part& part : done) {
    const auto move = [&](auto& from) {
      std::copy_n(from.begin() + std::ptrdiff_t(part.begin), part.kept, from.begin() + count);
    };
    if (part.begin > count) move(kept), move(kept_facets), move(index);
    count += static_cast<std::uint32_t>(part.kept);
    low = glm::min(low, part.low), high = glm::max(high, part.high);
  }
  if (count > 0) box_low = low, box_high = high;
  const std::size_t size = std::max(1u, count);
  kept.resize(size), kept_facets.resize(size), index.resize(size);
  triangles = Array<clrad_triangle>(device, kept, "occluder triangles");
  facets = Array<clrad_facet>(device, kept_facets, "occluder facets");
  input_index = Array<std::uint32_t>(device, index, "occluder indices");
}

}  // namespace clrad
