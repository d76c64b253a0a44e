#include <gtest/gtest.h>

#include <set>

#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/extent.hpp"
#include "tradeoff/settings.hpp"

namespace clrad {
namespace {

TEST(TradeoffSettings, TheLadderGetsFiner) {
  const auto rungs = ladder_settings(4, {});
  ASSERT_GE(rungs.size(), 5u);
  for (std::size_t i = 1; i < rungs.size(); ++i) {
    EXPECT_LE(rungs[i].options.mesh.patch_edge_m, rungs[i - 1].options.mesh.patch_edge_m);
    EXPECT_LE(rungs[i].options.mesh.element_edge_m, rungs[i - 1].options.mesh.element_edge_m);
    EXPECT_GE(rungs[i].options.light_samples, rungs[i - 1].options.light_samples);
    EXPECT_LE(rungs[i].options.converge, rungs[i - 1].options.converge);
  }
}

// What is printed is what was measured, and no edge is cut into a piece more for its last digit.
TEST(TradeoffSettings, EdgesArePrintedAsTheyAreAndCutAsMeant) {
  const Scene room = oracle::block_room();
  for (const double scale : {1.0, 1 / 3.0, 0.5592 / 4}) {
    Scene scene = room;
    for (Polygon& p : scene.polygons)
      for (glm::dvec3& c : p.corner) c *= scale;
    const double extent = extent_m(scene);
    const TradeoffSetting default_mesh = ladder_settings(extent, {})[5];  // extent / 8 and / 64
    const MeshOptions& mesh = default_mesh.options.mesh;
    EXPECT_LE(count_mesh(scene, mesh).patches, count_mesh(scene, {}).patches) << extent;
    EXPECT_LE(count_mesh(scene, mesh).elements, count_mesh(scene, {}).elements) << extent;
    const std::string text = solve_arguments(default_mesh, false);
    const double printed = std::stod(text.substr(text.find("--patch-edge ") + 13));
    EXPECT_EQ(printed, mesh.patch_edge_m) << text;
  }
}

TEST(TradeoffSettings, AVariationDiffersFromTheMiddleInItsKindAlone) {
  const TradeoffSetting middle = ladder_settings(4, {})[5];
  std::set<std::string> kinds, names;
  for (const TradeoffSetting& s : variations_of(middle, 4)) {
    kinds.insert(s.kind);
    EXPECT_TRUE(names.insert(s.name).second) << s.name;
    EXPECT_NE(solve_arguments(s, false), solve_arguments(middle, false)) << s.name;
    const SolveOptions &o = s.options, &m = middle.options;
    EXPECT_EQ(s.kind == "patches", o.mesh.patch_edge_m != m.mesh.patch_edge_m) << s.name;
    EXPECT_EQ(s.kind == "convergence", o.converge != m.converge) << s.name;
    EXPECT_EQ(s.kind == "adaptive", o.adaptive.tolerance != 0) << s.name;
    EXPECT_EQ(s.kind == "estimator", o.estimator != m.estimator) << s.name;
    EXPECT_EQ(s.kind == "engine", o.engine != m.engine) << s.name;
    EXPECT_EQ(s.kind == "precision", s.precision != middle.precision) << s.name;
    EXPECT_LE(o.mesh.element_edge_m, o.mesh.patch_edge_m) << s.name;
  }
  for (const char* kind : {"samples", "light samples", "elements", "patches", "adaptive", "convergence",
                           "estimator", "precision", "engine"})
    EXPECT_TRUE(kinds.count(kind)) << kind;
}

TEST(TradeoffSettings, ArgumentsNameWhatIsNotUsual) {
  TradeoffSetting s = ladder_settings(1, {})[5];
  EXPECT_EQ(solve_arguments(s, false),
            "--patch-edge 0.125 --element-edge 0.01563 --samples 4 --light-samples 256 --converge 0.001");
  s.options.estimator = Estimator::disk, s.options.engine = "chop", s.options.near_field = false;
  s.options.adaptive.tolerance = 0.05, s.precision = Precision::float64;
  EXPECT_EQ(
      solve_arguments(s, true),
      "--patch-edge 0.125 --element-edge 0.01563 --samples 4 --light-samples 256 --converge 0.001 "
      "--sensor-rays 8192 "
      "--form-factor disk --adaptive 0.05 --max-level 3 --no-near-field --engine chop --precision double");
  EXPECT_EQ(solve_arguments(target_settings({})[1], false), "--target-error 0.01");
}

}  // namespace
}  // namespace clrad
