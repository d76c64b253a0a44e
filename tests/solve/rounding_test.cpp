// The bound on rounding against what float really does: every scene is solved in float and in double, and no vertex and no patch
// may differ by more than the float run's bound says.
#include "solve/rounding.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

double rounding_of(const Solution& s) {
  for (const ErrorPart& part : s.report.error.parts)
    if (part.name == "rounding") {
      EXPECT_TRUE(part.bound);
      return part.relative;
    }
  ADD_FAILURE() << "no rounding part";
  return 0;
}

class Rounding : public ::testing::Test {
 protected:
  // The largest difference as a share of max(irradiance, its area mean), and the bound.
  void compare(const std::string& name, const Scene& scene, double patches = 4, double elements = 8) {
    SolveOptions options;
    if (std::getenv("CLRAD_LONG_TESTS")) patches *= 2, elements *= 4;
    options.mesh = {oracle::extent_of(scene) / patches, oracle::extent_of(scene) / elements};
    options.light_samples = 16;
    // Far below rounding, so that what is unshot plays no part.
    options.converge = 1e-9;
    const Solution f = solve(single_, scene, options), d = solve(double_, scene, options);
    const double bound = rounding_of(f);
    EXPECT_LT(rounding_of(d), 1e-6 * bound) << name;
    ASSERT_EQ(f.vertex_covered, d.vertex_covered) << name;
    double worst = 0;
    for (std::uint32_t b = 0; b < f.bands; ++b) {
      double mean = 0, area = 0;
      const std::size_t n = d.mesh.patches.size(), vertices = d.vertex_count();
      for (std::size_t p = 0; p < n; ++p)
        mean += d.mesh.patches[p].area_m2 * d.patch_irradiance[b * n + p], area += d.mesh.patches[p].area_m2;
      mean /= area;
      if (!(mean > 0)) continue;
      const auto differ = [&](double x, double y) {
        ASSERT_TRUE(std::isfinite(x) && std::isfinite(y)) << name;
        worst = std::max(worst, std::abs(x - y) / std::max(y, mean));
      };
      for (std::size_t p = 0; p < n; ++p)
        differ(f.patch_irradiance[b * n + p], d.patch_irradiance[b * n + p]);
      for (std::size_t v = 0; v < vertices; ++v)
        differ(f.vertex_irradiance[b * vertices + v], d.vertex_irradiance[b * vertices + v]);
    }
    std::printf("%-28s float - double %.2e, bound %.2e\n", name.c_str(), worst, bound);
    EXPECT_LE(worst, bound) << name;
    EXPECT_LT(bound, 0.05) << name << ": a bound that says nothing";
    ++compared_;
  }

  Device single_, double_{{.precision = Precision::float64}};
  int compared_ = 0;
};

Scene mapped(Scene scene, const std::function<glm::dvec3(glm::dvec3)>& map) {
  for (Polygon& p : scene.polygons)
    for (std::uint32_t k = 0; k < p.corners; ++k) p.corner[k] = map(p.corner[k]);
  return scene;
}

TEST_F(Rounding, BoundHoldsInFurnaces) {
  const auto forms = oracle::reference("c_closed_forms.json");
  for (const auto& c : forms.at("cases")) {
    if (c.at("kind") != "white_furnace" || !c.contains("rho")) continue;
    Scene scene;
    scene.bands = {"a", "b", "c"};
    scene.materials.push_back({"all", {0.5, 0.99, 0.9999}, {1, 1, 1}, {}});
    for (const auto& p : c.at("polygons")) scene.polygons.push_back(oracle::polygon(p, 0, "wall"));
    compare(c.at("id"), scene, 2, 4);
  }
  EXPECT_EQ(compared_, 6);
}

TEST_F(Rounding, BoundHoldsInBoxesAndOccludedScenes) {
  const auto boxes = oracle::reference("c_boxes.json");
  for (const auto& c : boxes.at("cases"))
    if (c.contains("scene")) compare(c.at("id"), oracle::scene_of(c.at("scene")), 2, 8);
  compare("block room", oracle::block_room());
  compare("Cornell box",
          oracle::scene_of(
              oracle::reference_case(oracle::reference("c_scenes_with_occlusion.json"), "C-cornell-1")
                  .at("scene")));
  EXPECT_GT(compared_, 5);
}

TEST_F(Rounding, BoundHoldsFarAwayTinyHugeAndAskew) {
  compare("block room at 1e6 m",
          mapped(oracle::block_room(), [](glm::dvec3 p) { return p + glm::dvec3(1e6, -1e6, 1e6); }));
  compare("block room x 2^-20", mapped(oracle::block_room(), [](glm::dvec3 p) { return 0x1p-20 * p; }));
  compare("block room x 1e6", mapped(oracle::block_room(), [](glm::dvec3 p) { return 1e6 * p; }));
  const double c = std::cos(0.4), s = std::sin(0.4);
  // The block's foot moves off the lattice of the floor: a vertex in the plane of a face that stands on its polygon sees all
  // of it or nothing, and where coordinates are rounded (turned, times 1e-6) only that rounding says which.
  Scene moved = oracle::block_room();
  for (Polygon& p : moved.polygons)
    if (p.name.starts_with("block"))
      for (std::uint32_t k = 0; k < p.corners; ++k) p.corner[k] += glm::dvec3(0.0123, 0.0217, 0);
  compare("block room x 1e-6", mapped(moved, [](glm::dvec3 p) { return 1e-6 * p; }));
  compare("block room turned", mapped(moved, [&](glm::dvec3 p) {
            return glm::dvec3(c * p.x - s * p.y, c * (s * p.x + c * p.y) - s * p.z,
                              s * (s * p.x + c * p.y) + c * p.z);
          }));
}

// Needles of 1 : 10^5 on the floor, and a lamp next to the ceiling.
TEST_F(Rounding, BoundHoldsWithSlivers) {
  Scene scene = oracle::box_scene({1, 1, 1}, {0.6}, {0});
  scene.materials.push_back({"light", {0.1}, {20}, {}});
  const auto add = [&](const std::vector<glm::dvec3>& corners, std::uint32_t material) {
    Polygon p;
    p.corners = std::uint32_t(corners.size());
    std::copy(corners.begin(), corners.end(), p.corner.begin());
    p.material = material;
    scene.polygons.push_back(p);
  };
  add({{0.4, 0.4, 0.999}, {0.4, 0.6, 0.999}, {0.6, 0.6, 0.999}, {0.6, 0.4, 0.999}}, 1);
  add({{0.2, 0.2, 0.3}, {0.9, 0.2, 0.3}, {0.55, 0.200007, 0.3}}, 0);
  add({{0.2, 0.7, 0.1}, {0.9, 0.7, 0.2}, {0.9, 0.700009, 0.2}, {0.2, 0.700009, 0.1}}, 0);
  compare("slivers", scene);
}

// Where rows feign light, nothing bounds their rounding either.
TEST_F(Rounding, IsInfiniteWhereTheSystemIsNotBounded) {
  Scene scene = oracle::block_room();
  for (Material& m : scene.materials) m.reflectance = {0.999999, 0.999999, 0.999999};
  SolveOptions options;
  options.mesh = {1, 0.5};
  options.closure = Closure::off;
  EXPECT_EQ(rounding_of(solve(single_, scene, options)), INFINITY);
}

}  // namespace
}  // namespace clrad
