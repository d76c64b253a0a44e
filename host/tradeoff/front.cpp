// Which of many settings are worth their time.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "clrad/tradeoff.hpp"

namespace clrad {

std::vector<std::size_t> pareto_front(const std::vector<TradeoffRun>& runs) {
  std::vector<std::size_t> order(runs.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::erase_if(order, [&](std::size_t i) { return std::isnan(runs[i].rms_relative); });
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const TradeoffRun &x = runs[a], &y = runs[b];
    if (x.seconds != y.seconds) return x.seconds < y.seconds;
    return x.rms_relative != y.rms_relative ? x.rms_relative < y.rms_relative : a < b;
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order)
    if (front.empty() || runs[i].rms_relative < runs[front.back()].rms_relative) front.push_back(i);
  return front;
}

TradeoffAdvice cheapest_within(const std::vector<TradeoffRun>& runs, double target_relative) {
  TradeoffAdvice advice{target_relative};
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].rms_relative <= target_relative &&
        (advice.run == SIZE_MAX || runs[i].seconds < runs[advice.run].seconds))
      advice.run = i;
  return advice;
}

}  // namespace clrad
