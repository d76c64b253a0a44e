// What clipping leaves visible of a shooter, against closed forms, against an integral line by line, and as part of a solve.
//
// Tolerances: in float an edge is off by up to 16 roundings (2^-24) of the distance, 3 here at most: 3e-6, which of a shooter of
// size 0.5 are 1e-5 of its area an edge, and a few edges are seen: 5e-5 of the factor. In double the same is below 1e-12,
// and factors are good to 1e-9 (kernels/solve/clip.cl).
#include "solve/clip.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <random>

#include "clrad/solver.hpp"
#include "oracle/point_factor.hpp"

namespace clrad {
namespace {

using oracle::Quad;
using Corners = std::vector<glm::dvec3>;

constexpr double tolerance_in_float = 5e-5, tolerance_in_double = 1e-9;

Shooter clip_shooter(const Corners& corners) {
  Shooter s;
  s.corners = std::uint32_t(corners.size());
  std::copy(corners.begin(), corners.end(), s.corner);
  glm::dvec3 twice(0);
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    twice += glm::cross(corners[k] - corners[0], corners[k + 1] - corners[0]);
  s.area = 0.5 * glm::length(twice), s.normal = glm::normalize(twice), s.plane = 7;
  return s;
}

struct Clipped {
  std::vector<double> whole, visible;  // -1: left to samples
};

Clipped clipped(Device& device, const Shooter& shooter, const std::vector<OccluderTriangle>& triangles,
                const std::vector<Point>& points) {
  const auto count = std::uint32_t(points.size());
  std::vector<std::uint32_t> all(count);
  for (std::uint32_t i = 0; i < count; ++i) all[i] = i;
  const PointArray receivers(device, points, "receivers");
  const Array<std::uint32_t> active(device, all, "receivers");
  RealArray factors(device, count, "factors"), column(device, std::vector<double>(count, -1.0), "column");
  form_factors(device, Estimator::exact, shooter, receivers, &active, count, receivers, 0, factors);
  const Tree tree(device, Occluders(device, triangles));
  Clip clip(device, tree);
  Array<std::uint32_t> sampled(device, count, "sampled");
  clip.visible_factors(shooter, receivers, active, count, factors, column, sampled);
  Clipped result{factors.download(), column.download()};
  const auto left = sampled.download();
  for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(left[i], result.visible[i] == -1 ? 1u : 0u);
  return result;
}

std::vector<Point> grid_of_receivers(std::uint32_t side, double z) {
  std::vector<Point> points;
  for (std::uint32_t j = 0; j < side; ++j)
    for (std::uint32_t i = 0; i < side; ++i)
      points.push_back({{-0.95 + 1.9 * i / (side - 1), -0.95 + 1.9 * j / (side - 1), z}, {0, 0, 1}, 8, 0});
  return points;
}

void add_rectangle(std::vector<OccluderTriangle>& triangles, double x0, double y0, double x1, double y1,
                   double z, std::uint32_t plane = 9) {
  const glm::dvec3 a{x0, y0, z}, b{x1, y0, z}, c{x1, y1, z}, d{x0, y1, z};
  triangles.push_back({{a, b, c}, plane, plane});
  triangles.push_back({{a, c, d}, plane, plane});
}

// A lamp that shines down on a floor, above rectangles parallel to both: the shadow on the lamp is a rectangle, too.
double seen_beyond_rectangle(const glm::dvec3& x, const glm::dvec3& n, const glm::dvec4& lamp, double lamp_z,
                             const glm::dvec4& hides, double z) {
  const double f = (lamp_z - x.z) / (z - x.z);
  const auto along = [&](double h, int axis, double low, double high) {
    return std::clamp(x[axis] + (h - x[axis]) * f, low, high);
  };
  const double u0 = along(hides[0], 0, lamp[0], lamp[2]), u1 = along(hides[2], 0, lamp[0], lamp[2]),
               v0 = along(hides[1], 1, lamp[1], lamp[3]), v1 = along(hides[3], 1, lamp[1], lamp[3]);
  const auto part = [&](double a, double b, double c, double d) {
    if (!(c > a && d > b)) return Quad(0);
    return oracle::point_factor<Quad>(x, n, {{a, b, lamp_z}, {a, d, lamp_z}, {c, d, lamp_z}, {c, b, lamp_z}});
  };
  if (!(u1 > u0 && v1 > v0)) return double(part(lamp[0], lamp[1], lamp[2], lamp[3]));
  return double(part(lamp[0], lamp[1], u0, lamp[3]) + part(u1, lamp[1], lamp[2], lamp[3]) +
                part(u0, lamp[1], u1, v0) + part(u0, v1, u1, lamp[3]));
}

std::vector<DeviceOptions> devices() {
  return {{}, {.packet_width = 1}, {.packet_width = 8}, {.precision = Precision::float64}};
}

TEST(Clip, RectanglesInFrontOfALampAsInClosedForm) {
  const glm::dvec4 lamp{-0.3, -0.2, 0.2, 0.25};
  const double lamp_z = 0.75;
  const Shooter shooter =
      clip_shooter({{-0.3, -0.2, lamp_z}, {-0.3, 0.25, lamp_z}, {0.2, 0.25, lamp_z}, {0.2, -0.2, lamp_z}});
  const std::vector<Point> points = grid_of_receivers(20, -0.5);
  int partly = 0, hidden = 0;
  for (const auto& [hides, z] : {std::pair{glm::dvec4{-0.25, -0.25, 0.3, 0.125}, 0.25},
                                 {glm::dvec4{-0.0625, -0.0625, 0.0625, 0.0625}, 0.5},
                                 {glm::dvec4{-0.9, -0.9, 0.0, 0.9}, 0.0}}) {
    std::vector<OccluderTriangle> triangles;
    add_rectangle(triangles, hides[0], hides[1], hides[2], hides[3], z);
    std::vector<double> want;
    for (const Point& p : points)
      want.push_back(seen_beyond_rectangle(p.position, p.normal, lamp, lamp_z, hides, z));
    for (const DeviceOptions& options : devices()) {
      const bool in_double = options.precision == Precision::float64;
      Device device(options);
      const Clipped got = clipped(device, shooter, triangles, points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        partly += want[i] > 0 && want[i] < 0.999 * got.whole[i], hidden += want[i] == 0;
        EXPECT_NEAR(got.visible[i], want[i],
                    (in_double ? tolerance_in_double : tolerance_in_float) * got.whole[i])
            << i << " z " << z;
      }
    }
  }
  EXPECT_GT(partly, 1000);
  EXPECT_GT(hidden, 400);
}

// Visible part of the form factor by lines across the shooter p + u e + v f, u and v in [0, 1]: occluders are projected on its plane,
// and on each line what they leave is integrated by Gauss' rule.
class LineByLine {
 public:
  LineByLine(const Corners& corners, const std::vector<OccluderTriangle>& triangles)
      : p_(corners[0]), e_(corners[1] - corners[0]), f_(corners[3] - corners[0]), triangles_(triangles) {
    normal_ = glm::normalize(glm::cross(e_, f_));
  }

  double operator()(const glm::dvec3& x, const glm::dvec3& n, int lines) const {
    const double height = glm::dot(normal_, x - p_);
    std::vector<std::vector<glm::dvec2>> shadows;
    for (const OccluderTriangle& t : triangles_) {
      std::vector<glm::dvec3> part(t.corner, t.corner + 3);
      part = above(part, [&](const glm::dvec3& v) { return glm::dot(normal_, v - p_); });
      part = above(part, [&](const glm::dvec3& v) { return 0.999 * height - glm::dot(normal_, v - p_); });
      std::vector<glm::dvec2> shadow;
      for (const glm::dvec3& v : part) {
        const glm::dvec3 y = x + (v - x) * (height / (height - glm::dot(normal_, v - p_))) - p_;
        const double ee = glm::dot(e_, e_), ff = glm::dot(f_, f_), ef = glm::dot(e_, f_),
                     ye = glm::dot(y, e_), yf = glm::dot(y, f_), det = ee * ff - ef * ef;
        shadow.emplace_back((ff * ye - ef * yf) / det, (ee * yf - ef * ye) / det);
      }
      if (shadow.size() >= 3) shadows.push_back(shadow);
    }
    double sum = 0;
    for (int line = 0; line < lines; ++line) sum += along(x, n, height, (line + 0.5) / lines, shadows);
    return sum / lines * glm::length(glm::cross(e_, f_));
  }

 private:
  glm::dvec3 p_, e_, f_, normal_;
  const std::vector<OccluderTriangle>& triangles_;

  template <class Height>
  static std::vector<glm::dvec3> above(const std::vector<glm::dvec3>& polygon, Height height) {
    std::vector<glm::dvec3> result;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const glm::dvec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      const double ha = height(a), hb = height(b);
      if (ha >= 0) result.push_back(a);
      if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) result.push_back(a + (b - a) * (ha / (ha - hb)));
    }
    return result;
  }

  double along(const glm::dvec3& x, const glm::dvec3& n, double height, double u,
               const std::vector<std::vector<glm::dvec2>>& shadows) const {
    std::vector<std::pair<double, double>> dark;
    for (const auto& shadow : shadows) {
      double low = 1e9, high = -1e9;
      for (std::size_t k = 0; k < shadow.size(); ++k) {
        const glm::dvec2 &a = shadow[k], &b = shadow[(k + 1) % shadow.size()];
        if ((a.x <= u) == (b.x <= u)) continue;
        const double v = a.y + (b.y - a.y) * ((u - a.x) / (b.x - a.x));
        low = std::min(low, v), high = std::max(high, v);
      }
      if (high > low) dark.emplace_back(low, high);
    }
    const glm::dvec3 from = p_ + u * e_ - x;
    const double z0 = glm::dot(n, from), slope = glm::dot(n, f_);
    double begin = 0, end = 1;  // above the horizon
    if (slope > 0) begin = std::clamp(-z0 / slope, 0.0, 1.0);
    if (slope < 0) end = std::clamp(-z0 / slope, 0.0, 1.0);
    if (slope == 0 && z0 <= 0) return 0;
    std::sort(dark.begin(), dark.end());
    double sum = 0;
    for (const auto& [low, high] : dark) {
      sum += lit(from, n, height, begin, std::min(low, end));
      begin = std::max(begin, high);
    }
    return sum + lit(from, n, height, begin, end);
  }

  double lit(const glm::dvec3& from, const glm::dvec3& n, double height, double begin, double end) const {
    constexpr double at[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363},
                     weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                  0.1012285362903763};
    if (!(end > begin)) return 0;
    const double middle = (begin + end) / 2, half = (end - begin) / 2;
    double sum = 0;
    for (int k = 0; k < 4; ++k)
      for (const double side : {-1.0, 1.0}) {
        const glm::dvec3 r = from + (middle + side * half * at[k]) * f_;
        const double r2 = glm::dot(r, r);
        sum += weight[k] * glm::dot(n, r) * height / (r2 * r2);
      }
    return sum * half / M_PI;
  }
};

// Triangles of all sizes, alone and across each other, the floor and the shooter's plane; receivers with their own normals, so that
// horizons cut the shooter. Lines err by the square of their distance where an edge starts or ends, and by more where one runs
// along them: what others of them say tells how much.
TEST(Clip, TrianglesAnyhowAsLineByLine) {
  const Corners corners = {{-0.3, -0.2, 0.7}, {-0.25, 0.3, 0.65}, {0.2, 0.27, 0.75}, {0.15, -0.23, 0.8}};
  const Shooter shooter = clip_shooter(corners);
  ASSERT_GT(glm::dot(shooter.normal, glm::dvec3(0, 0, -1)), 0.9);
  std::mt19937_64 random(30501);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto anywhere = [&](double size) {
    return size * glm::dvec3(unit(random), unit(random), unit(random));
  };
  for (const auto& [count, size] : {std::pair{3, 0.6}, {12, 0.3}, {40, 0.1}}) {
    std::vector<OccluderTriangle> triangles;
    for (std::uint32_t t = 0; t < std::uint32_t(count); ++t) {
      const glm::dvec3 middle = anywhere(0.8) * glm::dvec3(0.6, 0.6, 1);
      triangles.push_back(
          {{middle + anywhere(size), middle + anywhere(size), middle + anywhere(size)}, 20 + t, 20 + t});
    }
    std::vector<Point> points;
    while (points.size() < 64) {
      const glm::dvec3 n = glm::normalize(glm::dvec3(0, 0, 1) + anywhere(0.9));
      points.push_back({{0.9 * unit(random), 0.9 * unit(random), -0.6 + 0.2 * unit(random)}, n, 8, 0});
    }
    const LineByLine truth(corners, triangles);
    std::vector<double> want, of_lines;
    for (const Point& p : points) {
      const double fine = truth(p.position, p.normal, 4000), other = truth(p.position, p.normal, 3001),
                   coarse = truth(p.position, p.normal, 2003);
      want.push_back(fine), of_lines.push_back(std::max(std::abs(fine - other), std::abs(fine - coarse)));
      EXPECT_LE(of_lines.back(), 1e-4 * fine + 1e-8);
    }
    for (const DeviceOptions& options : devices()) {
      Device device(options);
      const Clipped got = clipped(device, shooter, triangles, points);
      int partly = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        partly += want[i] > 0 && want[i] < 0.99 * got.whole[i];
        const double rounding =
            options.precision == Precision::float64 ? tolerance_in_double : tolerance_in_float;
        EXPECT_NEAR(got.visible[i], want[i], rounding * got.whole[i] + 2 * of_lines[i] + 1e-12)
            << count << " triangles, receiver " << i << ", width " << options.packet_width;
      }
      EXPECT_GT(partly, 15) << count;
    }
  }
}

// Touching, in one plane or seen edge-on: such hides nothing, and nothing is left of what all hide together.
TEST(Clip, TrianglesThatOnlyTouchHideNothing) {
  const Corners corners = {
      {-0.25, -0.25, 0.75}, {-0.25, 0.25, 0.75}, {0.25, 0.25, 0.75}, {0.25, -0.25, 0.75}};
  const Shooter shooter = clip_shooter(corners);
  const std::vector<Point> points = grid_of_receivers(9, -0.5);
  for (const DeviceOptions& options : devices()) {
    Device device(options);
    std::vector<OccluderTriangle> touching;
    add_rectangle(touching, -0.5, -0.5, 0.5, 0.5, 0.75, shooter.plane);    // the shooter's own plane
    add_rectangle(touching, -0.9, -0.9, 0.9, 0.9, -0.5, points[0].plane);  // the receivers' own
    add_rectangle(touching, -0.9, -0.9, 0.9, 0.9, -0.75);                  // behind them
    add_rectangle(touching, -0.9, -0.9, 0.9, 0.9, 0.875);                  // behind the shooter
    const auto in_plane = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                              std::uint32_t plane) {
      touching.push_back({{a, b, c}, plane, plane});
    };
    in_plane({-0.25, -0.5, 0.75}, {-0.25, 0.5, 0.75}, {-0.25, 0, 0.9}, 30);  // stands on the shooter's edge
    Clipped got = clipped(device, shooter, touching, points);
    EXPECT_EQ(got.visible, got.whole);
    // A wall that stands on the middle receivers: what it hides from them is for samples to say.
    in_plane({0, -0.9, -0.5}, {0, 0.9, -0.5}, {0, 0, 3}, 31);
    got = clipped(device, shooter, touching, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec3& p = points[i].position;
      if (p.x == 0)
        EXPECT_EQ(got.visible[i], std::abs(p.y) <= 0.9 ? -1 : got.whole[i]) << p.y;
      else
        EXPECT_LT(got.visible[i], 0.9 * got.whole[i]);
    }
    // The same hung a little higher, so that it is only seen edge-on.
    touching.back().corner[0].z = touching.back().corner[1].z = -0.49;
    got = clipped(device, shooter, touching, points);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (points[i].position.x == 0) {
        EXPECT_EQ(got.visible[i], got.whole[i]);
      }
    // Four rectangles that share edges, behind which there is nothing.
    std::vector<OccluderTriangle> wall;
    for (const double x : {-0.9, 0.0})
      for (const double y : {-0.9, 0.0}) add_rectangle(wall, x, y, x + 0.9, y + 0.9, 0.5);
    for (const double visible : clipped(device, shooter, wall, points).visible) EXPECT_EQ(visible, 0);
  }
}

// A long, low wall and receivers a thousandth of an element of extent/256 in front of its foot, where vertices are that touched it. From
// there it hides a horizontal shooter behind it up to its own rim: what is left is what is above the plane through x and the rim.
TEST(Clip, LowWallsHideWhatIsBehindThem) {
  constexpr double rim = 0.05, away = 1e-3 / 256;
  // Upright, facing the wall from behind it, from the floor to four times the wall's height.
  const Shooter shooter = clip_shooter({{-0.2, 0.5, 0}, {0.2, 0.5, 0}, {0.2, 0.5, 0.2}, {-0.2, 0.5, 0.2}});
  ASSERT_LT(shooter.normal.y, -0.99);
  std::vector<OccluderTriangle> wall;
  wall.push_back({{{-0.5, 0, 0}, {0.5, 0, 0}, {0.5, 0, rim}}, 9, 9});
  wall.push_back({{{-0.5, 0, 0}, {0.5, 0, rim}, {-0.5, 0, rim}}, 9, 9});
  std::vector<Point> points;
  for (int k = -8; k <= 8; ++k) points.push_back({{0.05 * k, -away, 0}, {0, 0, 1}, 8, 0});
  for (const DeviceOptions& options : devices()) {
    Device device(options);
    const Clipped got = clipped(device, shooter, wall, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      // So near, the whole shooter is behind the wall.
      EXPECT_GT(got.whole[i], 0.001);
      EXPECT_EQ(got.visible[i], 0) << points[i].position.x << ", width " << options.packet_width;
    }
  }
}

TEST(Clip, WhatHasNoRoomIsLeftToSamples) {
  const Shooter shooter =
      clip_shooter({{-0.25, -0.25, 0.75}, {-0.25, 0.25, 0.75}, {0.25, 0.25, 0.75}, {0.25, -0.25, 0.75}});
  std::vector<OccluderTriangle> slats;
  for (int k = 0; k < 100; ++k)
    add_rectangle(slats, -0.25, -0.25 + 0.005 * k, 0.25, -0.2475 + 0.005 * k, 0.7, std::uint32_t(40 + k));
  Device device;
  const Clipped got = clipped(device, shooter, slats, grid_of_receivers(9, -0.5));
  EXPECT_GT(std::count(got.visible.begin(), got.visible.end(), -1.0), 40);
}

Solution solved_room(const SolveOptions& options) {
  static Device device;
  return solve(device, load_scene(std::string(CLRAD_SCENES) + "/block_room.obj"), options);
}

SolveOptions coarse_room() {
  SolveOptions o;
  o.mesh.patch_edge_m = 1, o.mesh.element_edge_m = 0.25;
  o.light_samples = 0, o.converge = 1e-2;
  o.near_field = o.error = false;
  return o;
}

SolveOptions exact_visibility(SolveOptions o) {
  o.visibility_exact = true;
  return o;
}

double difference(const Solution& a, const Solution& b) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < a.vertex_irradiance.size(); ++i)
    squares += std::pow(a.vertex_irradiance[i] - b.vertex_irradiance[i], 2), all += b.vertex_irradiance[i];
  const double count = double(a.vertex_irradiance.size());
  return std::sqrt(squares / count) / (all / count);
}

// The error of stratified samples falls with their number to the 3/4 where an edge crosses them: 8 times from 64 to 1024 samples.
// The half of that leaves room for the few directions that edges have here.
TEST(Clip, IsWhatMoreAndMoreSamplesComeTo) {
  const Solution clipped_room = solved_room(exact_visibility(coarse_room()));
  double before = 1;
  for (const std::uint32_t samples : {4u, 64u, 1024u}) {
    SolveOptions o = coarse_room();
    o.samples = samples;
    const double now = difference(solved_room(o), clipped_room);
    EXPECT_LT(now, before / 4) << samples << " samples";
    before = now;
  }
}

TEST(Clip, TracesNoRaysAndHasNoErrorOfVisibility) {
  SolveOptions o = exact_visibility(coarse_room());
  o.error = o.near_field = true;
  const Solution s = solved_room(o);
  for (const ErrorPart& part : s.report.error.parts)
    if (part.name == "visibility") {
      EXPECT_EQ(part.relative, 0);
    }
  EXPECT_GT(s.report.error.total_relative, 0);
  o.visibility_exact = false;
  EXPECT_LT(s.report.rays, solved_room(o).report.rays / 4);  // what is left finds what is covered
}

// Whatever engine has the samples, and however the mesh grew.
TEST(Clip, BitsDoNotDependOnTheEngine) {
  SolveOptions o = exact_visibility(coarse_room());
  o.adaptive.tolerance = 0.05, o.adaptive.max_level = 1, o.adaptive.every = 8;
  const Solution shaft = solved_room(o);
  EXPECT_GT(shaft.mesh.elements.size(), solved_room(exact_visibility(coarse_room())).mesh.elements.size());
  o.engine = "serial";
  EXPECT_EQ(solved_room(o).vertex_irradiance, shaft.vertex_irradiance);
}

TEST(Clip, NeedsExactFormFactors) {
  SolveOptions o = exact_visibility(coarse_room());
  o.estimator = Estimator::subdisk;
  EXPECT_THROW(solved_room(o), UsageError);
}

TEST(Clip, GlassIsSampledAndThatIsSaid) {
  SolveOptions o = exact_visibility(coarse_room());
  o.mesh = {2, 1};
  static Device device;
  const Solution s = solve(device, load_scene(std::string(CLRAD_SCENES) + "/window.obj"), o);
  EXPECT_TRUE(std::any_of(s.report.warnings.begin(), s.report.warnings.end(),
                          [](const std::string& w) { return w.starts_with("--visibility-exact"); }));
  o.visibility_exact = false;
  EXPECT_EQ(solve(device, load_scene(std::string(CLRAD_SCENES) + "/window.obj"), o).vertex_irradiance,
            s.vertex_irradiance);
}

}  // namespace
}  // namespace clrad
