// Times of things that take turns, and what is quoted of them.
#pragma once
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

namespace clrad::bench {

using Clock = std::chrono::steady_clock;
inline double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

inline double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, std::size_t(q * double(v.size())))];
}
inline double median(const std::vector<double>& v) {
  return quantile(v, 0.5);
}

/// Runs everything once to warm up, then `rounds` rounds in which each has its turn. Seconds, [what][round].
inline std::vector<std::vector<double>> alternate(const std::vector<std::function<void()>>& what,
                                                  int rounds) {
  for (const auto& f : what) f();
  std::vector<std::vector<double>> seconds(what.size());
  for (int r = 0; r < rounds; ++r)
    for (std::size_t i = 0; i < what.size(); ++i) {
      const auto start = Clock::now();
      what[i]();
      seconds[i].push_back(since(start));
    }
  return seconds;
}

/// Median over the rounds of a / b within each.
inline double ratio(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> each;
  for (std::size_t i = 0; i < a.size(); ++i) each.push_back(a[i] / b[i]);
  return median(each);
}

inline nlohmann::json spread(const std::vector<double>& v) {
  return {{"median", median(v)},          {"min", quantile(v, 0)},
          {"quarter", quantile(v, 0.25)}, {"three_quarters", quantile(v, 0.75)},
          {"max", quantile(v, 1)},        {"runs", v.size()}};
}

/// How busy the machine is: processes that want a core, averaged over a minute.
inline double load() {
  double average = 0;
  return getloadavg(&average, 1) == 1 ? average : -1;
}

}  // namespace clrad::bench
