#include "device/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>

namespace clrad {
namespace {

TEST(Parallel, RangesAreAllOfItOnce) {
  for (const unsigned parts : {1u, 2u, 3u, 7u}) {
    std::vector<std::atomic<int>> seen(20);
    std::vector<std::atomic<int>> of_part(parts);
    in_parallel(seen.size(), parts, [&](std::size_t begin, std::size_t end, unsigned part) {
      ++of_part[part];
      for (std::size_t i = begin; i < end; ++i) ++seen[i];
    });
    for (const auto& times : seen) EXPECT_EQ(times, 1);
    for (const auto& times : of_part) EXPECT_EQ(times, 1);
  }
}

TEST(Parallel, TheFirstRangesExceptionIsThrownWhenAllHaveEnded) {
  std::atomic<int> ended = 0;
  try {
    in_parallel(8, 4, [&](std::size_t, std::size_t, unsigned part) {
      ++ended;
      if (part > 0) throw std::runtime_error(std::to_string(part));
    });
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_STREQ(e.what(), "1");
  }
  EXPECT_EQ(ended, 4);
}

}  // namespace
}  // namespace clrad
