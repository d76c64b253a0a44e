#include "scene/seams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace clrad {
namespace {

using Index = std::uint32_t;

struct Sets {  // disjoint sets
  std::vector<Index> parent;
  explicit Sets(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0u); }
  Index find(Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(Index a, Index b) {
    const Index x = find(a), y = find(b);
    parent[std::max(x, y)] = std::min(x, y);
  }
};

// Points in cells of a grid. Cells are as many as points, so a line of the grid has some cube root of them.
class PointGrid {
 public:
  PointGrid(std::span<const glm::dvec3> points, double least_cell) : low_(INFINITY) {
    glm::dvec3 high(-INFINITY);
    for (const auto& p : points) low_ = glm::min(low_, p), high = glm::max(high, p);
    const glm::dvec3 size = high - low_;
    cell_ = std::max(least_cell, std::max({size.x, size.y, size.z}) / std::cbrt(double(points.size()) + 1));
    for (Index i = 0; i < points.size(); ++i) cells_[key(cell_of(points[i]))].push_back(i);
  }

  // Calls visit(point) for all points in cells within `reach` of the segment, each once.
  template <class Visit>
  void near_segment(const glm::dvec3& a, const glm::dvec3& b, double reach, Visit visit) const {
    const glm::dvec3 d = glm::abs(b - a);
    const int along = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
    const double from = std::min(a[along], b[along]) - reach, to = std::max(a[along], b[along]) + reach;
    const auto slab = [&](double x) { return std::int64_t(std::floor((x - low_[along]) / cell_)); };
    for (std::int64_t s = slab(from); s <= slab(to); ++s) {
      const double x0 = low_[along] + double(s) * cell_ - reach, x1 = x0 + cell_ + 2 * reach;
      const glm::dvec3 p = at(a, b, along, x0), q = at(a, b, along, x1);
      std::array<std::int64_t, 3> first = cell_of(glm::min(p, q) - reach),
                                  last = cell_of(glm::max(p, q) + reach);
      first[std::size_t(along)] = last[std::size_t(along)] = s;
      std::array<std::int64_t, 3> c{};
      for (c[0] = first[0]; c[0] <= last[0]; ++c[0])
        for (c[1] = first[1]; c[1] <= last[1]; ++c[1])
          for (c[2] = first[2]; c[2] <= last[2]; ++c[2])
            if (const auto found = cells_.find(key(c)); found != cells_.end())
              for (const Index i : found->second) visit(i);
    }
  }

 private:
  static glm::dvec3 at(const glm::dvec3& a, const glm::dvec3& b, int along, double x) {
    const double length = b[along] - a[along];
    return length == 0 ? a : a + (b - a) * std::clamp((x - a[along]) / length, 0.0, 1.0);
  }
  std::array<std::int64_t, 3> cell_of(const glm::dvec3& p) const {
    const glm::dvec3 c = glm::floor((p - low_) / cell_);
    return {std::int64_t(c.x), std::int64_t(c.y), std::int64_t(c.z)};
  }
  // Cells are few against 2^21 a line, so keys are unique.
  static std::uint64_t key(const std::array<std::int64_t, 3>& c) {
    std::uint64_t k = 0;
    for (const std::int64_t x : c) k = k << 21 | (std::uint64_t(x) & 0x1fffff);
    return k;
  }
  glm::dvec3 low_;
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<Index>> cells_;
};

// Corners of all polygons, those within the tolerance of each other as one.
struct WeldedCorners {
  std::vector<glm::dvec3> point;
  std::vector<std::array<Index, 4>> of;  // per polygon
};

WeldedCorners weld(const Scene& scene, const Frame& frame, double tolerance) {
  WeldedCorners corners;
  std::vector<glm::dvec3> all;
  std::vector<Index> first;
  for (const Polygon& p : scene.polygons) {
    first.push_back(Index(all.size()));
    for (Index k = 0; k < p.corners; ++k) all.push_back(frame.to_frame(p.corner[k]));
  }
  // Hashed by cells of two tolerances: a point's like is in its own cell or in one that the tolerance reaches.
  std::unordered_map<std::uint64_t, std::vector<Index>> cells;
  const auto hash = [](const std::array<std::int64_t, 3>& c) {
    std::uint64_t h = 0;
    for (const std::int64_t x : c) h = (h ^ std::uint64_t(x)) * 0x9fb21c651e98df25ull, h ^= h >> 32;
    return h;
  };
  std::vector<Index> welded;
  for (const glm::dvec3& p : all) {
    Index same = 0xffffffffu;
    std::array<std::int64_t, 3> low{}, high{}, c{};
    for (int a = 0; a < 3; ++a) {
      low[std::size_t(a)] = std::int64_t(std::floor((p[a] - tolerance) / (2 * tolerance)));
      high[std::size_t(a)] = std::int64_t(std::floor((p[a] + tolerance) / (2 * tolerance)));
    }
    for (c[0] = low[0]; c[0] <= high[0]; ++c[0])
      for (c[1] = low[1]; c[1] <= high[1]; ++c[1])
        for (c[2] = low[2]; c[2] <= high[2]; ++c[2])
          if (const auto found = cells.find(hash(c)); found != cells.end())
            for (const Index i : found->second)
              if (glm::distance(corners.point[i], p) <= tolerance) same = std::min(same, i);
    if (same == 0xffffffffu) {
      same = Index(corners.point.size());
      corners.point.push_back(p);
      for (int a = 0; a < 3; ++a) c[std::size_t(a)] = std::int64_t(std::floor(p[a] / (2 * tolerance)));
      cells[hash(c)].push_back(same);
    }
    welded.push_back(same);
  }
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    auto& of = corners.of.emplace_back();
    for (Index k = 0; k < scene.polygons[p].corners; ++k) of[k] = welded[first[p] + k];
  }
  return corners;
}

// What runs along one interval: its sum, from the lower to the higher corner, and who it is of.
struct Interval {
  int sum = 0;
  std::vector<Index> polygons;
};
using Intervals = std::map<std::pair<Index, Index>, Interval>;

void add(Intervals& intervals, Index from, Index to, int times, std::span<const Index> polygons) {
  if (from == to) return;
  Interval& i = intervals[std::minmax(from, to)];
  i.sum += from < to ? times : -times;
  i.polygons.insert(i.polygons.end(), polygons.begin(), polygons.end());
}

// Intervals that do not cancel, cut at the ends of all others of them, added up again.
Intervals cut_open_ones(const Intervals& all, const WeldedCorners& corners, double tolerance) {
  std::vector<Index> ends;
  for (const auto& [ab, interval] : all)
    if (interval.sum != 0) ends.push_back(ab.first), ends.push_back(ab.second);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::vector<glm::dvec3> points;
  points.reserve(ends.size());
  for (const Index i : ends) points.push_back(corners.point[i]);
  Intervals cut;
  if (points.empty()) return cut;
  const PointGrid grid(points, 4 * tolerance);
  for (const auto& entry : all) {
    const auto& ab = entry.first;
    const Interval& interval = entry.second;
    if (interval.sum == 0) continue;
    const glm::dvec3 a = corners.point[ab.first], b = corners.point[ab.second], d = b - a;
    const double length2 = glm::dot(d, d);
    std::vector<std::pair<double, Index>> on{{0, ab.first}, {1, ab.second}};
    grid.near_segment(a, b, tolerance, [&](Index i) {
      const Index corner = ends[i];
      const glm::dvec3 r = points[i] - a;
      const double t = glm::dot(r, d) / length2;
      if (corner != ab.first && corner != ab.second && t > 0 && t < 1 && glm::length(r - t * d) <= tolerance)
        on.emplace_back(t, corner);
    });
    std::sort(on.begin(), on.end());
    for (std::size_t k = 0; k + 1 < on.size(); ++k)
      add(cut, on[k].second, on[k + 1].second, interval.sum, interval.polygons);
  }
  return cut;
}

// A plane and the polygons in it.
struct PlaneOf {
  glm::dvec3 normal{0}, point{0};  // of its first polygon
  double area = 0;
  std::vector<Index> polygons;
};

struct Flat {  // a convex polygon in a plane, seen along the normal's longest component
  std::vector<glm::dvec2> corner;
};

Flat flattened(std::span<const glm::dvec3> corner, int along) {
  Flat flat;
  for (const glm::dvec3& c : corner) flat.corner.emplace_back(c[(along + 1) % 3], c[(along + 2) % 3]);
  return flat;
}

double area_of(std::span<const glm::dvec2> c) {
  double twice = 0;
  for (std::size_t i = 2; i < c.size(); ++i) {
    const glm::dvec2 u = c[i - 1] - c[0], v = c[i] - c[0];
    twice += u.x * v.y - u.y * v.x;
  }
  return 0.5 * twice;
}

// Area of what `subject` and the convex `window` share, with the subject's sign (Sutherland & Hodgman 1974).
double shared_area(const Flat& subject, const Flat& window) {
  const double way = area_of(window.corner) > 0 ? 1 : -1;
  std::vector<glm::dvec2> left = subject.corner;
  for (std::size_t k = 0; k < window.corner.size() && !left.empty(); ++k) {
    const glm::dvec2 a = window.corner[k], side = window.corner[(k + 1) % window.corner.size()] - a;
    const auto inside = [&](const glm::dvec2& p) {
      return way * (side.x * (p.y - a.y) - side.y * (p.x - a.x));
    };
    std::vector<glm::dvec2> next;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const glm::dvec2 p = left[i], q = left[(i + 1) % left.size()];
      const double hp = inside(p), hq = inside(q);
      if (hp >= 0) next.push_back(p);
      if ((hp > 0 && hq < 0) || (hp < 0 && hq > 0)) next.push_back(p + (q - p) * (hp / (hp - hq)));
    }
    left = std::move(next);
  }
  return area_of(left);
}

// Closes one connected set of open intervals by the polygons of one plane under it; false when that plane does not.
bool close_in(const Scene& scene, const Frame& frame, const PlaneOf& plane, Index id,
              const WeldedCorners& corners, const Intervals& open,
              std::span<const std::pair<Index, Index>> outline, Index surface,
              std::span<const Index> surface_of, double tolerance, std::vector<Fill>& fills) {
  for (const auto& [a, b] : outline)
    for (const Index v : {a, b})
      if (std::abs(glm::dot(corners.point[v] - plane.point, plane.normal)) > 4 * tolerance) return false;
  const glm::dvec3 size = glm::abs(plane.normal);
  const int along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const glm::dvec3 apex = corners.point[outline.front().first];
  std::vector<Fill> mine;
  double area = 0, perimeter = 0;
  for (const auto& ab : outline) {
    const int sum = open.at(ab).sum;
    const glm::dvec3 a = corners.point[ab.first], b = corners.point[ab.second];
    Fill fill{{apex, sum > 0 ? b : a, sum > 0 ? a : b}, std::abs(sum), id, surface};
    perimeter += glm::distance(a, b);
    area += fill.weight * area_of(flattened(fill.corner, along).corner);
    if (area_of(flattened(fill.corner, along).corner) != 0) mine.push_back(fill);
  }
  if (std::abs(area) <= tolerance * perimeter) return false;
  double covered = 0;
  for (const Index p : plane.polygons) {
    if (surface_of[p] == surface) continue;
    std::vector<glm::dvec3> c;
    for (Index k = 0; k < scene.polygons[p].corners; ++k)
      c.push_back(frame.to_frame(scene.polygons[p].corner[k]));
    const Flat window = flattened(c, along);
    if ((area_of(window.corner) > 0) == (area > 0)) continue;  // must face what stands on it
    for (const Fill& f : mine) covered += f.weight * shared_area(flattened(f.corner, along), window);
  }
  if (std::abs(covered - area) > 4 * tolerance * perimeter) return false;
  fills.insert(fills.end(), mine.begin(), mine.end());
  return true;
}

std::string where(const Scene& scene, const Frame& frame, const WeldedCorners& corners,
                  std::pair<Index, Index> ab, Index polygon) {
  const glm::dvec3 a = frame.from_frame(corners.point[ab.first]),
                   b = frame.from_frame(corners.point[ab.second]);
  return fmt::format(
      "\"{}\" at {} has an open side from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g})",
      scene.polygons[polygon].name, scene.polygons[polygon].where.text(), a.x, a.y, a.z, b.x, b.y, b.z);
}

}  // namespace

double seam_tolerance(const Scene& scene, const Frame& frame) {
  double largest = 0;
  for (const Polygon& p : scene.polygons)
    for (Index k = 0; k < p.corners; ++k)
      for (int a = 0; a < 3; ++a) largest = std::max(largest, std::abs(p.corner[k][a]));
  return 0x1p-36 + 4 * largest * std::numeric_limits<double>::epsilon() * frame.scale();
}

Seams find_seams(const Scene& scene, const Frame& frame, std::span<const std::uint32_t> planes) {
  Seams seams;
  const double tolerance = seam_tolerance(scene, frame);
  const WeldedCorners corners = weld(scene, frame, tolerance);
  Intervals sides;
  for (Index p = 0; p < scene.polygons.size(); ++p)
    for (Index k = 0; k < scene.polygons[p].corners; ++k)
      add(sides, corners.of[p][k], corners.of[p][(k + 1) % scene.polygons[p].corners], 1, std::span(&p, 1));
  const Intervals cut = cut_open_ones(sides, corners, tolerance);

  Sets joined(scene.polygons.size());
  for (const Intervals* intervals : {&std::as_const(sides), &cut})
    for (const auto& [ab, interval] : *intervals)
      for (const Index p : interval.polygons) joined.join(interval.polygons.front(), p);
  std::vector<Index> number(scene.polygons.size(), 0xffffffffu);
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    Index& n = number[joined.find(p)];
    if (n == 0xffffffffu) n = seams.surfaces++;
    seams.surface.push_back(n);
  }

  // What is still open, in connected outlines.
  Sets ends(corners.point.size());
  for (const auto& [ab, interval] : cut)
    if (interval.sum != 0) ends.join(ab.first, ab.second);
  std::map<Index, std::vector<std::pair<Index, Index>>> outlines;
  for (const auto& [ab, interval] : cut)
    if (interval.sum != 0) outlines[ends.find(ab.first)].push_back(ab);
  if (outlines.empty()) return seams;

  std::vector<PlaneOf> in_plane(1 + *std::max_element(planes.begin(), planes.end()));
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    PlaneOf& plane = in_plane[planes[p]];
    if (plane.polygons.empty())
      plane.normal = scene.polygons[p].normal(), plane.point = frame.to_frame(scene.polygons[p].corner[0]);
    plane.area += scene.polygons[p].area_m2();
    plane.polygons.push_back(p);
  }
  std::vector<Index> widest(in_plane.size());
  std::iota(widest.begin(), widest.end(), 0u);
  std::stable_sort(widest.begin(), widest.end(),
                   [&](Index a, Index b) { return in_plane[a].area > in_plane[b].area; });
  for (const auto& entry : outlines) {
    const auto& outline = entry.second;
    const Index polygon = cut.at(outline.front()).polygons.front();
    const bool closed = std::any_of(widest.begin(), widest.end(), [&](Index plane) {
      return close_in(scene, frame, in_plane[plane], plane, corners, cut, outline, seams.surface[polygon],
                      seams.surface, tolerance, seams.fills);
    });
    if (closed) continue;
    seams.open = where(scene, frame, corners, outline.front(), polygon);
    return seams;
  }
  return seams;
}

}  // namespace clrad
