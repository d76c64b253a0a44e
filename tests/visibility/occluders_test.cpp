// What engines get of the input, whatever threads prepared it.
#include "visibility/occluders.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "clrad/error.hpp"
#include "device/divided.hpp"

namespace clrad {
namespace {

// Every seventh has no area; the first and the last few, too, so that a part begins and ends with some.
std::vector<OccluderTriangle> many() {
  std::mt19937_64 random(20701);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<OccluderTriangle> triangles;
  for (std::uint32_t i = 0; i < 45000; ++i) {
    OccluderTriangle t{{}, i % 900, i};
    for (auto& c : t.corner) c = {unit(random), unit(random), unit(random)};
    if (i % 7 == 0 || i < 3 || i > 44990) t.corner[2] = t.corner[1];
    triangles.push_back(t);
  }
  return triangles;
}

template <class T>
bool same(const Array<T>& a, const Array<T>& b) {
  const auto x = a.download(), y = b.download();
  return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(T)) == 0;
}

TEST(Occluders, OneThreadAndManyKeepTheSameInOrder) {
  const auto triangles = many();
  Device all, one({.cores = test::one_core()});
  const Occluders a(all, triangles), b(one, triangles);
  EXPECT_EQ(a.count, b.count);
  EXPECT_TRUE(same(a.triangles, b.triangles));
  EXPECT_TRUE(same(a.facets, b.facets));
  EXPECT_TRUE(same(a.input_index, b.input_index));
  EXPECT_EQ(a.box_low, b.box_low);
  EXPECT_EQ(a.box_high, b.box_high);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    if (triangles[i].corner[1] != triangles[i].corner[2]) kept.push_back(i);
  EXPECT_EQ(a.input_index.download(), kept);
}

TEST(Occluders, WhatIsOutsideTheFrameIsRefusedFromAnyThread) {
  auto triangles = many();
  triangles[44000].corner[1].y = 5;
  Device device;
  try {
    Occluders(device, triangles);
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find(", 5, "), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace clrad
