// Which occluders a cell keeps, against the convex hull of cell and shooter by brute force.
#include "viewfactors/cull.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "viewfactors/cells.hpp"

namespace clrad {
namespace {

using Polygon3 = std::vector<glm::dvec3>;

// Signed volume of the tetrahedron, six times.
double volume(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
  return glm::dot(glm::cross(b - a, c - a), d - a);
}

// The kernel's tests are off by some 16 ulp of float times lengths of up to 5 each way, 1e-5; what is closer than this to being the other way
// is not asked. In double the same situations are asked.
constexpr double margin = 1e-4;

struct HalfSpace {
  glm::dvec3 outward;
  double offset;
};

// Faces of the convex hull of both polygons, by trying all triples of corners. shaft: without the two polygons' own planes.
std::vector<HalfSpace> hull_of(const Polygon3& a, const Polygon3& b, bool shaft) {
  Polygon3 all = a;
  all.insert(all.end(), b.begin(), b.end());
  std::vector<HalfSpace> faces;
  const std::size_t n = all.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = j + 1; k < n; ++k) {
        if (shaft && (k < a.size() || i >= a.size())) continue;
        const glm::dvec3 cross = glm::cross(all[j] - all[i], all[k] - all[i]);
        if (glm::length(cross) < 1e-9) continue;
        for (const double side : {1.0, -1.0}) {
          const HalfSpace face{side * glm::normalize(cross), side * glm::dot(glm::normalize(cross), all[i])};
          if (std::all_of(all.begin(), all.end(), [&](const glm::dvec3& p) {
                return glm::dot(face.outward, p) < face.offset + 1e-12;
              }))
            faces.push_back(face);
        }
      }
  return faces;
}

// Whether anything of the polygon is inside all half-spaces, each moved outward by `by`.
bool reaches_in(Polygon3 p, const std::vector<HalfSpace>& faces, double by) {
  for (const HalfSpace& face : faces) {
    Polygon3 left;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const glm::dvec3 &here = p[i], &next = p[(i + 1) % p.size()];
      const double a = glm::dot(face.outward, here) - face.offset - by,
                   b = glm::dot(face.outward, next) - face.offset - by;
      if (a <= 0) left.push_back(here);
      if ((a < 0 && b > 0) || (a > 0 && b < 0)) left.push_back(here + (next - here) * (a / (a - b)));
    }
    p = std::move(left);
  }
  return !p.empty();
}

// Whether the segment passes through the polygon, by more than rounding: 1, or beside it by more: -1; else 0.
int passes(const glm::dvec3& from, const glm::dvec3& to, const Polygon3& polygon) {
  const glm::dvec3 n = glm::normalize(glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0]));
  const double a = glm::dot(n, from - polygon[0]), b = glm::dot(n, to - polygon[0]);
  if (std::min(std::abs(a), std::abs(b)) < margin) return 0;
  if (a * b > 0) return -1;
  double least = 1, most = -1;
  for (std::size_t e = 0; e < polygon.size(); ++e) {
    const glm::dvec3 &p = polygon[e], &q = polygon[(e + 1) % polygon.size()];
    const double v = volume(from, to, p, q) / (glm::length(to - from) * glm::length(q - p));
    least = std::min(least, v), most = std::max(most, v);
  }
  if (least > margin || most < -margin) return 1;
  return least < -margin && most > margin ? -1 : 0;
}

// Whether there is something of `other` on both sides of the polygon's plane.
bool cuts(const Polygon3& polygon, const Polygon3& other) {
  const glm::dvec3 n = glm::normalize(glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0]));
  const auto height = [&](const glm::dvec3& p) { return glm::dot(n, p - polygon[0]); };
  return std::any_of(other.begin(), other.end(), [&](const auto& p) { return height(p) > 0; }) &&
         std::any_of(other.begin(), other.end(), [&](const auto& p) { return height(p) < 0; });
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  // A convex polygon of 3 to 5 corners on an ellipse about `middle` in the plane of u and v.
  Polygon3 polygon(const glm::dvec3& middle, const glm::dvec3& u, const glm::dvec3& v) {
    const int corners = 3 + int(between(0, 3));
    Polygon3 p;
    for (int k = 0; k < corners; ++k) {
      const double angle = 6.283185307179586 * (k + between(0.1, 0.9)) / corners;
      p.push_back(middle + u * std::cos(angle) + v * std::sin(angle));
    }
    return p;
  }
  glm::dvec3 direction() {
    for (;;) {
      const glm::dvec3 d(between(-1, 1), between(-1, 1), between(-1, 1));
      if (glm::dot(d, d) > 0.1 && glm::dot(d, d) < 1) return glm::normalize(d);
    }
  }

 private:
  std::mt19937 engine_;
};

struct Situation {
  Polygon3 cell, shooter;
  std::vector<Polygon3> occluders;
};

// A cell in the plane z = 0, a shooter above it, occluders in between, all clear of both planes; every third shooter stands
// on the cell's plane.
Situation situation(Random& random, int index) {
  Situation s;
  for (const auto& c : {glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 0), glm::dvec3(0, 1, 0)})
    s.cell.push_back(c + glm::dvec3(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 0));
  if (index % 4 == 1) s.cell[3] = s.cell[2];
  if (index % 3 == 0) {
    const double x = random.between(1.4, 3), y = random.between(-1, 1), slope = random.between(-0.3, 0.3);
    s.shooter = {{x, y, 0}, {x, y + 1, 0}, {x + slope, y + 1, 1.5}, {x + slope, y, 1}};
  } else {
    const glm::dvec3 n = random.direction(), side = glm::normalize(glm::cross(n, random.direction()));
    s.shooter = random.polygon(glm::dvec3(random.between(-1, 2), random.between(-1, 2), 2.5), side * 0.9,
                               glm::cross(n, side) * random.between(0.2, 0.9));
  }
  for (int o = 0; o < 12; ++o) {
    const glm::dvec3 n = random.direction(), side = glm::normalize(glm::cross(n, random.direction()));
    const double size = o % 4 == 3 ? 3 : random.between(0.1, 0.6);
    Polygon3 p =
        random.polygon(glm::dvec3(random.between(-1, 2), random.between(-1, 2), random.between(0.1, 1.5)),
                       side * size, glm::cross(n, side) * size);
    // Large ones lie flat: a whole cell may lose sight of the shooter.
    if (o % 4 == 3)
      for (auto& c : p) c.z = 0.7 + 0.1 * c.x;
    double lowest = 1;
    for (const auto& c : p) lowest = std::min(lowest, c.z);
    if (lowest > 0.01) s.occluders.push_back(p);
  }
  return s;
}

class CullCells : public ::testing::TestWithParam<Precision> {
 protected:
  // Kept occluders of each situation; {-1}: hidden.
  static std::vector<std::vector<int>> cull(const std::vector<Situation>& situations) {
    Device device({.precision = GetParam()});
    std::vector<std::uint32_t> pairs, occluders, cells, list;
    std::vector<double> reals, vertices, quads;
    const auto add = [&](const Polygon3& p) {
      const auto first = std::uint32_t(vertices.size() / 3);
      for (const auto& c : p) vertices.insert(vertices.end(), {c.x, c.y, c.z});
      return first;
    };
    for (std::uint32_t i = 0; i < situations.size(); ++i) {
      const Situation& s = situations[i];
      pairs.push_back(add(s.shooter));
      pairs.push_back(std::uint32_t(s.shooter.size()));
      for (const auto& c : s.cell) quads.insert(quads.end(), {c.x, c.y, c.z});
      cells.insert(cells.end(),
                   {i, i, 0, 0, 0, 0, std::uint32_t(list.size()), std::uint32_t(s.occluders.size())});
      for (const auto& o : s.occluders) {
        list.push_back(std::uint32_t(occluders.size() / 5));
        occluders.push_back(add(o));
        occluders.insert(occluders.end(), {std::uint32_t(o.size()), std::uint32_t(reals.size() / 5), 0, 0});
        const glm::dvec3 n = glm::normalize(glm::cross(o[1] - o[0], o[2] - o[0]));
        reals.insert(reals.end(), {n.x, n.y, n.z, glm::dot(n, o[0]), 1e-5});
      }
    }
    PairTables tables{Array<std::uint32_t>(device, std::span<const std::uint32_t>(pairs), "pairs"),
                      Array<std::uint32_t>(device, std::span<const std::uint32_t>(occluders), "occluders"),
                      Array<std::uint32_t>(device, 1, "sides"),
                      RealArray(),
                      RealArray(device, reals, "occluders"),
                      RealArray(device, vertices, "corners"),
                      RealArray(device, quads, "quads")};
    const std::vector<std::uint32_t> kept = cull_cells(device, tables, cells, list);
    std::vector<std::vector<int>> result;
    for (std::size_t i = 0; i < situations.size(); ++i) {
      const std::uint32_t first = cells[cell_words * i + 6];
      std::uint32_t own = 0;  // number of the situation's first occluder
      for (std::size_t k = 0; k < i; ++k) own += std::uint32_t(situations[k].occluders.size());
      result.emplace_back();
      if (kept[i] == hidden) result.back().push_back(-1);
      for (std::uint32_t k = 0; kept[i] != hidden && k < kept[i]; ++k)
        result.back().push_back(int(list[first + k] - own));
    }
    return result;
  }
};

TEST_P(CullCells, KeepsWhatReachesIntoTheHullAndNothingElse) {
  Random random(5);
  std::vector<Situation> situations;
  for (int i = 0; i < 400; ++i) situations.push_back(situation(random, i));
  const auto kept = cull(situations);
  int met = 0, dropped = 0, left_open = 0, hidden_cells = 0, seen_cells = 0;
  for (std::size_t i = 0; i < situations.size(); ++i) {
    const Situation& s = situations[i];
    const bool is_hidden = kept[i] == std::vector<int>{-1};
    // Hidden: one occluder is passed by all segments between corners of the cell and of the shooter.
    bool hides = false, may_hide = false;
    for (const Polygon3& o : s.occluders) {
      int passing = 0, beside = 0;
      for (const glm::dvec3& x : s.cell)
        for (const glm::dvec3& y : s.shooter) {
          const int answer = passes(x, y, o);
          passing += answer > 0, beside += answer < 0;
        }
      hides |= passing == int(s.cell.size() * s.shooter.size());
      may_hide |= beside == 0;
    }
    ASSERT_TRUE(is_hidden || !hides) << "situation " << i;
    ASSERT_TRUE(may_hide || !is_hidden) << "situation " << i;
    hidden_cells += is_hidden, seen_cells += !is_hidden;
    if (is_hidden) continue;
    // Where the shooter's plane cuts the cell, two faces of the hull may meet in one of its edges; one of them is used.
    const bool cut = cuts(s.shooter, s.cell);
    const auto hull = hull_of(s.cell, s.shooter, false), shaft = hull_of(s.cell, s.shooter, true);
    for (std::size_t o = 0; o < s.occluders.size(); ++o) {
      const bool in_list = std::find(kept[i].begin(), kept[i].end(), int(o)) != kept[i].end();
      // Each point of the hull lies on a segment from the cell to the shooter.
      const bool reaches = reaches_in(s.occluders[o], hull, -margin),
                 outside = !cut && !reaches_in(s.occluders[o], shaft, margin);
      ASSERT_TRUE(in_list || !reaches) << "situation " << i << " occluder " << o;
      ASSERT_TRUE(!in_list || !outside) << "situation " << i << " occluder " << o;
      met += reaches, dropped += outside, left_open += !reaches && !outside;
    }
  }
  // There was something to ask of each kind.
  EXPECT_GT(met, 500);
  EXPECT_GT(dropped, 500);
  EXPECT_LT(left_open, met + dropped);
  EXPECT_GT(hidden_cells, 10);
  EXPECT_GT(seen_cells, 10);
}

INSTANTIATE_TEST_SUITE_P(Precisions, CullCells, ::testing::Values(Precision::float32, Precision::float64),
                         [](const auto& of) { return of.param == Precision::float32 ? "float" : "double"; });

}  // namespace
}  // namespace clrad
