#include <gtest/gtest.h>

#include "clrad/output.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using test::polygon;

// The six walls of the box [0, 2] x [0, 1] x [0, 3], facing inward, in the order -x, +x, -y, +y, -z, +z.
std::vector<Polygon> room() {
  const auto p = [](double x, double y, double z) { return glm::dvec3(2 * x, y, 3 * z); };
  return {polygon({p(0, 0, 0), p(0, 1, 0), p(0, 1, 1), p(0, 0, 1)}),
          polygon({p(1, 0, 0), p(1, 0, 1), p(1, 1, 1), p(1, 1, 0)}),
          polygon({p(0, 0, 0), p(0, 0, 1), p(1, 0, 1), p(1, 0, 0)}),
          polygon({p(0, 1, 0), p(1, 1, 0), p(1, 1, 1), p(0, 1, 1)}),
          polygon({p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0)}),
          polygon({p(0, 0, 1), p(0, 1, 1), p(1, 1, 1), p(1, 0, 1)})};
}

bool inside(const glm::dvec3& p) {
  return p.x > 0 && p.x < 2 && p.y > 0 && p.y < 1 && p.z > 0 && p.z < 3;
}

TEST(DefaultCamera, LooksInThroughTheOpenSide) {
  const glm::dvec3 centre(1, 0.5, 1.5);
  const std::array<glm::dvec3, 6> outward{
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  for (const int missing : {0, 1, 3, 4, 5}) {
    auto walls = room();
    walls.erase(walls.begin() + missing);
    const Camera camera = default_camera(test::scene(walls));
    EXPECT_FALSE(inside(camera.eye));
    EXPECT_EQ(camera.target, centre);
    EXPECT_NEAR(glm::dot(glm::normalize(camera.eye - centre), outward[missing]), 1, 1e-14)
        << "wall " << missing;
    // The whole opening is in the picture.
    const Polygon gap = room()[missing];
    for (std::uint32_t k = 0; k < 4; ++k) {
      const glm::dvec3 d = gap.corner[k] - camera.eye, forward = glm::normalize(centre - camera.eye);
      const glm::dvec3 across = d - glm::dot(d, forward) * forward;
      for (int c = 0; c < 3; ++c)
        EXPECT_LT(std::abs(across[c]),
                  std::tan(camera.vertical_field_of_view_rad / 2) * glm::dot(d, forward));
    }
  }
}

TEST(DefaultCamera, StandsInsideAClosedRoomWithAFreeView) {
  const Scene closed = test::scene(room());
  const Camera first = default_camera(closed);
  EXPECT_TRUE(inside(first.eye));
  EXPECT_TRUE(inside(first.target));
  // A screen right before that corner: another corner is taken.
  auto walls = room();
  const glm::dvec3 to_middle = first.target - first.eye, at = first.eye + 0.05 * to_middle;
  const glm::dvec3 u = 0.1 * glm::normalize(glm::cross(to_middle, {0, 1, 0})), v(0, 0.1, 0);
  walls.push_back(polygon({at - u - v, at + u - v, at + u + v, at - u + v}));
  const Camera second = default_camera(test::scene(walls));
  EXPECT_TRUE(inside(second.eye));
  EXPECT_GT(glm::length(second.eye - first.eye), 0.5);
}

TEST(DefaultCamera, LooksDownOnAFloor) {
  const Camera camera = default_camera(test::scene({room()[2]}));
  EXPECT_GT(camera.eye.y, 1);
  EXPECT_NEAR(camera.eye.x, 1, 1e-12);
}

TEST(DefaultCamera, UpIsWhereLampsShineFrom) {
  // The room lies on its side: what was y is z.
  auto walls = room();
  for (Polygon& wall : walls)
    for (auto& c : wall.corner) c = {c.x, -c.z, c.y};
  const auto camera_of = [&](int lamp, const char* file = "room.obj") {
    Scene scene = test::scene(walls);
    scene.file = file;
    scene.materials.resize(1);
    scene.materials.push_back(scene.materials[0]);
    scene.materials[0].emitted_exitance.assign(scene.bands.size(), 0.1);
    scene.materials[1].emitted_exitance.assign(scene.bands.size(), 50);
    for (auto& p : scene.polygons) p.material = 0;
    scene.polygons[std::size_t(lamp)].material = 1;
    return default_camera(scene);
  };
  const Camera lit_from_above = camera_of(3);  // the ceiling, at z = 1
  EXPECT_EQ(lit_from_above.up, glm::dvec3(0, 0, 1));
  EXPECT_GT(lit_from_above.eye.z, 0.5);
  EXPECT_LT(lit_from_above.target.z, 0.5);
  EXPECT_GT(glm::length(glm::dvec2(lit_from_above.eye - lit_from_above.target)), 1);
  EXPECT_EQ(camera_of(3, "room.glb").up, glm::dvec3(0, 1, 0));  // glTF says so
  // From below or from the side lamps do not tell.
  for (const int lamp : {2, 0, 5}) EXPECT_EQ(camera_of(lamp).up, glm::dvec3(0, 1, 0)) << lamp;
  // Upright again, with a window in the wall at z = 3.
  walls = room();
  EXPECT_EQ(camera_of(5).up, glm::dvec3(0, 1, 0));
}

}  // namespace
}  // namespace clrad
