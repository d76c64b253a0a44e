// Columns that are traced together are those traced one by one.
#include "solve/trace.hpp"

#include <gtest/gtest.h>

#include "clrad/solver.hpp"

namespace clrad {
namespace {

// What a room refined is like where columns at new vertices come `memory` at a time.
Solution refined_room(std::uint64_t memory_bytes, bool clipped) {
  Device device({.memory_bytes = memory_bytes});
  SolveOptions o;
  o.mesh = {.patch_edge_m = 0.5, .element_edge_m = 0.25};
  o.adaptive.tolerance = 0.05, o.adaptive.max_level = 1, o.adaptive.every = 16;
  o.visibility_exact = clipped, o.error = false, o.converge = 1e-2;
  return solve(device, load_scene(std::string(CLRAD_SCENES) + "/block_room.obj"), o);
}

TEST(Trace, BitsDoNotDependOnHowManyAtATime) {
  constexpr std::uint64_t little = 24 << 20, much = 4ull << 30;
  for (const bool clipped : {false, true}) {
    const Solution few = refined_room(little, clipped), many = refined_room(much, clipped);
    // So many that the little memory takes them in several parts (columns_at_once: 1/64 of it, 16 bytes a vertex), the other in fewer.
    ASSERT_GT(many.report.refinement.vertices_added, 1000u);
    ASSERT_GT(many.report.shoots * many.report.refinement.vertices_added * 16, little / 64);
    EXPECT_EQ(few.vertex_irradiance, many.vertex_irradiance);
    EXPECT_EQ(few.report.rays, many.report.rays);
  }
}

}  // namespace
}  // namespace clrad
