// Scenes and solutions made by hand: what a picture or a file must show is then known.
#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>

#include "clrad/output.hpp"
#include "clrad/visibility.hpp"
#include "mesh/build.hpp"
#include "scene/planes.hpp"

namespace clrad::test {

/// One device per precision for all tests: kernels are compiled once. Never destroyed: at the program's end
/// the driver may be gone before them.
inline Device& device(Precision precision = Precision::float32) {
  static Device& single = *new Device({.precision = Precision::float32});
  static Device& twice = *new Device({.precision = Precision::float64});
  return precision == Precision::float64 ? twice : single;
}

/// One material per call: grey or coloured, emitting E with reflectance rho in every band.
inline Material material(unsigned bands, double rho, double exitance = 0) {
  Material m;
  m.name = "material";
  m.reflectance.assign(bands, rho);
  m.emitted_exitance.assign(bands, exitance);
  return m;
}

inline Polygon polygon(const std::vector<glm::dvec3>& corners, std::uint32_t material_index = 0) {
  Polygon p;
  p.corners = std::uint32_t(corners.size());
  for (std::size_t k = 0; k < corners.size(); ++k) p.corner[k] = corners[k];
  p.material = material_index;
  p.name = "polygon";
  return p;
}

inline Scene scene(const std::vector<Polygon>& polygons, unsigned bands = 1) {
  Scene s;
  s.file = "by hand";
  if (bands == 1)
    s.bands = {"grey"};
  else if (bands == 3)
    s.bands = {"red", "green", "blue"};
  else
    for (unsigned b = 0; b < bands; ++b) s.bands.push_back("band " + std::to_string(b));
  s.materials = {material(bands, 0.5)};
  s.polygons = polygons;
  return s;
}

inline Frame frame(const Scene& s) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const auto& p : s.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k)
      low = glm::min(low, p.corner[k]), high = glm::max(high, p.corner[k]);
  const glm::dvec3 size = high - low;
  Frame f;
  f.centre = low + 0.5 * size;
  f.exponent = std::ilogb(std::max({size.x, size.y, size.z}));
  return f;
}

/// A solution whose irradiance at position x [m] of polygon p in a band is field(p, band, x).
using Field = std::function<double(std::uint32_t polygon, std::uint32_t band, const glm::dvec3& position_m)>;

inline Solution solution(const Scene& s, double element_edge_m, const Field& field) {
  Solution out;
  out.scene = s;
  out.frame = frame(s);
  out.bands = std::uint32_t(s.bands.size());
  out.mesh = build_mesh(s, out.frame, plane_ids(s),
                        {.patch_edge_m = 2 * element_edge_m, .element_edge_m = element_edge_m});
  const std::size_t vertices = out.vertex_count(), patches = out.mesh.patches.size();
  out.vertex_irradiance.resize(out.bands * vertices);
  out.vertex_covered.assign(vertices, 0);
  for (std::uint32_t band = 0; band < out.bands; ++band)
    for (std::uint32_t p = 0; p < s.polygons.size(); ++p)
      for (std::uint32_t i = 0; i < out.mesh.polygons[p].vertices; ++i) {
        const std::size_t v = out.mesh.polygons[p].first_vertex + i;
        out.vertex_irradiance[band * vertices + v] = field(p, band, out.mesh.position_m[v]);
      }
  out.patch_irradiance.assign(out.bands * patches, 0);
  for (std::uint32_t band = 0; band < out.bands; ++band)
    for (const Element& e : out.mesh.elements)
      for (int k = 0; k < 4; ++k)
        if (e.vertex[k] != 0xffffffffu)
          out.patch_irradiance[band * patches + e.patch] +=
              e.area_m2 / out.mesh.patches[e.patch].area_m2 * e.weight[k] *
              out.vertex_irradiance[band * vertices + e.vertex[k]];
  return out;
}

/// Straight from the definition, in double, on the host; of equally near triangles the first or, to show that
/// a picture does not depend on it, the last.
class PlainEngine : public VisibilityEngine {
 public:
  PlainEngine(std::vector<OccluderTriangle> triangles, bool last_of_ties)
      : triangles_(std::move(triangles)), last_(last_of_ties) {}
  std::string name() const override { return "plain"; }
  void occluded(const Segments&, Array<std::uint32_t>&) override { std::abort(); }
  VisibilityCounts counts() const override { return {}; }

  void intersect_closest(const Segments& segments, Array<std::uint32_t>& triangle, Array<float>& t) override {
    const auto origins = segments.origins->download(), targets = segments.targets->download();
    std::vector<std::uint32_t> nearest(segments.origin_count, 0xffffffffu);
    std::vector<float> at(segments.origin_count, 1);
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      double best = 2;
      for (std::size_t k = 0; k < triangles_.size(); ++k) {
        const std::uint32_t plane = triangles_[k].plane;
        if (plane == origins[i].plane || plane == targets[i].plane) continue;
        const double hit = meets(origins[i].position, targets[i].position, triangles_[k]);
        const double tie = last_ ? 1e-9 : -1e-9;
        if (hit < best + tie) best = hit, nearest[i] = std::uint32_t(k), at[i] = float(hit);
      }
    }
    triangle.upload(nearest);
    t.upload(at);
  }

 private:
  static double meets(const glm::dvec3& from, const glm::dvec3& to, const OccluderTriangle& triangle) {
    const glm::dvec3 &a = triangle.corner[0], &b = triangle.corner[1], &c = triangle.corner[2], d = to - from;
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double t = glm::dot(a - from, n) / glm::dot(d, n);
    if (!(t >= 0 && t <= 1)) return 3;
    const glm::dvec3 p = from + t * d;
    const bool inside = glm::dot(glm::cross(b - a, p - a), n) >= 0 &&
                        glm::dot(glm::cross(c - b, p - b), n) >= 0 &&
                        glm::dot(glm::cross(a - c, p - c), n) >= 0;
    return inside ? t : 3;
  }

  std::vector<OccluderTriangle> triangles_;
  bool last_;
};

/// Direction of the ray through (x, y) of the picture, in pixels from the top left corner; not normalised.
inline glm::dvec3 ray(const Camera& camera, unsigned width, unsigned height, double x, double y) {
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.up)), up = glm::cross(right, forward);
  const double tangent = std::tan(camera.vertical_field_of_view_rad / 2);
  return forward + (2 * x / width - 1) * tangent * width / height * right +
         (1 - 2 * y / height) * tangent * up;
}

/// Where the ray meets a polygon's plane, and how far inside its edges that is [m]; negative outside.
struct Meeting {
  glm::dvec3 point;
  double inside;
};
inline Meeting meet(const Polygon& p, const glm::dvec3& eye, const glm::dvec3& direction) {
  const glm::dvec3 n = p.normal();
  Meeting m{eye + glm::dot(p.corner[0] - eye, n) / glm::dot(direction, n) * direction, INFINITY};
  for (std::uint32_t k = 0; k < p.corners; ++k) {
    const glm::dvec3 &a = p.corner[k], &b = p.corner[(k + 1) % p.corners];
    m.inside = std::min(m.inside, glm::dot(glm::cross(glm::normalize(b - a), m.point - a), n));
  }
  return m;
}

/// Parameters (u, v) of a point of a polygon's plane, as PolygonMesh has them: by Newton's method from the middle, which
/// converges on convex quads that are not nearly triangles.
inline std::array<double, 2> parameters(const Polygon& p, const glm::dvec3& x) {
  const auto& c = p.corner;
  const glm::dvec3 e1 = c[1] - c[0], e2 = c[p.corners - 1] - c[0],
                   twist = p.corners == 4 ? c[2] - c[1] - c[3] + c[0] : glm::dvec3(0);
  double u = 0.5, v = 0.5;
  for (int i = 0; i < 20; ++i) {
    const glm::dvec3 off = x - (c[0] + u * e1 + v * e2 + u * v * twist), du = e1 + v * twist,
                     dv = e2 + u * twist;
    const double a = glm::dot(du, du), b = glm::dot(du, dv), d = glm::dot(dv, dv);
    const double r = glm::dot(off, du), s = glm::dot(off, dv), det = a * d - b * b;
    u += (d * r - b * s) / det, v += (a * s - b * r) / det;
  }
  return {u, v};
}

}  // namespace clrad::test
