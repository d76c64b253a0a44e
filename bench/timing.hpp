// Times of things that take turns, and what is quoted of them.
#pragma once
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
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

/// Cores that other processes kept busy (and that the hypervisor took away) between start and stop; 0 where there is no
/// /proc/stat. That counts in 10 ms: not for short times.
class Others {
 public:
  Others() { read(busy_, mine_); }
  double cores() const {
    double busy = 0, mine = 0;
    read(busy, mine);
    return std::max(0.0, (busy - busy_) - (mine - mine_)) / std::max(1e-3, since(start_));
  }

 private:
  Clock::time_point start_ = Clock::now();
  double busy_ = 0, mine_ = 0;

  static void read(double& busy, double& mine) {
    std::ifstream stat("/proc/stat");
    std::string name;
    double user = 0, nice = 0, system = 0, idle = 0, wait = 0, irq = 0, soft = 0, steal = 0;
    stat >> name >> user >> nice >> system >> idle >> wait >> irq >> soft >> steal;
    busy = (user + nice + system + irq + soft + steal) / double(sysconf(_SC_CLK_TCK));
    rusage u{};
    getrusage(RUSAGE_SELF, &u);
    mine = double(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
           1e-6 * double(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
  }
};

struct QuietRounds {
  std::vector<std::vector<double>> seconds;  ///< [what][round]
  double others = 0;                         ///< busiest of the rounds [cores]
};

/// As alternate, but on a machine that others use, too: goes on for up to `most` rounds or two minutes until `rounds` of
/// them had less than 0.03 cores busy with anything else, and gives the `rounds` quietest ones.
inline QuietRounds alternate_quietly(const std::vector<std::function<void()>>& what, std::size_t rounds,
                                     int most) {
  for (const auto& f : what) f();
  std::vector<std::pair<double, std::vector<double>>> all;
  std::size_t quiet = 0;
  const auto begin = Clock::now();
  for (int r = 0; (r < most && since(begin) < 120 && quiet < rounds) || all.size() < rounds; ++r) {
    const Others others;
    std::vector<double> seconds;
    for (const auto& f : what) {
      const auto start = Clock::now();
      f();
      seconds.push_back(since(start));
    }
    all.emplace_back(others.cores(), seconds);
    quiet += all.back().first < 0.03;
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  QuietRounds result{std::vector<std::vector<double>>(what.size()), all[rounds - 1].first};
  for (std::size_t r = 0; r < rounds; ++r)
    for (std::size_t i = 0; i < what.size(); ++i) result.seconds[i].push_back(all[r].second[i]);
  return result;
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
