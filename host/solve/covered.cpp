#include "solve/covered.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>

#include "clrad/primitives.hpp"
#include "scene/backs.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t probes = 16;  // rays of a vertex that is covered
constexpr std::uint32_t batch_rays = 1 << 19;

// A cosine-weighted spiral over the hemisphere about +z.
std::vector<float> probe_directions() {
  constexpr double golden_angle = 2.399963229728653;
  std::vector<float> directions;
  for (std::uint32_t k = 0; k < probes; ++k) {
    const double r2 = (k + 0.5) / probes, r = std::sqrt(r2), phi = golden_angle * k;
    directions.insert(directions.end(),
                      {float(r * std::cos(phi)), float(r * std::sin(phi)), float(std::sqrt(1 - r2))});
  }
  return directions;
}

// In the frame, so that a far-away scene is judged like a near one. All four are in one plane.
bool contains(const std::vector<glm::dvec3>& corner, const glm::dvec3& normal, const glm::dvec3& p) {
  for (std::size_t k = 0; k < corner.size(); ++k) {
    const glm::dvec3 a = corner[k], b = corner[(k + 1) % corner.size()];
    if (glm::dot(glm::cross(b - a, p - a), normal) < 0) return false;
  }
  return true;
}

// The corner vertices of a polygon's lattice: just inside its outline, so neighbours that touch do not overlap.
std::vector<glm::dvec3> outline(const Mesh& mesh, const PolygonMesh& polygon, std::uint32_t corners) {
  std::vector<glm::dvec3> result;
  const std::uint32_t n = polygon.cells_u, m = polygon.cells_v, v0 = polygon.first_vertex;
  if (corners == 4)
    for (const std::uint32_t v : {0u, n, m * (n + 1) + n, m * (n + 1)})
      result.push_back(mesh.receivers[v0 + v].position);
  else
    for (const std::uint32_t v : {0u, n, polygon.vertices - 1})
      result.push_back(mesh.receivers[v0 + v].position);
  return result;
}

std::vector<std::uint32_t> overlaid_points(const Scene& scene, const Mesh& mesh,
                                           std::span<const Point> points) {
  std::vector<std::uint32_t> overlaid(points.size(), 0);
  std::vector<std::vector<std::uint32_t>> points_of(scene.polygons.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) points_of[points[i].surface].push_back(i);
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_plane;
  for (std::uint32_t p = 0; p < scene.polygons.size(); ++p)
    by_plane[mesh.receivers[mesh.polygons[p].first_vertex].plane].push_back(p);

  struct Outline {
    std::uint32_t polygon;
    std::vector<glm::dvec3> corner;
    glm::dvec3 normal, low, high;
  };
  // Along the diagonal of the coordinates: one sweep per plane, whichever way it is tilted.
  const auto key = [](const glm::dvec3& v) { return v.x + v.y + v.z; };
  for (const auto& [plane, members] : by_plane) {
    if (members.size() < 2) continue;
    std::vector<Outline> outlines;
    for (const std::uint32_t p : members) {
      Outline o{p, outline(mesh, mesh.polygons[p], scene.polygons[p].corners), scene.polygons[p].normal(),
                glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
      for (const auto& c : o.corner) o.low = glm::min(o.low, c), o.high = glm::max(o.high, c);
      outlines.push_back(std::move(o));
    }
    std::sort(outlines.begin(), outlines.end(),
              [&](const Outline& a, const Outline& b) { return key(a.low) < key(b.low); });
    for (std::size_t i = 0; i < outlines.size(); ++i)
      for (std::size_t j = i + 1; j < outlines.size() && key(outlines[j].low) <= key(outlines[i].high); ++j) {
        const bool first_below = outlines[i].polygon < outlines[j].polygon;
        const Outline &below = outlines[first_below ? i : j], &above = outlines[first_below ? j : i];
        if (glm::dot(below.normal, above.normal) < 0) continue;
        // Boxes of neighbours that only touch overlap by rounding at most in each direction but one of zero thickness.
        if (glm::any(glm::lessThan(below.high, above.low)) || glm::any(glm::lessThan(above.high, below.low)))
          continue;
        for (const std::uint32_t p : points_of[below.polygon])
          if (contains(above.corner, above.normal, points[p].position)) overlaid[p] = 1;
      }
  }
  return overlaid;
}

// Rays from points over their hemispheres, and whether what they meet first turns its back.
class Probes {
 public:
  Probes(Device& device, const Scene& scene, std::span<const Point> points,
         const std::vector<OccluderTriangle>& triangles, VisibilityEngine& engine)
      : device_(device),
        engine_(engine),
        receivers_(device, points, "receivers"),
        direction_(device, probe_directions(), "probe directions"),
        normal_(device, normals(scene, triangles), "triangle normals") {
    // Two ends, a hit and what the engine keeps of each ray, in a quarter of the memory that is left.
    const std::uint64_t left =
        device.ledger()->limit - std::min(device.ledger()->limit, device.ledger()->held);
    rays_ = std::uint32_t(std::min<std::uint64_t>(
        {points.size() * probes, batch_rays, std::max<std::uint64_t>(left / 4 / 256, 64 * probes)}));
    origins_ = PointArray(device, rays_, "probe rays"), ends_ = PointArray(device, rays_, "probe rays");
    hit_ = Array<std::uint32_t>(device, rays_, "probe hits");
    t_ = Array<float>(device, rays_, "probe hits");
  }

  /// 1 for those of the `count` points of `asked` whose rays [first_probe, first_probe + of) all meet a back.
  Array<std::uint32_t> all_meet_backs(const Array<std::uint32_t>& asked, std::uint32_t count,
                                      std::uint32_t first_probe, std::uint32_t of) {
    Array<std::uint32_t> backs(device_, count, "covered vertices");
    const std::uint32_t batch = rays_ / of;
    for (std::uint32_t first = 0; first < count; first += batch) {
      const std::uint32_t now = std::min(batch, count - first);
      device_.run(kernels, "probe_rays", std::uint64_t(now) * of, receivers_, asked, direction_, origins_,
                  ends_, first, now, first_probe, of);
      const Segments rays{&origins_, nullptr, now * of, &ends_, 0};
      engine_.intersect_closest(rays, hit_, t_);
      device_.run(kernels, "probe_verdict", now, origins_, ends_, hit_, normal_, backs, first, now, of);
    }
    return backs;
  }

 private:
  static constexpr const char* kernels = "solve/covered.cl";
  Device& device_;
  VisibilityEngine& engine_;
  PointArray receivers_;
  Array<float> direction_, normal_;
  std::uint32_t rays_;  ///< at a time
  PointArray origins_, ends_;
  Array<std::uint32_t> hit_;
  Array<float> t_;

  static std::vector<float> normals(const Scene& scene, const std::vector<OccluderTriangle>& triangles) {
    std::vector<float> normals;
    for (const auto& t : triangles) {
      // What has two sides has no back to be behind: of length 0, neither side of it counts as one.
      const glm::dvec3 front =
          has_back(scene, t.polygon) ? glm::dvec3(0) : scene.polygons[t.polygon].normal();
      for (int k = 0; k < 3; ++k) normals.push_back(float(front[k]));
    }
    return normals;
  }
};

std::vector<std::uint8_t> covered_points(Device& device, const Scene& scene, std::span<const Point> points,
                                         const std::vector<OccluderTriangle>& triangles,
                                         VisibilityEngine& engine,
                                         const std::vector<std::uint32_t>& overlaid) {
  const auto stage = device.stage("find vertices that something covers");
  const auto count = std::uint32_t(points.size());
  if (count == 0) return {};
  Probes rays(device, scene, points, triangles, engine);
  std::vector<std::uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0u);
  const Array<std::uint32_t> told =
      rays.all_meet_backs(Array<std::uint32_t>(device, all, "vertices"), count, 0, 1);
  Array<std::uint32_t> asked(device, count, "vertices");
  const std::uint32_t left = compact(device, told.buffer(), count, asked.buffer());
  std::vector<std::uint8_t> result(overlaid.begin(), overlaid.end());
  if (left == 0) return result;
  const std::vector<std::uint32_t> which = asked.download(0, left),
                                   covered = rays.all_meet_backs(asked, left, 1, probes - 1).download();
  for (std::uint32_t i = 0; i < left; ++i)
    if (covered[i]) result[which[i]] = 1;
  return result;
}

// Points of equal spacing in the parameters of an element, and how much area each stands for.
constexpr std::uint32_t grid = 8;
struct Sample {
  glm::dvec3 position;
  double area;
};
std::vector<Sample> samples_on(const Mesh& mesh, const Element& e) {
  glm::dvec3 c[4];
  const bool triangle = e.vertex[3] == 0xffffffffu;
  for (std::uint32_t k = 0; k < 4; ++k) c[k] = mesh.receivers[e.vertex[triangle && k == 3 ? 0 : k]].position;
  std::vector<Sample> samples;
  for (std::uint32_t j = 0; j < grid; ++j)
    for (std::uint32_t i = 0; i < grid; ++i) {
      if (triangle) {  // the middles of grid^2 small triangles, upright ones and turned ones
        if (i + j >= grid) continue;
        for (const double third : {1.0 / 3, 2.0 / 3})
          if (third < 0.5 || i + j + 1 < grid)
            samples.push_back(
                {c[0] + (i + third) / grid * (c[1] - c[0]) + (j + third) / grid * (c[2] - c[0]), 1});
        continue;
      }
      const double u = (i + 0.5) / grid, v = (j + 0.5) / grid;
      const glm::dvec3 along_u = (1 - v) * (c[1] - c[0]) + v * (c[2] - c[3]),
                       along_v = (1 - u) * (c[3] - c[0]) + u * (c[2] - c[1]);
      samples.push_back({(1 - v) * ((1 - u) * c[0] + u * c[1]) + v * ((1 - u) * c[3] + u * c[2]),
                         glm::length(glm::cross(along_u, along_v))});
    }
  return samples;
}

}  // namespace

std::vector<std::uint32_t> overlaid_vertices(const Scene& scene, const Mesh& mesh, std::uint32_t first) {
  return overlaid_points(scene, mesh, std::span(mesh.receivers).subspan(first));
}

std::vector<std::uint8_t> covered_vertices(Device& device, const Scene& scene, const Mesh& mesh,
                                           const std::vector<OccluderTriangle>& triangles,
                                           VisibilityEngine& engine,
                                           const std::vector<std::uint32_t>& overlaid, std::uint32_t first) {
  return covered_points(device, scene, std::span(mesh.receivers).subspan(first), triangles, engine, overlaid);
}

void weigh_exposed(Device& device, const Scene& scene, Mesh& mesh,
                   const std::vector<OccluderTriangle>& triangles, VisibilityEngine& engine,
                   const std::vector<std::uint8_t>& covered, std::span<const std::uint32_t> elements) {
  std::vector<std::uint32_t> partly;
  std::vector<Point> points;
  std::vector<double> area;
  for (const std::uint32_t e : elements) {
    const Element& element = mesh.elements[e];
    const std::uint32_t corners = element.vertex[3] == 0xffffffffu ? 3 : 4;
    std::uint32_t hidden = 0;
    for (std::uint32_t k = 0; k < corners; ++k) hidden += covered[element.vertex[k]];
    if (hidden == 0 || hidden == corners) continue;
    partly.push_back(e);
    for (const Sample& s : samples_on(mesh, element)) {
      Point p = mesh.receivers[element.vertex[0]];
      p.position = s.position;
      points.push_back(p);
      area.push_back(s.area);
    }
  }
  const auto hidden =
      covered_points(device, scene, points, triangles, engine, overlaid_points(scene, mesh, points));
  std::size_t at = 0;
  for (const std::uint32_t e : partly) {
    Element& element = mesh.elements[e];
    double all = 0, seen = 0;
    for (std::uint32_t i = 0; i < grid * grid; ++i, ++at) all += area[at], seen += hidden[at] ? 0 : area[at];
    double corners_seen = 0;
    const auto exposed = [&](std::size_t k) {
      return element.vertex[k] != 0xffffffffu && !covered[element.vertex[k]];
    };
    for (std::size_t k = 0; k < 4; ++k) corners_seen += exposed(k) ? element.weight[k] : 0;
    for (std::size_t k = 0; k < 4; ++k)
      element.weight[k] *= exposed(k) ? seen / all / corners_seen : (1 - seen / all) / (1 - corners_seen);
  }
}

std::vector<double> exposed_shares(const Mesh& mesh, const std::vector<std::uint8_t>& covered) {
  std::vector<double> exposed(mesh.patches.size(), 0);
  for (const Element& e : mesh.elements)
    for (int k = 0; k < 4; ++k)
      if (e.vertex[k] != 0xffffffffu && !covered[e.vertex[k]])
        exposed[e.patch] += e.area_m2 / mesh.patches[e.patch].area_m2 * e.weight[k];
  return exposed;
}

}  // namespace clrad
