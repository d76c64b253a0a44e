#include <gtest/gtest.h>

#include "scene/files.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;

// A floor of 4 x 4 on line 7, then a face of the given corners on line 11 or 12.
std::vector<Diagnostic> overlaps(const std::string& vertices, const std::string& face) {
  Folder folder;
  return of_rule(
      check_scene(write_obj(folder, "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nf 1 2 3 4\n" + vertices + face)),
      "overlap");
}

TEST(SceneOverlap, OnTopFacingTheSameWay) {
  const auto found = overlaps("v 1 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\n", "f 5 6 7 8\n");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].where.line, 12u);
  EXPECT_NE(found[0].message.find("a.obj:7"), std::string::npos);
  EXPECT_EQ(overlaps("v 3 3 0\nv 9 3 0\nv 3 9 0\n", "f 5 6 7\n").size(), 1u) << "partly";
  EXPECT_EQ(overlaps("v -9 -9 0\nv 99 -9 0\nv -9 99 0\n", "f 5 6 7\n").size(), 1u) << "all of it";
}

TEST(SceneOverlap, NotBackToBackNorBesideNorAbove) {
  EXPECT_TRUE(overlaps("v 1 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\n", "f 8 7 6 5\n").empty());
  EXPECT_TRUE(overlaps("v 4 0 0\nv 8 0 0\nv 8 4 0\nv 4 4 0\n", "f 5 6 7 8\n").empty());
  EXPECT_TRUE(overlaps("v 5 3 0\nv 5 5 0\nv 3 5 0\n", "f 5 6 7\n").empty())
      << "boxes overlap, triangles do not";
  EXPECT_TRUE(overlaps("v 1 1 1e-6\nv 2 1 1e-6\nv 2 2 1e-6\nv 1 2 1e-6\n", "f 5 6 7 8\n").empty());
  EXPECT_TRUE(overlaps("", "f 2 3 4 1\n").empty()) << "a duplicate, reported as such";
}

}  // namespace
