#include <gtest/gtest.h>

#include "clrad/tradeoff.hpp"

namespace clrad {
namespace {

TradeoffRun took(double seconds, double rms) {
  TradeoffRun run;
  run.seconds = seconds, run.rms_relative = rms;
  return run;
}

using Indices = std::vector<std::size_t>;

TEST(ParetoFront, HoldsWhatNothingBeatsInBoth) {
  // 1 is slower and worse than 2; 3 as slow as 2 and worse; 4 better but slow; 5 slow and no better than 4.
  const std::vector<TradeoffRun> runs{took(1, 0.1),  took(3, 0.09), took(2, 0.05),
                                      took(2, 0.06), took(9, 0.01), took(10, 0.01)};
  EXPECT_EQ(pareto_front(runs), (Indices{0, 2, 4}));
}

TEST(ParetoFront, LeavesOutWhatHasNoError) {
  EXPECT_EQ(pareto_front({took(1, NAN), took(2, 0.1), took(0.5, NAN)}), (Indices{1}));
  EXPECT_TRUE(pareto_front({}).empty());
  EXPECT_TRUE(pareto_front({took(1, NAN)}).empty());
}

TEST(ParetoFront, OfEqualRunsTheFirst) {
  EXPECT_EQ(pareto_front({took(1, 0.1), took(1, 0.1)}), (Indices{0}));
}

TEST(TradeoffAdvice, IsTheCheapestWithinTheTarget) {
  const std::vector<TradeoffRun> runs{took(4, 0.001), took(1, 0.02), took(2, 0.01), took(3, 0.002),
                                      took(0.1, NAN)};
  EXPECT_EQ(cheapest_within(runs, 0.05).run, 1u);
  EXPECT_EQ(cheapest_within(runs, 0.01).run, 2u);  // at the target is within it
  EXPECT_EQ(cheapest_within(runs, 0.001).run, 0u);
  EXPECT_EQ(cheapest_within(runs, 0.0005).run, SIZE_MAX);
  EXPECT_EQ(cheapest_within(runs, 0.0005).target_relative, 0.0005);
}

}  // namespace
}  // namespace clrad
