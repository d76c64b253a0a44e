// What the near field takes from some vertices others get: displayed irradiance is absorbed as fast as light is emitted.
#include "solve/near_balance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

// What the surfaces absorb of the irradiance of their vertices, as a share of what is emitted.
double absorbed(const Solution& s) {
  double power = 0, emitted = 0;
  for (const Element& e : s.mesh.elements) {
    const Material& m = s.material_of(s.mesh.patches[e.patch].polygon);
    emitted += e.area_m2 * m.emitted_exitance[0];
    for (std::size_t k = 0; k < 4; ++k)
      if (e.vertex[k] != 0xffffffffu)
        power += e.area_m2 * e.weight[k] * (1 - m.reflectance[0]) * s.vertex_irradiance[e.vertex[k]];
  }
  return power / emitted;
}

Scene uneven_room(double reflectance) {
  Scene scene = oracle::box_scene({1, 1, 1}, {reflectance}, {0});
  scene.materials.push_back({"light", {0.1}, {1}, {}});
  scene.materials.push_back({"dark", {0.05}, {0}, {}});
  scene.polygons[0].material = 1;
  scene.polygons[4].material = 2;
  return scene;
}

SolveOptions unhindered() {
  SolveOptions options;
  options.samples = 1;
  options.light_samples = 0;
  options.converge = 1e-6;
  options.mesh = {1.0 / 4, 1.0 / 16};
  return options;
}

// By how much the near field changes what is absorbed; `patches`: what is without.
double change_by_near_field(const Scene& scene, double* patches = nullptr) {
  SolveOptions options = unhindered();
  options.near_field = false;
  const double without = absorbed(solve(test::device(), scene, options));
  if (patches) *patches = without;
  options.near_field = true;
  return absorbed(solve(test::device(), scene, options)) - without;
}

// Nothing stands between and the room is closed, so what its patches absorb is known; elements weigh their vertices as patches do. What
// is sent on is solved to about what floats round, sums of some thousand vertices.
TEST(NearBalance, WhatIsAbsorbedIsWhatIsEmitted) {
  double patches = 0;
  EXPECT_NEAR(change_by_near_field(uneven_room(0.8), &patches), 0, 1e-5);
  EXPECT_NEAR(patches, 1, 1e-3);  // rows are closed at patches; vertices have the mesh's error
}

// The same where walls hand on too much, so that near fields are left alone. Were it nothing, the test above would say nothing.
TEST(NearBalance, NearFieldsAloneDoNotKeepTheLight) {
  EXPECT_GT(std::abs(change_by_near_field(uneven_room(0.95))), 1e-4);
}

// Light that leaves through a missing wall is not made up for: the others receive no more than all that is sent to them.
TEST(NearBalance, OpenRoomsReceiveNoMoreThanIsSent) {
  Scene scene = uneven_room(0.5);
  scene.polygons.erase(scene.polygons.begin() + 1);
  const Solution s = solve(test::device(), scene, unhindered());
  EXPECT_LT(absorbed(s), 1);
  SolveOptions fine = unhindered();
  fine.mesh = {1.0 / 16, 1.0 / 16};
  EXPECT_NEAR(absorbed(s), absorbed(solve(test::device(), scene, fine)), 0.005);
}

}  // namespace
}  // namespace clrad
